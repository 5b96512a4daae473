// Stripe centres against exact stripes: error beside the Cramer-Rao bound, predicted sigma, reasons, several stripes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/parallel.hpp"
#include "laser/stripe.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;

struct Scene {
  int height = 300, width = 320;
  double slope_deg = 0, sigma = 1.5, peak = 100, noise = 3.2, background = 20;
  double at_x = 160.3;  // where the stripe crosses the middle row
};

// A stripe whose slope is `slope_deg` everywhere needs a wide image: the stripe jumps back where it would leave it.
struct Rendered {
  std::vector<float> pixels;
  std::vector<double> centre;
  ImageView view;
};
double row_centre(const Scene& s, int y) {
  const double t = std::tan(s.slope_deg * kPi / 180), span = s.width - 100;
  const double x = s.at_x + t * y;
  return 50 + std::fmod(std::fmod(x, span) + span, span);
}
Rendered render(const Scene& s, unsigned seed) {
  Rendered r;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, s.noise);
  r.pixels.resize(static_cast<std::size_t>(s.height) * s.width);
  const double cosine = std::cos(s.slope_deg * kPi / 180), along = s.sigma / cosine;
  for (int y = 0; y < s.height; ++y) {
    r.centre.push_back(row_centre(s, y));
    for (int x = 0; x < s.width; ++x) {
      const double a = (x - 0.5 - r.centre.back()) / along / std::sqrt(2.0), b = a + 1 / along / std::sqrt(2.0);
      const double mean = s.peak * along * std::sqrt(kPi / 2) * (std::erf(b) - std::erf(a));  // over the pixel
      r.pixels[static_cast<std::size_t>(y) * s.width + x] = static_cast<float>(s.background + mean + noise(random));
    }
  }
  r.view = {
      r.pixels.data(), ImageView::Type::kF32, s.height, s.width, static_cast<std::int64_t>(s.width * sizeof(float)),
      sizeof(float)};
  return r;
}

struct Errors {
  double bias = 0, rms = 0, chi2 = 0, sigma = 0;
  int count = 0;
};
Errors errors(const Scene& s, const Rendered& r, const Stripe& stripe) {
  Errors e;
  const double cosine = std::cos(s.slope_deg * kPi / 180);
  for (std::size_t y = 0; y < r.centre.size(); ++y) {
    if (stripe.reason[y] != 0) continue;
    const double d = (stripe.centre[y] - r.centre[y]) * cosine;
    e.bias += d, e.rms += d * d;
    e.chi2 += std::pow((stripe.centre[y] - r.centre[y]) / stripe.sigma[y], 2);
    ++e.count;
  }
  e.bias /= e.count, e.rms = std::sqrt(e.rms / e.count), e.chi2 /= e.count;
  return e;
}

// eq. 7: of the Gaussian profile's centre along the line, times the cosine.
double bound(const Scene& s) {
  const double cosine = std::cos(s.slope_deg * kPi / 180), along = std::sqrt(s.sigma * s.sigma / (cosine * cosine));
  return cosine * std::sqrt(2 * along / std::sqrt(kPi)) * s.noise / s.peak;
}

// REQ-LASER-001
TEST(Stripe, GaussianReachesTheBound) {
  for (const double slope : {0.0, 30.0, 45.0, 60.0}) {
    Scene s;
    s.slope_deg = slope;
    s.height = 2000;
    const Rendered r = render(s, 7);
    StripeOptions o;
    o.min_length = 3;
    const Stripe stripe = extract_stripe({}, r.view, nullptr, o);
    const Errors e = errors(s, r, stripe);
    EXPECT_GT(e.count, 0.95 * s.height) << slope;
    EXPECT_LT(e.rms, 1.15 * bound(s)) << slope;
    EXPECT_LT(std::abs(e.bias), 0.01) << slope;
    EXPECT_NEAR(e.chi2, 1, 0.12) << slope;
    EXPECT_NEAR(stripe.noise, s.noise, 0.1 * s.noise);
  }
}

// REQ-LASER-001
TEST(Stripe, CentroidAndRidgeAreUnbiasedAndKnowTheirSigma) {
  for (const StripeMethod method : {StripeMethod::kCentroid, StripeMethod::kRidge}) {
    Scene s;
    s.slope_deg = 5;
    s.at_x = 10;
    s.height = 1500;
    const Rendered r = render(s, 9);
    StripeOptions o;
    o.method = method;
    const Stripe stripe = extract_stripe({}, r.view, nullptr, o);
    const Errors e = errors(s, r, stripe);
    EXPECT_GT(e.count, 0.8 * s.height);
    EXPECT_LT(std::abs(e.bias), 0.01);
    EXPECT_NEAR(e.chi2, 1, 0.25) << static_cast<int>(method);
    EXPECT_LT(e.rms, method == StripeMethod::kRidge ? bound(s) : 2.2 * bound(s));
  }
}

TEST(Stripe, ColumnsAndTypesAgree) {
  Scene s;
  s.noise = 1;
  const Rendered r = render(s, 3);
  std::vector<std::uint8_t> bytes(r.pixels.size()), turned(r.pixels.size());
  std::vector<std::uint16_t> words(r.pixels.size());
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      const std::size_t k = static_cast<std::size_t>(y) * s.width + x;
      bytes[k] = static_cast<std::uint8_t>(std::lround(r.pixels[k]));
      words[k] = bytes[k];
      turned[static_cast<std::size_t>(x) * s.height + y] = bytes[k];
    }
  }
  const ImageView u8{bytes.data(), ImageView::Type::kU8, s.height, s.width, s.width, 1};
  const ImageView u16{words.data(), ImageView::Type::kU16, s.height, s.width, 2 * s.width, 2};
  const ImageView across{turned.data(), ImageView::Type::kU8, s.width, s.height, s.height, 1};
  for (const StripeMethod method : {StripeMethod::kCentroid, StripeMethod::kGaussian, StripeMethod::kRidge}) {
    StripeOptions o;
    o.method = method;
    const Stripe a = extract_stripe({}, u8, nullptr, o), b = extract_stripe({}, u16, nullptr, o);
    sgrt::Run avx2;
    avx2.isa = detect_isa();
    const Stripe c = extract_stripe(avx2, u8, nullptr, o);
    o.columns = true;
    const Stripe d = extract_stripe({}, across, nullptr, o);
    ASSERT_GT(a.found, 250);
    for (std::size_t y = 0; y < a.centre.size(); ++y) {
      if (a.reason[y] != 0) continue;
      EXPECT_EQ(a.centre[y], b.centre[y]);
      EXPECT_EQ(a.centre[y], c.centre[y]);
      EXPECT_EQ(a.centre[y], d.centre[y]);
    }
  }
}

// REQ-DET-007
TEST(Stripe, ResultDoesNotDependOnThreads) {
  const Rendered r = render({}, 3);
  ThreadPool pool(3);
  sgrt::Run run;
  run.pool = &pool;
  const Stripe a = extract_stripe({}, r.view, nullptr, {}), b = extract_stripe(run, r.view, nullptr, {});
  EXPECT_EQ(a.reason, b.reason);
  for (std::size_t y = 0; y < a.centre.size(); ++y) EXPECT_TRUE(a.reason[y] != 0 || a.centre[y] == b.centre[y]);
}

// A weaker reflection beside the stripe, a bright spot and a broad lamp do not draw it away.
TEST(Stripe, StrongestContinuousStripeWins) {
  Scene s;
  s.noise = 1;
  Rendered r = render(s, 5);
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      float& v = r.pixels[static_cast<std::size_t>(y) * s.width + x];
      v += static_cast<float>(45 * std::exp(-std::pow((x - r.centre[y] - 40) / 1.5, 2) / 2));
      if (y > 100 && y < 104) v += static_cast<float>(140 * std::exp(-std::pow((x - 60) / 1.5, 2) / 2));
      v += static_cast<float>(60 * std::exp(-std::pow((x - 250) / 25.0, 2) / 2));
    }
  }
  const Stripe stripe = extract_stripe({}, r.view, nullptr, {});
  EXPECT_GT(stripe.found, 290);
  for (std::size_t y = 0; y < r.centre.size(); ++y) {
    if (stripe.reason[y] == 0) {
      EXPECT_NEAR(stripe.centre[y], r.centre[y], 0.3);
    }
  }
}

// REQ-LASER-002
TEST(Stripe, TwoLikeStripesAreAmbiguous) {
  Scene s;
  s.noise = 1;
  Rendered r = render(s, 5);
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x)
      r.pixels[static_cast<std::size_t>(y) * s.width + x] +=
          static_cast<float>(95 * std::exp(-std::pow((x - r.centre[y] - 40) / 1.5, 2) / 2));
  }
  const Stripe stripe = extract_stripe({}, r.view, nullptr, {});
  EXPECT_EQ(stripe.status, Status::kNotFound);
  EXPECT_EQ(stripe.reason_count[static_cast<int>(LineReason::kAmbiguous)], s.height);
}

TEST(Stripe, SaturationKeepsTheCentre) {
  Scene s;
  s.noise = 1.5;
  s.peak = 600;
  s.sigma = 2;
  const Rendered r = render(s, 5);
  std::vector<std::uint8_t> bytes(r.pixels.size());
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(std::lround(std::min(255.0F, std::max(0.0F, r.pixels[i]))));
  const ImageView u8{bytes.data(), ImageView::Type::kU8, s.height, s.width, s.width, 1};
  const Stripe stripe = extract_stripe({}, u8, nullptr, {});
  EXPECT_GT(stripe.found, 290);
  const Errors e = errors(s, r, stripe);
  EXPECT_LT(e.rms, 0.02);
  std::vector<std::uint8_t> white(bytes.size(), 255);
  const ImageView clipped{white.data(), ImageView::Type::kU8, s.height, s.width, s.width, 1};
  EXPECT_EQ(extract_stripe({}, clipped, nullptr, {}).status, Status::kNotFound);
}

// Light that scatters to one side widens that flank; the line is refused rather than shifted.
// The centroid and the ridge of a clipped stripe, and of one whose window leaves the image.
TEST(Stripe, CentroidAndRidgeOfAClippedStripe) {
  for (const StripeMethod method : {StripeMethod::kCentroid, StripeMethod::kRidge}) {
    Scene s;
    s.slope_deg = 10;
    s.peak = 300;
    s.sigma = 2.5;
    s.noise = 1;
    s.height = 200;
    const Rendered r = render(s, 3);
    StripeOptions o;
    o.method = method;
    o.saturation = 200;  // a row is clipped over 4 px; the flanks are left
    Rendered clipped = r;
    for (float& g : clipped.pixels) g = std::min(g, 200.F);
    clipped.view.data = clipped.pixels.data();
    const Stripe stripe = extract_stripe(sgrt::Run{}, clipped.view, nullptr, o);
    const Errors e = errors(s, clipped, stripe);
    EXPECT_GT(e.count, s.height / 2) << static_cast<int>(method);
    EXPECT_LT(std::abs(e.bias), 0.05) << static_cast<int>(method);
    EXPECT_LT(e.rms, 0.15) << static_cast<int>(method);
  }
}

TEST(Stripe, LopsidedProfileIsRefused) {
  Scene s;
  s.noise = 0.5;
  Rendered r = render(s, 5);
  for (int y = 150; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      const double d = x - r.centre[y];
      if (d > 0)
        r.pixels[static_cast<std::size_t>(y) * s.width + x] +=
            static_cast<float>(100 * (std::exp(-d * d / 2 / 49) - std::exp(-d * d / 2 / 2.25)));
    }
  }
  const Stripe stripe = extract_stripe({}, r.view, nullptr, {});
  for (int y = 0; y < s.height; ++y) {
    EXPECT_EQ(stripe.reason[y] == static_cast<int>(LineReason::kEdge), y >= 150) << y << " " << stripe.asymmetry[y];
  }
}

TEST(Stripe, DarkFrameTakesTheRoomAway) {
  Scene s;
  s.noise = 0;
  Rendered r = render(s, 5);
  std::vector<float> dark(r.pixels.size());
  std::mt19937 random(1);
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      const std::size_t k = static_cast<std::size_t>(y) * s.width + x;
      dark[k] = static_cast<float>(80 * ((x / 20 + y / 20) % 2) + 10);
      r.pixels[k] += dark[k] - 20 + static_cast<float>(std::normal_distribution<double>(0, 1)(random));
      dark[k] += static_cast<float>(std::normal_distribution<double>(0, 1)(random));
    }
  }
  ImageView below = r.view;
  below.data = dark.data();
  const Stripe stripe = extract_stripe({}, r.view, &below, {});
  const Errors e = errors(s, r, stripe);
  EXPECT_GT(e.count, 290);
  EXPECT_LT(e.rms, 0.03);
  EXPECT_NEAR(stripe.noise, std::sqrt(2.0), 0.2);
}

TEST(Stripe, BadOptionsAreNamed) {
  const Rendered r = render({}, 1);
  StripeOptions o;
  o.max_asymmetry = 0;
  EXPECT_THROW(extract_stripe({}, r.view, nullptr, o), Error);
  o = {};
  o.noise = std::nan("");
  EXPECT_THROW(extract_stripe({}, r.view, nullptr, o), Error);
  ImageView small = r.view;
  small.width = 10;
  EXPECT_THROW(extract_stripe({}, r.view, &small, {}), Error);
  EXPECT_EQ(extract_stripe({}, small, nullptr, {}).status, Status::kNotFound);
}

TEST(Stripe, NoStripeAndNanPixels) {
  Scene s;
  s.peak = 0;
  Rendered r = render(s, 1);
  EXPECT_EQ(extract_stripe({}, r.view, nullptr, {}).status, Status::kNotFound);
  for (float& v : r.pixels) v = std::nanf("");
  EXPECT_EQ(extract_stripe({}, r.view, nullptr, {}).found, 0);
}

}  // namespace
}  // namespace sgrt
