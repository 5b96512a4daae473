// Dark discs, see calibration/circles.hpp: pixels darker than their surroundings, joined; kept where area and second
// moments are those of one ellipse; the centre from the darkness itself, so that it is as fine as the noise allows.
#include <algorithm>
#include <cmath>

#include "calibration/circles.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Sums over rectangles from the top-left corner, one row and column more than the image.
std::vector<double> integral_of(const Image& image) {
  const std::size_t w = static_cast<std::size_t>(image.width) + 1;
  std::vector<double> sums(w * (static_cast<std::size_t>(image.height) + 1), 0.0);
  for (int y = 0; y < image.height; ++y) {
    double row = 0;
    for (int x = 0; x < image.width; ++x) {
      row += image.row(y)[x];
      sums[(y + 1) * w + x + 1] = sums[y * w + x + 1] + row;
    }
  }
  return sums;
}

// 1 where a pixel is darker than the mean round it by a twentieth of the image's range.
std::vector<unsigned char> dark_of(const Image& image) {
  constexpr float kShare = 0.05F;
  const auto [low, high] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  const double margin = kShare * (*high - *low);
  const int half = std::max(10, std::min(image.width, image.height) / 10);
  const std::vector<double> sums = integral_of(image);
  const std::size_t w = static_cast<std::size_t>(image.width) + 1;
  std::vector<unsigned char> dark(image.pixels.size());
  for (int y = 0; y < image.height; ++y) {
    const int y0 = std::max(0, y - half), y1 = std::min(image.height, y + half + 1);
    for (int x = 0; x < image.width; ++x) {
      const int x0 = std::max(0, x - half), x1 = std::min(image.width, x + half + 1);
      const double sum = sums[y1 * w + x1] - sums[y0 * w + x1] - sums[y1 * w + x0] + sums[y0 * w + x0];
      dark[static_cast<std::size_t>(y) * image.width + x] = image.row(y)[x] < sum / ((y1 - y0) * (x1 - x0)) - margin;
    }
  }
  return dark;
}

struct Blob {
  double area = 0;
  Vec2 sum = Vec2::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  bool at_border = false;
};

// Takes a blob out of the mask.
Blob take(const Image& image, std::vector<unsigned char>& dark, int x, int y) {
  Blob blob;
  std::vector<std::pair<int, int>> todo{{x, y}};
  dark[static_cast<std::size_t>(y) * image.width + x] = 0;
  while (!todo.empty()) {
    const auto [i, j] = todo.back();
    todo.pop_back();
    const Vec2 p(i, j);
    blob.area += 1;
    blob.sum += p;
    blob.square += p * p.transpose();
    blob.at_border = blob.at_border || i == 0 || j == 0 || i == image.width - 1 || j == image.height - 1;
    for (const auto& [di, dj] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      const int u = i + di, v = j + dj;
      if (u < 0 || v < 0 || u >= image.width || v >= image.height) continue;
      unsigned char& mark = dark[static_cast<std::size_t>(v) * image.width + u];
      if (!mark) continue;
      mark = 0;
      todo.emplace_back(u, v);
    }
  }
  return blob;
}

// An ellipse's area is 4 pi sqrt(det) of its second moments; a twelfth is what a pixel's own size adds.
bool looks_like_a_disc(const Image& image, const Blob& blob, Disc& disc) {
  constexpr double kLeastArea = 12, kMostShare = 0.04, kShape = 0.2, kMostRatio = 16;
  if (blob.at_border || blob.area < kLeastArea || blob.area > kMostShare * image.width * image.height) return false;
  disc.area = blob.area;
  disc.at = blob.sum / blob.area;
  disc.moments = blob.square / blob.area - disc.at * disc.at.transpose() + Eigen::Matrix2d::Identity() / 12;
  const double trace = disc.moments.trace(), det = disc.moments.determinant();
  if (!(det > 0) || trace * trace / det > kMostRatio + 2 + 1 / kMostRatio) return false;
  return std::abs(4 * kPi * std::sqrt(det) / disc.area - 1) < kShape;
}

// The centroid of the darkness against the ground round the disc, within 1.4 of its ellipse.
bool refine(const Image& image, Disc& disc) {
  constexpr double kInside = 1.4, kGround = 1.8;
  double spread = std::sqrt(disc.moments.trace()) * 2 * kGround;
  for (int round = 0; round < 3; ++round) {
    const Eigen::Matrix2d metric = (4 * disc.moments).inverse();
    const int x0 = static_cast<int>(std::floor(disc.at.x() - spread)),
              x1 = static_cast<int>(std::ceil(disc.at.x() + spread));
    const int y0 = static_cast<int>(std::floor(disc.at.y() - spread)),
              y1 = static_cast<int>(std::ceil(disc.at.y() + spread));
    if (x0 < 0 || y0 < 0 || x1 >= image.width || y1 >= image.height) return false;
    std::vector<float> ground;
    const auto each = [&](auto&& use) {
      for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
          const Vec2 d = Vec2(x, y) - disc.at;
          use(d, d.dot(metric * d), image.row(y)[x]);
        }
      }
    };
    each([&](const Vec2&, double r2, float v) {
      if (r2 > kInside * kInside && r2 < kGround * kGround) ground.push_back(v);
    });
    if (ground.size() < 8) return false;
    const double level = median(ground);
    double noise = 0, sum = 0, square = 0;
    for (float v : ground) noise += std::min((v - level) * (v - level), 400.0) / static_cast<double>(ground.size());
    Vec2 moment = Vec2::Zero();
    each([&](const Vec2& d, double r2, float v) {
      if (r2 > kInside * kInside) return;
      sum += level - v;
      moment += (level - v) * d;
      square += d.squaredNorm() / 2;
    });
    if (!(sum > 0)) return false;
    const Vec2 step = moment / sum;
    if (!(step.norm() < spread)) return false;
    disc.at += step;
    disc.contrast = sum / disc.area;
    disc.sigma_px = std::max(1e-3, std::sqrt(noise * square) / sum);
  }
  return true;
}

}  // namespace

std::vector<Disc> find_discs(const Image& image) {
  std::vector<unsigned char> dark = dark_of(image);
  std::vector<Disc> discs;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!dark[static_cast<std::size_t>(y) * image.width + x]) continue;
      Disc disc;
      if (looks_like_a_disc(image, take(image, dark, x, y), disc) && refine(image, disc)) discs.push_back(disc);
    }
  }
  return discs;
}

}  // namespace sgrt
