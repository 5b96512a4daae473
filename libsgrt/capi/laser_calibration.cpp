// Calibration of a laser unit: corners and stripe centres in, a rig with the laser out.
#include "calibration/laser.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/report.hpp"
#include "capi/laser.hpp"

namespace sgrt {
namespace {

sgrt_laser_stripes empty_stripes() {
  sgrt_laser_stripes s{};
  s.struct_size = sizeof s;
  return s;
}

std::vector<StripeSight> sights_of(const sgrt_laser_stripes& c) {
  constexpr std::int64_t kMost = 50'000'000;
  check_view(&c.placement, "stripes.placement", Kind::kIndex, {kAny});
  const std::int64_t n = c.placement.shape[0];
  check_limit(n, kMost, "stripes.placement");
  check_view(&c.angle_rad, "stripes.angle_rad", Kind::kReal, {n});
  check_view(&c.pixels, "stripes.pixels", Kind::kReal, {n, 2});
  check_view(&c.sigma_px, "stripes.sigma_px", Kind::kReal, {n});
  const auto count = static_cast<std::size_t>(n);
  std::vector<std::int32_t> placement(count);
  std::vector<double> angle(count), pixels(2 * count), sigma(count);
  read_view(c.placement, placement.data());
  read_view(c.angle_rad, angle.data());
  read_view(c.pixels, pixels.data());
  read_view(c.sigma_px, sigma.data());
  std::vector<StripeSight> sights(count);
  for (std::size_t i = 0; i < count; ++i)
    sights[i] = {placement[i], angle[i], Vec2(pixels[2 * i], pixels[2 * i + 1]), sigma[i]};
  return sights;
}

// The laser's camera is the data's only one; a laser that the rig has already is the start.
std::optional<LaserUnit> start_of(const Rig& rig, const std::string& id, const CalibrationData& data) {
  const int camera = camera_index(rig, data.cameras.at(0).id);
  const Camera& c = rig.cameras[static_cast<std::size_t>(camera)];
  if (c.width != data.cameras[0].width || c.height != data.cameras[0].height)
    fail(Status::kInvalidArgument, "camera " + in_quotes(c.id) + ": images of " +
                                       std::to_string(data.cameras[0].width) + " x " +
                                       std::to_string(data.cameras[0].height) + ", the rig states another size");
  const std::vector<std::string> known = laser_ids(rig);
  if (std::find(known.begin(), known.end(), id) == known.end()) return std::nullopt;
  LaserUnit unit = laser_of(rig, id);
  if (unit.camera != camera)
    fail(Status::kInvalidArgument,
         "camera " + in_quotes(c.id) + ": laser " + in_quotes(id) + " belongs to another one");
  return unit;
}

void set_stripes(const LaserCalibration& r, sgrt_calibration& handle) {
  handle.corners.reserve(8 * r.sights.size());
  for (std::size_t i = 0; i < r.sights.size(); ++i) {
    const StripeSight& s = r.sights[i];
    handle.info.corner_count += r.counts[i] ? 1 : 0;
    for (double v : {0.0, static_cast<double>(s.placement), -1.0, s.pixel.x(), s.pixel.y(), r.residuals[i], 0.0,
                     r.counts[i] ? 1.0 : 0.0})
      handle.corners.push_back(v);
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_laser_stripes_init(sgrt_laser_stripes* stripes, size_t size) {
  return guard([&] { init_struct(stripes, size, empty_stripes(), "stripes"); });
}

sgrt_status sgrt_calibration_laser(sgrt_context* context, const sgrt_rig* rig, const char* laser_id,
                                   const sgrt_calibration_data* data, const sgrt_laser_stripes* stripes,
                                   const sgrt_calibration_options* options, sgrt_calibration** result) {
  return guard([&] {
    need(rig, "rig");
    need(laser_id, "laser_id");
    need(stripes, "stripes");
    need(result, "result");
    if (!*laser_id) refuse("laser_id", "an empty text", "a name");
    const CalibrationData d = from_c(data);
    const sgrt_laser_stripes given = read_struct(stripes, empty_stripes(), "stripes.struct_size");
    check_range(given.fixed, 0, 1, "stripes.fixed");
    sgrt_calibration_options defaults{};
    sgrt_calibration_options_init(&defaults, sizeof defaults);
    const sgrt_calibration_options c = read_struct(options, defaults, "options.struct_size");
    check_reserved(c.reserved, "options.reserved");
    check_range(c.max_iterations, 1, 10'000, "options.max_iterations");
    check_range(c.outlier_sigma, 3, 1e6, "options.outlier_sigma");
    check_range(c.noise_px, 0, 100, "options.noise_px");
    LaserCalibrationOptions o;
    o.fixed = given.fixed != 0;
    o.corner_noise = c.noise_px;
    o.outlier_sigma = c.outlier_sigma;
    o.max_iterations = c.max_iterations;
    const std::vector<StripeSight> sights = sights_of(given);
    const std::optional<LaserUnit> start = start_of(rig->rig, laser_id, d);
    const LaserCalibration r =
        calibrate_laser(run_of(context), rig->rig, laser_id, start ? &*start : nullptr, d, sights, o);
    auto handle = std::make_unique<sgrt_calibration>();
    handle->info.status = static_cast<sgrt_status>(r.status);
    handle->message = r.message;
    handle->report = report_json(d, r);
    handle->warnings = r.warnings;
    handle->info.warning_count = static_cast<std::int32_t>(r.warnings.size());
    handle->info.camera_count = 1;
    handle->info.noise_px = handle->info.rms_px = handle->info.rms_all_px = handle->info.expected_rms_px = std::nan("");
    if (r.status == Status::kOk) {
      handle->info.view_count = static_cast<std::int32_t>(r.placements.size());
      handle->info.iterations = r.iterations;
      handle->info.rms_px = r.rms;
      handle->rig_json = r.rig_json;
      handle->parameters = r.parameters;
      handle->covariance.assign(r.covariance.data(), r.covariance.data() + r.covariance.size());  // symmetric
      set_stripes(r, *handle);
    }
    *result = handle.release();
    return answer(r.status, (*result)->message.c_str());
  });
}
