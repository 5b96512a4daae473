// Calibration: correspondences in, a rig and its report out.
#include "calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/report.hpp"
#include "capi/capi.hpp"
#include "rig/uncertainty.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMostSights = 10'000'000;
constexpr std::int64_t kBlock = 256;  // points
const double kNan = std::nan("");

sgrt_calibration_data empty_data() {
  sgrt_calibration_data d{};
  d.struct_size = sizeof d;
  return d;
}

sgrt_calibration_options default_options() {
  const CalibrationOptions o;
  sgrt_calibration_options c{};
  c.struct_size = sizeof c;
  c.distortion_count = o.distortion_count;
  c.max_iterations = o.max_iterations;
  c.min_views = o.min_views;
  c.split_half = o.split_half ? 1 : 0;
  c.outlier_sigma = o.outlier_sigma;
  c.warp_sigma_mm = o.warp_sigma_mm;
  return c;
}

struct Options {
  CalibrationOptions calibration;
  RoomOptions room;
};

Options from_c(const sgrt_calibration_options* given) {
  const sgrt_calibration_options c = read_struct(given, default_options(), "options.struct_size");
  Options o;
  if (c.distortion_count != 0 && c.distortion_count != 5 && c.distortion_count != 8)
    refuse("options.distortion_count", std::to_string(c.distortion_count), "0, 5 or 8");
  check_range(c.max_iterations, 1, 10'000, "options.max_iterations");
  check_range(c.min_views, 3, 1000, "options.min_views");
  check_range(c.split_half, 0, 1, "options.split_half");
  check_reserved(c.reserved, "options.reserved");
  check_range(c.outlier_sigma, 3, 1e6, "options.outlier_sigma");
  check_range(c.warp_sigma_mm, -1e3, 1e3, "options.warp_sigma_mm");
  check_range(c.point_sigma_mm, 0, 100, "options.point_sigma_mm");
  check_range(c.noise_px, 0, 100, "options.noise_px");
  o.calibration.distortion_count = c.distortion_count;
  o.calibration.max_iterations = c.max_iterations;
  o.calibration.min_views = c.min_views;
  o.calibration.split_half = c.split_half != 0;
  o.calibration.outlier_sigma = o.room.outlier_sigma = c.outlier_sigma;
  o.calibration.warp_sigma_mm = c.warp_sigma_mm;
  o.room.point_sigma_mm = c.point_sigma_mm;
  o.room.noise_px = c.noise_px;
  if (c.rig_id) o.calibration.rig_id = o.room.rig_id = c.rig_id;
  return o;
}

std::vector<std::string> texts(const char* const* list, std::int32_t count, const char* name) {
  std::vector<std::string> all;
  if (count > 0) need(list, name);
  for (std::int32_t i = 0; i < count; ++i) {
    need(list[i], (std::string(name) + "[" + std::to_string(i) + "]").c_str());
    all.emplace_back(list[i]);
  }
  return all;
}

std::vector<std::int32_t> integers(const sgrt_view& view, const char* name, std::int64_t rows, std::int64_t columns) {
  check_view(&view, name, Kind::kIndex, {rows, columns});
  check_limit(view.shape[0], kMostSights, name);
  std::vector<std::int32_t> values(static_cast<std::size_t>(view.shape[0] * columns));
  read_view(view, values.data());
  return values;
}

void read_sights(const sgrt_calibration_data& c, CalibrationData& data) {
  const std::vector<std::int32_t> index = integers(c.index, "data.index", kAny, 3);
  const std::size_t k = index.size() / 3;
  std::vector<double> pixels(2 * k), sigma(k, 1.0);
  check_view(&c.pixels, "data.pixels", Kind::kReal, {static_cast<std::int64_t>(k), 2});
  read_view(c.pixels, pixels.data());
  if (!absent(&c.sigma)) {
    check_view(&c.sigma, "data.sigma", Kind::kReal, {static_cast<std::int64_t>(k)});
    read_view(c.sigma, sigma.data());
  }
  for (std::size_t i = 0; i < k; ++i)
    data.sights.push_back(
        {index[3 * i], index[3 * i + 1], index[3 * i + 2], Vec2(pixels[2 * i], pixels[2 * i + 1]), sigma[i]});
}

}  // namespace

CalibrationData from_c(const sgrt_calibration_data* given) {
  need(given, "data");
  const sgrt_calibration_data c = read_struct(given, empty_data(), "data.struct_size");
  check_range(c.camera_count, 1, 64, "data.camera_count");
  check_range(c.placement_count, 1, 100'000, "data.placement_count");
  check_range(c.pair_count, 0, 64, "data.pair_count");
  check_range(c.half_turn_ambiguous, 0, 1, "data.half_turn_ambiguous");
  check_reserved(c.reserved, "data.reserved");
  CalibrationData data;
  data.half_turn_ambiguous = c.half_turn_ambiguous != 0;
  const std::vector<std::string> ids = texts(c.camera_ids, c.camera_count, "data.camera_ids");
  const std::vector<std::int32_t> sizes = integers(c.image_sizes, "data.image_sizes", c.camera_count, 2);
  for (std::size_t i = 0; i < ids.size(); ++i) data.cameras.push_back({ids[i], sizes[2 * i], sizes[2 * i + 1]});
  if (c.placements) data.placements = texts(c.placements, c.placement_count, "data.placements");
  for (std::int32_t i = 0; i < c.placement_count && !c.placements; ++i) {
    const std::string digits = std::to_string(i);
    data.placements.push_back(std::string(6 - digits.size(), '0') + digits);  // so that they sort by number
  }
  const std::vector<std::string> pairs = texts(c.pair_ids, c.pair_count, "data.pair_ids");
  if (!pairs.empty()) {
    const std::vector<std::int32_t> sides = integers(c.pair_cameras, "data.pair_cameras", c.pair_count, 2);
    for (std::size_t i = 0; i < pairs.size(); ++i) data.pairs.push_back({pairs[i], sides[2 * i], sides[2 * i + 1]});
  }
  data.points = read_points(&c.points, "data.points");
  read_sights(c, data);
  return data;
}

sgrt_calibration_info empty_info(Status status) {
  sgrt_calibration_info info{};
  info.status = static_cast<sgrt_status>(status);
  info.noise_px = info.rms_px = info.rms_all_px = info.expected_rms_px = kNan;
  return info;
}

namespace {

void set_corners(const Bundle& bundle, const Scene& scene, const std::vector<std::string>& ids, const Rig& rig,
                 sgrt_calibration& handle) {
  // Numbers of cameras as the data has them: a check's views carry the rig's.
  std::vector<int> number(scene.cameras.size());
  for (std::size_t c = 0; c < number.size(); ++c) {
    const auto found = std::find(ids.begin(), ids.end(), rig.cameras[c].id);
    number[c] = static_cast<int>(found - ids.begin());
  }
  for (const View& view : bundle.views) {
    ++handle.info.view_count;
    const std::vector<Vec2> residuals = residuals_of(bundle, scene, view);
    for (std::size_t i = 0; i < view.index.size(); ++i) {
      const bool counts = view.weight[i] > 0;
      handle.info.corner_count += counts ? 1 : 0;
      for (double v : {static_cast<double>(number[view.camera]), static_cast<double>(view.placement),
                       static_cast<double>(view.index[i]), view.pixel[i].x(), view.pixel[i].y(), residuals[i].x(),
                       residuals[i].y(), counts ? 1.0 : 0.0})
        handle.corners.push_back(v);
    }
  }
}

template <class Result>
std::unique_ptr<sgrt_calibration> handle_of(const CalibrationData& data, const Result& r) {
  auto handle = std::make_unique<sgrt_calibration>();
  handle->info = empty_info(r.status);
  handle->message = r.message;
  handle->report = report_json(data, r);
  handle->warnings = r.warnings;
  handle->info.warning_count = static_cast<std::int32_t>(r.warnings.size());
  handle->info.discarded_count = static_cast<std::int32_t>(r.discarded.size());
  handle->info.camera_count = static_cast<std::int32_t>(data.cameras.size());
  return handle;
}

std::vector<std::string> ids_of(const CalibrationData& data) {
  std::vector<std::string> ids;
  ids.reserve(data.cameras.size());
  for (const CalibrationCamera& camera : data.cameras) ids.push_back(camera.id);
  return ids;
}

// A point of the room each: body(point) to `width` numbers.
template <class Body>
void each_point(sgrt_context* context, const sgrt_view* x_in_room, const sgrt_mut_view* out, int width, Body&& body) {
  const Points x = read_points(x_in_room, "x_in_room");
  check_output(out, "covariance", SGRT_F64, {x.rows(), width});
  check_apart(out, "covariance", x_in_room, "x_in_room");
  std::vector<double> values(static_cast<std::size_t>(x.rows() * width));
  parallel_for(
      run_of(context), x.rows(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) body(Vec3(x.row(i)), &values[static_cast<std::size_t>(i * width)]);
      },
      "covariance");
  write_view(*out, values.data());
}

void need_uncertainty(const Rig& rig) {
  if (rig.uncertainty.parameters.empty()) refuse("rig", in_quotes(rig.id), "one that states its uncertainty");
}

const char* text_of_calibration(const sgrt_calibration& r, std::int32_t field, std::int32_t index) {
  const auto of = [&](const std::vector<std::string>& list) {
    return index >= 0 && static_cast<std::size_t>(index) < list.size() ? list[index].c_str() : nullptr;
  };
  switch (field) {
    case SGRT_CALIBRATION_REPORT:
      return index == 0 ? r.report.c_str() : nullptr;
    case SGRT_CALIBRATION_WARNING:
      return of(r.warnings);
    case SGRT_CALIBRATION_PARAMETER:
      return of(r.parameters);
    default:
      return nullptr;
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_calibration_data_init(sgrt_calibration_data* data, size_t size) {
  return guard([&] { init_struct(data, size, empty_data(), "data"); });
}

sgrt_status sgrt_calibration_options_init(sgrt_calibration_options* options, size_t size) {
  return guard([&] { init_struct(options, size, default_options(), "options"); });
}

sgrt_status sgrt_calibration_solve(sgrt_context* context, const sgrt_calibration_data* data,
                                   const sgrt_calibration_options* options, sgrt_calibration** result) {
  return guard([&] {
    need(result, "result");
    const CalibrationData d = from_c(data);
    const Options o = from_c(options);
    const CalibrationResult r = calibrate(run_of(context), d, o.calibration);
    auto handle = handle_of(d, r);
    handle->info.iterations = r.iterations;
    if (r.status == Status::kOk) {
      set_corners(r.bundle, r.scene, ids_of(d), r.rig, *handle);
      handle->info.noise_px = r.noise;
      handle->info.rms_px = r.rms;
      handle->info.rms_all_px = r.rms_all;
      handle->rig_json = rig_with_provenance(d, r);
      handle->parameters = r.parameters;
      handle->covariance.assign(r.covariance.data(), r.covariance.data() + r.covariance.size());  // symmetric
    }
    *result = handle.release();
    return answer(r.status, (*result)->message.c_str());
  });
}

sgrt_status sgrt_calibration_check(sgrt_context* context, const sgrt_rig* rig, const sgrt_calibration_data* data,
                                   const sgrt_calibration_options* options, sgrt_calibration** result) {
  return guard([&] {
    need(rig, "rig");
    need(result, "result");
    const CalibrationData d = from_c(data);
    const Options o = from_c(options);
    const CheckResult r = check_rig(run_of(context), rig->rig, d, o.calibration);
    auto handle = handle_of(d, r);
    if (r.status == Status::kOk) {
      set_corners(r.bundle, r.scene, ids_of(d), rig->rig, *handle);
      handle->info.noise_px = r.noise;
      handle->info.rms_px = r.rms;
      handle->info.rms_all_px = r.rms_all;
      handle->info.expected_rms_px = r.expected_rms;
    }
    *result = handle.release();
    return answer(r.status, (*result)->message.c_str());
  });
}

sgrt_status sgrt_calibration_room(sgrt_context* context, const sgrt_rig* const* rigs, int32_t count,
                                  const sgrt_calibration_data* data, const sgrt_calibration_options* options,
                                  sgrt_calibration** result) {
  return guard([&] {
    need(rigs, "rigs");
    need(result, "result");
    check_range(count, 1, 64, "count");
    std::vector<const Rig*> all;
    for (std::int32_t i = 0; i < count; ++i) {
      need(rigs[i], ("rigs[" + std::to_string(i) + "]").c_str());
      all.push_back(&rigs[i]->rig);
    }
    const CalibrationData d = from_c(data);
    const Options o = from_c(options);
    const RoomResult r = room_from_phantom(run_of(context), all, d, o.room);
    auto handle = handle_of(d, r);
    if (r.status == Status::kOk) {
      handle->info.noise_px = r.noise_px;
      handle->info.rms_px = r.rigs.front().rms_px;
      handle->rig_json = rig_with_provenance(d, r);
    }
    *result = handle.release();
    return answer(r.status, (*result)->message.c_str());
  });
}

void sgrt_calibration_free(sgrt_calibration* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_calibration_summary(const sgrt_calibration* result, sgrt_calibration_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, result->info);
  });
}

sgrt_status sgrt_calibration_array(const sgrt_calibration* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    const auto n = static_cast<std::int64_t>(result->parameters.size());
    const auto k = static_cast<std::int64_t>(result->corners.size() / 8);
    switch (field) {
      case SGRT_CALIBRATION_CORNERS:
        *view = k > 0 ? lend(result->corners.data(), SGRT_F64, {k, 8}) : sgrt_view{};
        break;
      case SGRT_CALIBRATION_COVARIANCE:
        *view = n > 0 ? lend(result->covariance.data(), SGRT_F64, {n, n}) : sgrt_view{};
        break;
      case SGRT_CALIBRATION_PIXEL_OFFSET:
        *view = result->pixel_offset.empty()
                    ? sgrt_view{}
                    : lend(result->pixel_offset.data(), SGRT_F32, {result->height, result->width});
        break;
      default:
        refuse("field", std::to_string(field), "SGRT_CALIBRATION_CORNERS (1) to SGRT_CALIBRATION_PIXEL_OFFSET (3)");
    }
  });
}

const char* sgrt_calibration_text(const sgrt_calibration* result, int32_t field, int32_t index) {
  return guard_text([&] { return result ? text_of_calibration(*result, field, index) : nullptr; });
}

sgrt_status sgrt_calibration_rig(const sgrt_calibration* result, sgrt_rig** rig) {
  return guard([&] {
    need(result, "result");
    need(rig, "rig");
    if (result->rig_json.empty()) fail(Status::kNotFound, "result: it has no rig");
    auto handle = std::make_unique<sgrt_rig>();
    handle->rig = rig_from_json(result->rig_json.data(), result->rig_json.size());
    handle->json = result->rig_json;
    *rig = handle.release();
  });
}

sgrt_status sgrt_rig_pixel_covariance(sgrt_context* context, const sgrt_rig* rig, const char* camera_id,
                                      const sgrt_view* x_in_room, const sgrt_mut_view* covariance) {
  return guard([&] {
    need(rig, "rig");
    need(camera_id, "camera_id");
    const int camera = camera_index(rig->rig, camera_id);
    need_uncertainty(rig->rig);
    each_point(context, x_in_room, covariance, 3, [&](const Vec3& x, double* out) {
      const Mat2X modes = pixel_modes(rig->rig, camera, x);
      const Eigen::Matrix2d C = modes * modes.transpose();
      out[0] = C(0, 0);
      out[1] = C(0, 1);
      out[2] = C(1, 1);
    });
  });
}

sgrt_status sgrt_rig_point_covariance(sgrt_context* context, const sgrt_rig* rig, const char* pair_id,
                                      const sgrt_view* x_in_room, double noise_px, const sgrt_mut_view* covariance) {
  return guard([&] {
    need(rig, "rig");
    need(pair_id, "pair_id");
    const StereoPair& pair = pair_of(rig->rig, pair_id);
    need_uncertainty(rig->rig);
    check_range(noise_px, 0, 100, "noise_px");
    each_point(context, x_in_room, covariance, 6, [&](const Vec3& x, double* out) {
      const Mat3X modes = point_modes(rig->rig, pair, x);
      const Mat3 C = modes * modes.transpose() + triangulation_covariance(rig->rig, pair, x, noise_px);
      const int rows[] = {0, 0, 0, 1, 1, 2}, columns[] = {0, 1, 2, 1, 2, 2};
      for (int i = 0; i < 6; ++i) out[i] = C(rows[i], columns[i]);
    });
  });
}
