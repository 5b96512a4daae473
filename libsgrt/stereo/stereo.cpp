#include "stereo/stereo.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "stereo/coarse.hpp"
#include "stereo/match.hpp"
#include "stereo/prior.hpp"
#include "stereo/rectify.hpp"
#include "stereo/rig_error.hpp"
#include "stereo/triangulate.hpp"

namespace sgrt {
namespace {

constexpr int kReducibleSide = 640;  // px: smaller images are reduced by 2 only

void check(const StereoOptions& o) {
  const auto refuse = [](const char* name, double value, const char* expected) {
    fail(Status::kInvalidArgument, std::string(name) + ": " + text_of(value) + ", expected " + expected);
  };
  if (o.window < 9 || o.window > 41 || o.window % 2 == 0) refuse("window_px", o.window, "an odd number from 9 to 41");
  if (o.stride < 1 || o.stride > 32) refuse("stride_px", o.stride, "1 to 32");
  if (o.min_component < 1) refuse("min_component", o.min_component, "at least 1");
  if (!(o.min_correlation > 0 && o.min_correlation < 1))
    refuse("min_correlation", o.min_correlation, "more than 0 and less than 1");
  if (!(o.max_left_right > 0)) refuse("max_left_right_px", o.max_left_right, "more than 0");
  if (!(o.max_epipolar > 0)) refuse("max_epipolar_px", o.max_epipolar, "more than 0");
  if (!(o.max_sigma > 0)) refuse("max_sigma_px", o.max_sigma, "more than 0");
  for (int i = 0; i < 3; ++i)
    if (!(o.volume_min[i] < o.volume_max[i])) refuse("volume_min_mm", o.volume_min[i], "less than volume_max_mm");
}

void check_size(const ImageView& image, const Camera& camera, const char* name) {
  if (image.width == camera.width && image.height == camera.height) return;
  fail(Status::kInvalidArgument, std::string(name) + ": " + std::to_string(image.width) + " x " +
                                     std::to_string(image.height) + " px, expected " + std::to_string(camera.width) +
                                     " x " + std::to_string(camera.height) + " of camera " + camera.id);
}

// Integers round to 1 grey level (variance 1/12); a float image is taken to be good to 1e-4 of its mean level.
float rounding_of(const ImageView& image, const Image& grey) {
  if (image.type != ImageView::Type::kF32) return 1.F / 12;
  double sum = 0;
  for (const float g : grey.pixels) sum += std::abs(g);
  const double level = 1e-4 * sum / static_cast<double>(grey.pixels.size());
  return static_cast<float>(level * level);
}

}  // namespace

struct StereoMatcher::Impl {
  Camera left_camera, right_camera;
  StereoOptions options;
  PairModes modes;
  Rectification whole, part;  // part: what shows the prior
  std::optional<Prior> prior;
  RigError rig_error;
  Grid grid;
  CoarseOptions coarse_options;
  CoarseWork coarse_work;
  CoarseMap coarse;
  RectifyWork rectify_work;
  RectifiedImage left, right;
  MatchWork match_work;
  MatchField field;
  std::vector<double> medians[3];
  std::shared_ptr<StereoResult> result;

  const Rectification& rectification() const { return prior ? part : whole; }

  // Disparities that the working volume can have, px. An unbounded volume leaves all from infinity to the image's
  // width; a prior, all that lie near it.
  void bound_disparities() {
    if (prior) {
      coarse_options.disparity_min = -prior->search, coarse_options.disparity_max = prior->search;
      return;
    }
    const Rectification& r = whole;
    double nearest = r.baseline / 2, furthest = std::numeric_limits<double>::infinity();
    if (options.volume_min.allFinite() && options.volume_max.allFinite()) {
      double lo = std::numeric_limits<double>::infinity(), hi = -lo;
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 x(corner & 1 ? options.volume_max.x() : options.volume_min.x(),
                     corner & 2 ? options.volume_max.y() : options.volume_min.y(),
                     corner & 4 ? options.volume_max.z() : options.volume_min.z());
        const double z = r.room_from_rectified.col(2).dot(x - r.centre);
        lo = std::min(lo, z), hi = std::max(hi, z);
      }
      nearest = std::max(nearest, lo), furthest = std::max(nearest, hi);
    }
    coarse_options.disparity_min = r.f * r.baseline / furthest + r.disparity_at_infinity();
    coarse_options.disparity_max = r.f * r.baseline / nearest + r.disparity_at_infinity();
  }

  // What depends on the part of the view that is used.
  void lay_out() {
    const RectifiedView& view = rectification().left;
    bound_disparities();
    grid.stride = options.stride;
    grid.offset = options.stride / 2;
    grid.width = (view.width - grid.offset - 1) / options.stride + 1;
    grid.height = (view.height - grid.offset - 1) / options.stride + 1;
  }

  void search_coarsely(const Run& run) {
    if (!prior) {
      coarse_match(run, left.value, left.mask, right.value, right.mask, coarse_options, coarse_work, coarse);
      prepare(run, left);
      prepare(run, right);
      return;
    }
    prepare(run, left);
    prepare(run, right);
    warp_by_prior(run, right, left, *prior);
    coarse_match(run, left.value, left.mask, prior->image, prior->mask, coarse_options, coarse_work, coarse);
    add_prior(*prior, coarse);
  }
};

StereoMatcher::StereoMatcher(const Run& run, const Rig& rig, const StereoPair& pair, const StereoOptions& options)
    : impl_(std::make_unique<Impl>()) {
  check(options);
  Impl& m = *impl_;
  m.options = options;
  m.left_camera = rig.cameras[pair.left];
  m.right_camera = rig.cameras[pair.right];
  m.modes = pair_modes(rig, pair);
  m.whole = make_rectification(run, m.left_camera, m.right_camera, options.volume_min, options.volume_max);
  const RectifiedView& view = m.whole.left;
  m.coarse_options.scale = std::min(view.width, view.height) >= kReducibleSide ? 4 : 2;
  m.rig_error = make_rig_error(run, m.modes, m.whole);
  m.lay_out();
}

void StereoMatcher::set_prior(const Run& run, const Surface* prior, const Roi* roi, const PriorOptions& options) {
  Impl& m = *impl_;
  std::optional<Prior> made;
  Rectification part;
  if (prior) {
    made = make_prior(run, m.whole, *prior, roi, m.options.window, options);
    part = cropped(m.whole, made->crop);
  }
  RigError error = make_rig_error(run, m.modes, made ? part : m.whole);
  // All that can fail or be cancelled is done: the session changes as a whole or not at all.
  m.prior = std::move(made), m.part = std::move(part), m.rig_error = std::move(error);
  m.lay_out();
}

StereoMatcher::~StereoMatcher() = default;
StereoMatcher::StereoMatcher(StereoMatcher&&) noexcept = default;

const std::shared_ptr<StereoResult>& StereoMatcher::match(const Run& run, const ImageView& left,
                                                          const ImageView& right) {
  Impl& m = *impl_;
  check_size(left, m.left_camera, "left");
  check_size(right, m.right_camera, "right");
  const Rectification& rectification = m.rectification();
  rectify(run, left, rectification.left, m.rectify_work, m.left.value, m.left.mask);
  rectify(run, right, rectification.right, m.rectify_work, m.right.value, m.right.mask);
  m.left.rounding = rounding_of(left, m.left.value);
  m.right.rounding = rounding_of(right, m.right.value);
  m.left.noise_gain = rectification.left.noise_gain, m.right.noise_gain = rectification.right.noise_gain;
  m.search_coarsely(run);
  match_grid(run, m.left, m.right, m.coarse, m.grid, m.options, m.match_work, m.field);
  if (m.prior) {
    hold_against(rectification, *m.prior, m.grid, m.field);
    if (m.prior->options.follow) follow(rectification, m.match_work.field, *m.prior);
  }

  // use_count is relaxed: the fence orders our writes behind the reads of whoever let go last.
  if (!m.result || m.result.use_count() > 1) m.result = std::make_shared<StereoResult>();
  if (!m.result->surface || m.result->surface.use_count() > 1) m.result->surface = std::make_shared<Surface>();
  std::atomic_thread_fence(std::memory_order_acquire);
  triangulate(run, rectification, m.rig_error, m.grid, m.options, m.match_work.noise_of_bend.gain, m.medians, m.field,
              *m.result);
  const EpipolarCheck& epipolar = m.match_work.epipolar;
  m.result->epipolar_count = epipolar.count;
  m.result->epipolar_px = epipolar.median, m.result->epipolar_sigma_px = epipolar.sigma;
  m.result->epipolar_rms_px = epipolar.rms;
  m.result->out_of_calibration =
      epipolar.rms > m.options.max_epipolar && epipolar.rms > 3 * epipolar.sigma;  // false for NaN
  const bool found = m.result->point_count > 0;
  m.result->status = found ? Status::kOk : Status::kNotFound;
  m.result->message = found ? ""
                            : "no point of the scene could be matched between left and right, expected a textured "
                              "surface that both cameras see";
  return m.result;
}

}  // namespace sgrt
