// Calibration of a time-of-flight camera's range.
#include "calibration/tof.hpp"

#include <cmath>

#include "calibration/check.hpp"
#include "calibration/report.hpp"
#include "capi/capi.hpp"

namespace sgrt {
namespace {

sgrt_calibration_tof_options default_options() {
  const TofCalibrationOptions o;
  sgrt_calibration_tof_options c{};
  c.struct_size = sizeof c;
  c.amplitude_knots = o.amplitude_knots;
  c.knot_spacing_mm = o.knot_spacing;
  c.pixel_sigma_mm = o.pixel_sigma;
  return c;
}

TofCalibrationOptions options_of(const sgrt_calibration_tof_options& c) {
  check_finite(c.board_mm, 4, "board_mm");
  TofCalibrationOptions o;
  o.low = Vec2(c.board_mm[0], c.board_mm[1]);
  o.high = Vec2(c.board_mm[2], c.board_mm[3]);
  o.amplitude_knots = c.amplitude_knots;
  o.knot_spacing = c.knot_spacing_mm;
  o.pixel_sigma = c.pixel_sigma_mm;
  return o;
}

// Poses of the placements as given, or as the rig's cameras saw the board. A placement that they did not see is left
// out.
void place(const Run& run, const Rig& rig, const sgrt_view* room_from_board, const sgrt_calibration_data* data,
           std::vector<TofPlacement>& placements) {
  const auto count = static_cast<std::int64_t>(placements.size());
  if (!absent(room_from_board)) {
    check_view(room_from_board, "room_from_board", Kind::kReal, {count, 4, 4});
    std::vector<double> rows(static_cast<std::size_t>(count) * 16);
    read_view(*room_from_board, rows.data());
    for (std::size_t i = 0; i < placements.size(); ++i) {
      placements[i].name = std::to_string(i);
      placements[i].room_from_board = rigid(&rows[i * 16], ("room_from_board[" + std::to_string(i) + "]").c_str());
    }
    return;
  }
  const CalibrationData d = from_c(data);
  if (static_cast<std::int64_t>(d.placements.size()) != count)
    refuse("data.placement_count", std::to_string(d.placements.size()), std::to_string(count) + ", as many as taps");
  CalibrationOptions options;
  options.warp_sigma_mm = -1;
  const CheckResult seen = check_rig(run, rig, d, options);
  if (seen.status != Status::kOk) fail(seen.status, seen.message);
  std::vector<char> found(placements.size(), 0);
  for (const View& view : seen.bundle.views) found[static_cast<std::size_t>(view.placement)] = 1;
  std::vector<TofPlacement> kept;
  kept.reserve(placements.size());
  for (std::size_t i = 0; i < placements.size(); ++i) {
    if (!found[i]) continue;
    placements[i].name = d.placements[i];
    placements[i].room_from_board = seen.scene.room_from_target[i];
    kept.push_back(placements[i]);
  }
  placements = std::move(kept);
}

std::unique_ptr<sgrt_calibration> handle_of(TofCalibration&& r, const Camera& camera) {
  auto handle = std::make_unique<sgrt_calibration>();
  handle->info = empty_info(r.status);
  handle->info.camera_count = 1;
  handle->info.view_count = static_cast<std::int32_t>(r.placements.size());
  handle->info.warning_count = static_cast<std::int32_t>(r.warnings.size());
  handle->message = r.message;
  handle->report = report_json(r);
  handle->warnings = r.warnings;
  if (r.status == Status::kOk) handle->rig_json = rig_with_provenance(r);
  handle->pixel_offset = std::move(r.pixel_offset);
  handle->height = camera.height;
  handle->width = camera.width;
  return handle;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_calibration_tof_options_init(sgrt_calibration_tof_options* options, size_t size) {
  return guard([&] { init_struct(options, size, default_options(), "options"); });
}

sgrt_status sgrt_calibration_tof(sgrt_context* context, const sgrt_rig* rig, const char* tof_id, const sgrt_view* taps,
                                 int32_t count, const sgrt_view* room_from_board, const sgrt_calibration_data* data,
                                 const sgrt_calibration_tof_options* options, sgrt_calibration** result) {
  return guard([&] {
    need(rig, "rig");
    need(tof_id, "tof_id");
    need(taps, "taps");
    need(options, "options");
    need(result, "result");
    check_range(count, 1, 10'000, "count");
    const int unit = tof_index(rig->rig, tof_id);
    const sgrt_calibration_tof_options c = read_struct(options, default_options(), "options.struct_size");
    const sgrt_tof_options sensor = read_struct(c.sensor, to_c(TofOptions{}), "options.sensor.struct_size");
    const TofCalibrationOptions o = options_of(c);
    std::vector<TofPlacement> placements(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < placements.size(); ++i)
      placements[i].taps = taps_of(&taps[i], ("taps[" + std::to_string(i) + "]").c_str());
    const Run run = run_of(context);
    place(run, rig->rig, room_from_board, data, placements);
    const Camera& camera =
        rig->rig.cameras[static_cast<std::size_t>(rig->rig.tofs[static_cast<std::size_t>(unit)].camera)];
    TofCalibration r = calibrate_tof(run, rig->rig, unit, placements, from_c(sensor), o);
    const Status status = r.status;
    *result = handle_of(std::move(r), camera).release();
    return answer(status, (*result)->message.c_str());
  });
}
