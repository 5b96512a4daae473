#include "stereo/rectify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "stereo/spline.hpp"
#include "stereo/stereo.hpp"

namespace sgrt {
namespace {

constexpr double kMinAngle = 0.17;  // rad between viewing direction and baseline: below it no rectification is sensible
constexpr double kMaxTangent = 2;   // rays further than 63 deg from the common viewing direction are left out

struct Box {
  double x0 = std::numeric_limits<double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
  void add(double x, double y) {
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
};

// What a camera sees, in normalised coordinates of the rectified frame, from the rays of its border pixels.
Box view_of(const Camera& camera, const Mat3& rectified_from_room) {
  Box box;
  constexpr int kSteps = 64;
  for (int k = 0; k <= kSteps; ++k) {
    const double u = (camera.width - 1.0) * k / kSteps, v = (camera.height - 1.0) * k / kSteps;
    for (const Vec2& pixel : {Vec2(u, 0), Vec2(u, camera.height - 1.0), Vec2(0, v), Vec2(camera.width - 1.0, v)}) {
      const Vec3 ray = rectified_from_room * unproject(camera, pixel);
      if (!(ray.z() > 0.05)) continue;
      box.add(std::clamp(ray.x() / ray.z(), -kMaxTangent, kMaxTangent),
              std::clamp(ray.y() / ray.z(), -kMaxTangent, kMaxTangent));
    }
  }
  return box;
}

// The part of `box` that the working volume can fall on.
void crop(Box& box, const Mat3& rectified_from_room, const Vec3& centre, const Vec3& lo, const Vec3& hi) {
  if (!lo.allFinite() || !hi.allFinite()) return;
  Box seen;
  int behind = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 x(corner & 1 ? hi.x() : lo.x(), corner & 2 ? hi.y() : lo.y(), corner & 4 ? hi.z() : lo.z());
    const Vec3 p = rectified_from_room * (x - centre);
    if (p.z() > 1) seen.add(p.x() / p.z(), p.y() / p.z());
    behind += p.z() > 1 ? 0 : 1;
  }
  if (behind > 0 && behind < 8) return;  // reaches behind the camera: no bound
  box.x0 = std::max(box.x0, seen.x0), box.x1 = std::min(box.x1, seen.x1);
  box.y0 = std::max(box.y0, seen.y0), box.y1 = std::min(box.y1, seen.y1);
}

// The map is exact at every eighth pixel of a row and cubic between (to 1e-6 px: a lens is smooth).
void fill_row(const Rectification& r, RectifiedView& view, int y, std::vector<Vec2>& knots) {
  constexpr int kStep = 8;
  const int cells = view.width / kStep + 1;
  knots.resize(cells + 3);
  for (int k = 0; k < cells + 3; ++k) knots[k] = r.source_pixel(view, (k - 1) * kStep, y);
  for (int x = 0; x < view.width; ++x) {
    const int k = x / kStep;
    const double t = (x % kStep) / static_cast<double>(kStep);
    Vec2 p = knots[k] * (-t * (t - 1) * (t - 2) / 6) + knots[k + 1] * ((t + 1) * (t - 1) * (t - 2) / 2) +
             knots[k + 2] * (-(t + 1) * t * (t - 2) / 2) + knots[k + 3] * ((t + 1) * t * (t - 1) / 6);
    if (!p.allFinite()) p = r.source_pixel(view, x, y);  // beside the lens's reach
    float* s = &view.source[(static_cast<std::size_t>(y) * view.width + x) * 2];
    s[0] = static_cast<float>(p.x()), s[1] = static_cast<float>(p.y());
  }
}

void fill_sources(const Run& run, const Rectification& r, RectifiedView& view) {
  view.source.resize(static_cast<std::size_t>(view.width) * view.height * 2);
  parallel_for(
      run, view.height, 16,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<Vec2> knots;
        for (int y = static_cast<int>(begin); y < end; ++y) fill_row(r, view, y, knots);
      },
      "rectifying");
}

}  // namespace

namespace {

// Only what the view shows is read and prefiltered; the margin lets the prefilter forget where it began.
void crop_source(RectifiedView& view) {
  constexpr float kMargin = 20;
  const auto w = static_cast<float>(view.camera->width), h = static_cast<float>(view.camera->height);
  float x0 = w, y0 = h, x1 = -1, y1 = -1;
  for (std::size_t i = 0; i + 1 < view.source.size(); i += 2) {
    const float x = view.source[i], y = view.source[i + 1];
    if (!(x >= 0 && y >= 0 && x <= w - 1 && y <= h - 1)) continue;
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  if (!(x1 >= x0)) x0 = 0, x1 = w - 1, y0 = 0, y1 = h - 1;
  view.crop_x = static_cast<int>(std::max(0.F, x0 - kMargin)),
  view.crop_y = static_cast<int>(std::max(0.F, y0 - kMargin));
  view.crop_width = static_cast<int>(std::min(w, x1 + kMargin + 2)) - view.crop_x;
  view.crop_height = static_cast<int>(std::min(h, y1 + kMargin + 2)) - view.crop_y;
}

double mean_noise_gain(const RectifiedView& view) {
  double sum = 0, n = 0;
  for (std::size_t i = 0; i + 1 < view.source.size(); i += 2 * 61) {
    const double x = view.source[i], y = view.source[i + 1];
    if (!(x == x)) continue;
    sum += cubic_noise_gain(x - std::floor(x)) * cubic_noise_gain(y - std::floor(y)), n += 1;
  }
  return n > 0 ? sum / n : 1;
}

}  // namespace

Vec2 Rectification::source_pixel(const RectifiedView& view, double x, double y) const {
  const Vec3 ray =
      view.camera->camera_from_room.R * (room_from_rectified * Vec3((x - view.cx) / f, (y - view.cy) / f, 1));
  return project_camera(*view.camera, ray);
}

Rectification make_rectification(const Run& run, const Camera& left, const Camera& right, const Vec3& volume_min,
                                 const Vec3& volume_max) {
  Rectification r;
  r.left.camera = &left;
  r.right.camera = &right;
  r.centre = left.centre_in_room();
  const Vec3 base = right.centre_in_room() - r.centre;
  r.baseline = base.norm();
  if (!(r.baseline > 1e-3))
    fail(Status::kDegenerate,
         "pair: cameras " + left.id + " and " + right.id + " stand in one place, expected a baseline");
  const Vec3 x = base / r.baseline;
  const Vec3 z_left = left.camera_from_room.R.row(2), z_right = right.camera_from_room.R.row(2);
  const Vec3 view = z_left + z_right;
  if (std::min(z_left.cross(x).norm(), z_right.cross(x).norm()) < std::sin(kMinAngle) || view.cross(x).norm() < 0.2)
    fail(Status::kDegenerate,
         "pair: cameras " + left.id + " and " + right.id +
             " look along their baseline or away from each other, expected a common view across it");
  const Vec3 y = view.cross(x).normalized();
  r.room_from_rectified.col(0) = x;
  r.room_from_rectified.col(1) = y;
  r.room_from_rectified.col(2) = x.cross(y);
  r.f = (left.fx + left.fy + right.fx + right.fy) / 4;

  const Mat3 rectified_from_room = r.room_from_rectified.transpose();
  Box bl = view_of(left, rectified_from_room), br = view_of(right, rectified_from_room);
  crop(bl, rectified_from_room, r.centre, volume_min, volume_max);
  crop(br, rectified_from_room, right.centre_in_room(), volume_min, volume_max);
  const double y0 = std::max(bl.y0, br.y0), y1 = std::min(bl.y1, br.y1);
  const auto size = [&](double a, double b) {
    return static_cast<int>(std::min(std::ceil((b - a) * r.f), 40000.0)) + 1;
  };
  if (!(y1 > y0) || !(bl.x1 > bl.x0) || !(br.x1 > br.x0) || size(y0, y1) < 32 || size(bl.x0, bl.x1) < 32)
    fail(Status::kInvalidArgument, "pair: cameras " + left.id + " and " + right.id +
                                       " have no view in common inside the working volume, expected one");
  for (auto [v, box] : {std::pair(&r.left, &bl), std::pair(&r.right, &br)}) {
    v->width = size(box->x0, box->x1);
    v->height = size(y0, y1);
    v->cx = -box->x0 * r.f;
    v->cy = -y0 * r.f;
    fill_sources(run, r, *v);
    crop_source(*v);
    v->noise_gain = mean_noise_gain(*v);
  }
  return r;
}

Rectification cropped(const Rectification& whole, const RectifiedCrop& crop) {
  const auto part = [&](const RectifiedView& from, RectifiedView& to, int x, int width) {
    to.camera = from.camera, to.noise_gain = from.noise_gain;
    to.width = width, to.height = crop.height;
    to.cx = from.cx - x, to.cy = from.cy - crop.y;
    to.source.resize(2 * static_cast<std::size_t>(width) * crop.height);
    for (int y = 0; y < crop.height; ++y)
      std::copy_n(&from.source[2 * (static_cast<std::size_t>(crop.y + y) * from.width + x)], 2 * width,
                  &to.source[2 * static_cast<std::size_t>(y) * width]);
    crop_source(to);
  };
  Rectification r;
  r.f = whole.f, r.baseline = whole.baseline;
  r.room_from_rectified = whole.room_from_rectified, r.centre = whole.centre;
  part(whole.left, r.left, crop.x_left, crop.width_left);
  part(whole.right, r.right, crop.x_right, crop.width_right);
  return r;
}

void rectify(const Run& run, const ImageView& image, const RectifiedView& view, RectifyWork& work, Image& out,
             std::vector<std::uint8_t>& mask) {
  Image& coefficients = work.coefficients;
  std::vector<std::uint8_t>& clipped = work.clipped;
  ImageView part = image;
  part.data = static_cast<const char*>(image.data) + view.crop_y * image.row_stride + view.crop_x * image.column_stride;
  part.width = view.crop_width, part.height = view.crop_height;
  load(part, coefficients);
  // Clipped pixels, found (and made finite) before the prefilter spreads them.
  const float clip = image.clip();
  clipped.clear();
  const auto is_clipped = [&](float g) { return g >= clip; };
  if (std::any_of(coefficients.pixels.begin(), coefficients.pixels.end(), is_clipped)) {
    clipped.resize(coefficients.pixels.size());
    for (std::size_t i = 0; i < clipped.size(); ++i) {
      clipped[i] = is_clipped(coefficients.pixels[i]);
      if (std::isinf(coefficients.pixels[i])) coefficients.pixels[i] = 0;
    }
  }
  spline_rows(run, coefficients);
  spline_columns(run, coefficients);
  out.resize(view.height, view.width);
  mask.resize(out.pixels.size());

  const int w = coefficients.width, h = coefficients.height;
  const auto origin_x = static_cast<float>(view.crop_x), origin_y = static_cast<float>(view.crop_y);
  parallel_for(
      run, view.height, 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin * view.width; i < end * view.width; ++i) {
          float sx = view.source[2 * i] - origin_x, sy = view.source[2 * i + 1] - origin_y;
          // The outermost pixels lack a neighbour of the 4 x 4 support. Beyond them the image goes on as it ends: a
          // step to zero would ring in the spline along the row.
          const bool seen = sx >= 1 && sy >= 1 && sx < w - 2 && sy < h - 2;
          if (!seen) {
            mask[i] = static_cast<std::uint8_t>(Reason::kOutOfView);
            out.pixels[i] = 0;
            if (!(sx == sx && sy == sy)) continue;
            sx = std::clamp(sx, 1.F, static_cast<float>(w) - 2.01F);
            sy = std::clamp(sy, 1.F, static_cast<float>(h) - 2.01F);
          }
          const int kx = static_cast<int>(sx), ky = static_cast<int>(sy);
          float wx[4], wy[4], value = 0;
          spline_weights(sx - static_cast<float>(kx), wx);
          spline_weights(sy - static_cast<float>(ky), wy);
          bool saturated = false;
          for (int j = 0; j < 4; ++j) {
            const float* c = coefficients.row(ky - 1 + j) + kx - 1;
            value += wy[j] * (wx[0] * c[0] + wx[1] * c[1] + wx[2] * c[2] + wx[3] * c[3]);
            if (!clipped.empty()) {
              const std::uint8_t* s = &clipped[static_cast<std::size_t>(ky - 1 + j) * w + kx - 1];
              saturated = saturated || s[0] || s[1] || s[2] || s[3];
            }
          }
          out.pixels[i] = value;
          if (seen) mask[i] = static_cast<std::uint8_t>(saturated ? Reason::kSaturated : Reason::kNone);
        }
      },
      "rectifying");
}

}  // namespace sgrt
