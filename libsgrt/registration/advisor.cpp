// Forecasts of regions, and the climb to a better one. docs/theory/icp.md section 6.
#include "registration/advisor.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "registration/predict.hpp"
#include "registration/reference.hpp"
#include "registration/words.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSlopeFloor = 1e-3;   // rad: a motion that is seen by less relief is as good as not seen
constexpr double kDefaultShare = 0.4;  // of the points, where no candidate tells how large a region may be
constexpr int kVertices = 24;
constexpr int kGrid = 7;  // places along each side of the surface's box on which a climb may begin
constexpr std::size_t kClimbs = 6;
constexpr int kRounds = 24;

// An ellipse seen from above.
struct Ellipse {
  Vec2 centre = Vec2::Zero();
  double a = 0, b = 0, turn = 0;  // half axes, mm; rad
};

Roi roi_of(const Ellipse& e) {
  Roi roi;
  roi.polygon.reserve(kVertices);
  for (int i = 0; i < kVertices; ++i) {
    const double t = 2 * kPi * i / kVertices;
    const Vec2 x(e.a * std::cos(t), e.b * std::sin(t));
    roi.polygon.push_back(e.centre + Eigen::Rotation2Dd(e.turn) * x);
  }
  return roi;
}

class Adviser {
 public:
  Adviser(const Run& run, const Surface& reference, const Vec3& isocentre, const AdviceOptions& options)
      : prepared_(prepare_reference(run, reference, nullptr)), isocentre_(isocentre), options_(options) {
    const SurfelLevel& level = prepared_->field.levels[0];
    const auto n = static_cast<Eigen::Index>(level.surfels.size());
    places_.points.resize(n, 3);
    places_.normals.resize(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const kernels::Surfel& s = level.surfels[static_cast<std::size_t>(i)];
      places_.points.row(i) = (point_of(s) + prepared_->field.centre).transpose();
      places_.normals.row(i) = normal_of(s).transpose();
      if (i > 0) all_ += level.samples[static_cast<std::size_t>(i)];
    }
  }

  Forecast forecast(const Roi& roi) const {
    const SurfelField& field = prepared_->field;
    std::vector<std::uint8_t> marked(field.levels[0].surfels.size(), 0);
    for (std::size_t i = 1; i < marked.size(); ++i) {
      marked[i] = contains(roi, places_, static_cast<std::int64_t>(i)) ? 1 : 0;
    }
    Workspace work;
    const Outlook outlook = outlook_of(*prepared_, marked.data(), options_.live_sigma, work);
    Forecast f;
    f.share = outlook.sums.pairs / all_;
    const Mat6 iso_from_centre = adjoint(Pose{Mat3::Identity(), field.centre - isocentre_});
    const Mat6 covariance = iso_from_centre * covariance_of(outlook) * iso_from_centre.transpose();
    f.mm = std::sqrt(covariance.diagonal().tail<3>().sum());
    f.deg = std::sqrt(covariance.diagonal().head<3>().sum()) * 180 / kPi;
    f.score = std::hypot(f.mm / options_.limit_mm, f.deg / options_.limit_deg);
    f.flagged = f.mm > options_.limit_mm || f.deg > options_.limit_deg || outlook.sums.pairs < kMinPairs;
    if (!(outlook.sums.pairs >= kMinPairs)) {
      f.words = "holds fewer than 6 points of the reference";
      return f;
    }
    const Certificate c = predict(*prepared_, outlook, isocentre_, IcpOptions{}.degenerate_sigma);
    f.flagged = f.flagged || !c.free.empty();
    for (const FreeMotion& m : c.free) f.words += (f.words.empty() ? "" : ", ") + m.words;
    if (c.free.empty()) f.words = words_of(c.directions[0].motion, isocentre_);
    return f;
  }

  // Seen from above.
  void box(Vec2& low, Vec2& high) const {
    low = (prepared_->field.box_min + prepared_->field.centre).head<2>();
    high = (prepared_->field.box_max + prepared_->field.centre).head<2>();
  }

 private:
  // Finite for motions that are not seen, too: they are taken for hardly seen.
  Mat6 covariance_of(const Outlook& o) const {
    Vec6 unit;
    unit << Vec3::Constant(1 / prepared_->field.lever), Vec3::Ones();
    const Mat6 shape = unit.asDiagonal() * (o.sums.A - o.false_part) * unit.asDiagonal();
    const double sum = std::max(1e-12, (unit.asDiagonal() * o.sums.A * unit.asDiagonal()).diagonal().tail<3>().sum());
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(shape);
    const double least = kSlopeFloor * kSlopeFloor * sum;
    const auto back = [&](const Vec6& values) -> Mat6 {
      return unit.asDiagonal() * eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose() *
             unit.asDiagonal();
    };
    const Vec6 inverse = eigen.eigenvalues().cwiseMax(least).cwiseInverse();
    const Vec6 unseen = (eigen.eigenvalues().array() > least).select(0, inverse);
    return back(inverse) * (o.live_score + o.reference_score) * back(inverse) + back(unseen);
  }

  std::shared_ptr<const Reference> prepared_;
  Vec3 isocentre_;
  AdviceOptions options_;
  Surface places_;  // of the surfels
  double all_ = 0;
};

struct Found {
  Ellipse ellipse;
  Forecast forecast;
};

// A region that takes too much counts by how much.
double cost(const Forecast& f, double most_share) {
  return f.score * (f.share > most_share ? 1 + 20 * (f.share / most_share - 1) : 1);
}

// Shifts, stretches and turns while that helps.
Found climb(const Adviser& adviser, Found best, double step, double most_share) {
  for (int round = 0; round < kRounds && step > 1; ++round) {
    Found next = best;
    const auto consider = [&](const Ellipse& e) {
      if (!(e.a > 5 && e.b > 5)) return;
      Found f{e, adviser.forecast(roi_of(e))};
      if (cost(f.forecast, most_share) < cost(next.forecast, most_share)) next = std::move(f);
    };
    for (const double sign : {-1.0, 1.0}) {
      Ellipse e = best.ellipse;
      e.centre.x() += sign * step;
      consider(e);
      e = best.ellipse;
      e.centre.y() += sign * step;
      consider(e);
      const double stretch = 1 + sign * step / (best.ellipse.a + best.ellipse.b);
      e = best.ellipse;
      e.a *= stretch;
      e.b /= stretch;
      consider(e);
      e = best.ellipse;
      e.a *= stretch;
      e.b *= stretch;
      consider(e);
      e = best.ellipse;
      e.turn += sign * step / best.ellipse.a;
      consider(e);
    }
    if (cost(next.forecast, most_share) < cost(best.forecast, most_share)) {
      best = std::move(next);
    } else {
      step /= 2;
    }
  }
  return best;
}

Found propose(const Run& run, const Adviser& adviser, double most_share) {
  Vec2 low, high;
  adviser.box(low, high);
  const Vec2 side = high - low;
  const double radius = 0.5 * std::sqrt(most_share * side.x() * side.y());
  std::vector<Found> all(kGrid * kGrid);
  parallel_for(
      run, kGrid * kGrid, 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const std::int64_t row = i / kGrid, column = i % kGrid;
          const Vec2 at(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
          Found& f = all[static_cast<std::size_t>(i)];
          f.ellipse = {low + side.cwiseProduct(at) / kGrid, radius, radius, 0};
          f.forecast = adviser.forecast(roi_of(f.ellipse));
        }
      },
      "regions");
  std::stable_sort(all.begin(), all.end(), [&](const Found& a, const Found& b) {
    return cost(a.forecast, most_share) < cost(b.forecast, most_share);
  });
  all.resize(kClimbs);
  parallel_for(
      run, static_cast<std::int64_t>(kClimbs), 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          Found& f = all[static_cast<std::size_t>(i)];
          f = climb(adviser, f, 0.25 * radius, most_share);
        }
      },
      "regions");
  return *std::min_element(all.begin(), all.end(), [&](const Found& a, const Found& b) {
    return cost(a.forecast, most_share) < cost(b.forecast, most_share);
  });
}

}  // namespace

Advice advise(const Run& run, const Surface& reference, const std::vector<const Roi*>& candidates,
              const Vec3& isocentre, const AdviceOptions& o) {
  const Adviser adviser(run, reference, isocentre, o);
  Advice out;
  out.candidates.resize(candidates.size());
  parallel_for(
      run, static_cast<std::int64_t>(candidates.size()), 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          out.candidates[static_cast<std::size_t>(i)] = adviser.forecast(*candidates[static_cast<std::size_t>(i)]);
        }
      },
      "regions");
  out.order.resize(candidates.size());
  std::iota(out.order.begin(), out.order.end(), 0);
  std::stable_sort(out.order.begin(), out.order.end(), [&](std::int32_t a, std::int32_t b) {
    return out.candidates[static_cast<std::size_t>(a)].score < out.candidates[static_cast<std::size_t>(b)].score;
  });
  double share = o.max_share, least = std::numeric_limits<double>::infinity();
  for (const Forecast& f : out.candidates) {
    if (!(o.max_share > 0)) share = std::max(share, f.share);
    least = std::min(least, f.score);
  }
  const Found found = propose(run, adviser, share > 0 ? share : kDefaultShare);
  out.proposal = found.forecast;
  out.better = found.forecast.score < least;
  const Roi roi = roi_of(found.ellipse);
  out.polygon.resize(static_cast<Eigen::Index>(roi.polygon.size()), 2);
  for (std::size_t i = 0; i < roi.polygon.size(); ++i) {
    out.polygon.row(static_cast<Eigen::Index>(i)) = roi.polygon[i].transpose();
  }
  return out;
}

}  // namespace sgrt
