// The rig: JSON in, texts and cameras out, projection and rays.
#include "rig/rig.hpp"

#include <algorithm>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kBlock = 4096;  // points
const double kNan = std::numeric_limits<double>::quiet_NaN();

template <class T>
bool has(const std::vector<T>& list, std::int32_t index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size();
}

const char* text_of_rig(const sgrt_rig& handle, std::int32_t field, std::int32_t index) {
  const Rig& rig = handle.rig;
  const bool pair = has(rig.pairs, index), tof = has(rig.tofs, index);
  switch (field) {
    case SGRT_RIG_JSON:
      return index == 0 ? handle.json.c_str() : nullptr;
    case SGRT_RIG_ID:
      return index == 0 ? rig.id.c_str() : nullptr;
    case SGRT_RIG_ROOM:
      return index == 0 ? rig.room.c_str() : nullptr;
    case SGRT_RIG_CAMERA_ID:
      return has(rig.cameras, index) ? rig.cameras[index].id.c_str() : nullptr;
    case SGRT_RIG_PAIR_ID:
      return pair ? rig.pairs[index].id.c_str() : nullptr;
    case SGRT_RIG_PAIR_LEFT:
      return pair ? rig.cameras[rig.pairs[index].left].id.c_str() : nullptr;
    case SGRT_RIG_PAIR_RIGHT:
      return pair ? rig.cameras[rig.pairs[index].right].id.c_str() : nullptr;
    case SGRT_RIG_TOF_ID:
      return tof ? rig.tofs[index].id.c_str() : nullptr;
    case SGRT_RIG_TOF_CAMERA:
      return tof ? rig.cameras[rig.tofs[index].camera].id.c_str() : nullptr;
    case SGRT_RIG_TOF_PIXEL_OFFSET:
      return tof ? rig.tofs[index].pixel_offset_file.c_str() : nullptr;
    default:
      return nullptr;
  }
}

sgrt_rig_tof to_c(const TofUnit& unit) {
  sgrt_rig_tof c{};
  c.frequency_count = static_cast<std::int32_t>(unit.modulation_hz.size());
  c.tap_count = static_cast<std::int32_t>(unit.tap_phase_rad.size());
  c.differential = unit.differential ? 1 : 0;
  std::copy(unit.modulation_hz.begin(), unit.modulation_hz.end(), c.modulation_hz);
  std::copy(unit.tap_phase_rad.begin(), unit.tap_phase_rad.end(), c.tap_phase_rad);
  c.electrons_per_count = unit.electrons_per_count;
  c.read_noise_e = unit.read_noise_e;
  c.refractive_index = unit.refractive_index;
  return c;
}

sgrt_rig_camera to_c(const Camera& camera) {
  sgrt_rig_camera c{};
  c.width = camera.width;
  c.height = camera.height;
  c.distortion_count = camera.distortion_count;
  const double intrinsics[4] = {camera.fx, camera.fy, camera.cx, camera.cy};
  std::copy(intrinsics, intrinsics + 4, c.intrinsics);
  std::copy(camera.distortion.begin(), camera.distortion.end(), c.distortion);
  pose_to_rows(camera.camera_from_room, c.camera_from_room);
  return c;
}

const Camera& camera_of(const sgrt_rig* rig, const char* camera_id) {
  need(rig, "rig");
  need(camera_id, "camera_id");
  return rig->rig.cameras[camera_index(rig->rig, camera_id)];
}

// Every output against the input and against each other; `jacobian` may be absent.
void check_outputs(const sgrt_view* input, const char* input_name, const sgrt_mut_view* output, const char* output_name,
                   const sgrt_mut_view* jacobian) {
  check_apart(output, output_name, input, input_name);
  if (absent(jacobian)) return;
  check_apart(jacobian, "jacobian", input, input_name);
  check_apart(jacobian, "jacobian", output, output_name);
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_rig_from_json(const char* text, size_t size, sgrt_rig** rig) {
  return guard([&] {
    need(text, "text");
    need(rig, "rig");
    auto handle = std::make_unique<sgrt_rig>();
    handle->rig = rig_from_json(text, size);
    handle->json = rig_to_json(handle->rig);
    *rig = handle.release();
  });
}

void sgrt_rig_free(sgrt_rig* rig) {
  guard([&] { delete rig; });
}

sgrt_status sgrt_rig_summary(const sgrt_rig* rig, sgrt_rig_info* info) {
  return guard([&] {
    need(rig, "rig");
    need(info, "info");
    check_result(info, "info.struct_size");
    sgrt_rig_info r{};
    r.camera_count = static_cast<std::int32_t>(rig->rig.cameras.size());
    r.pair_count = static_cast<std::int32_t>(rig->rig.pairs.size());
    r.tof_count = static_cast<std::int32_t>(rig->rig.tofs.size());
    write_struct(info, r);
  });
}

const char* sgrt_rig_text(const sgrt_rig* rig, int32_t field, int32_t index) {
  return guard_text([&] { return rig ? text_of_rig(*rig, field, index) : nullptr; });
}

sgrt_status sgrt_rig_camera_get(const sgrt_rig* rig, int32_t index, sgrt_rig_camera* camera) {
  return guard([&] {
    need(rig, "rig");
    need(camera, "camera");
    check_result(camera, "camera.struct_size");
    if (!has(rig->rig.cameras, index))
      refuse("index", std::to_string(index), "a camera, 0 to " + std::to_string(rig->rig.cameras.size() - 1));
    write_struct(camera, to_c(rig->rig.cameras[index]));
  });
}

sgrt_status sgrt_rig_tof_get(const sgrt_rig* rig, int32_t index, sgrt_rig_tof* tof) {
  return guard([&] {
    need(rig, "rig");
    need(tof, "tof");
    check_result(tof, "tof.struct_size");
    if (!has(rig->rig.tofs, index))
      refuse("index", std::to_string(index),
             "a time-of-flight unit of the rig, which has " + std::to_string(rig->rig.tofs.size()));
    write_struct(tof, to_c(rig->rig.tofs[index]));
  });
}

sgrt_status sgrt_rig_project(sgrt_context* context, const sgrt_rig* rig, const char* camera_id,
                             const sgrt_view* x_in_room, const sgrt_mut_view* pixels, const sgrt_mut_view* jacobian) {
  return guard([&] {
    const Camera& camera = camera_of(rig, camera_id);
    const Points x = read_points(x_in_room, "x_in_room");
    const std::int64_t n = x.rows();
    check_output(pixels, "pixels", SGRT_F64, {n, 2});
    if (!absent(jacobian)) check_output(jacobian, "jacobian", SGRT_F64, {n, 2, 3});
    check_outputs(x_in_room, "x_in_room", pixels, "pixels", jacobian);
    std::vector<double> p(static_cast<std::size_t>(n) * 2), J(absent(jacobian) ? 0 : static_cast<std::size_t>(n) * 6);
    parallel_for(
        run_of(context), n, kBlock,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i) {
            Mat23 d = Mat23::Constant(kNan);
            const Vec3 point = x.row(i).transpose();
            const Vec2 pixel = project(camera, point, J.empty() ? nullptr : &d);
            Eigen::Map<Vec2>{&p[i * 2]} = pixel;
            if (!J.empty()) Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{&J[i * 6]} = d;
          }
        },
        "project");
    write_view(*pixels, p.data());
    if (!absent(jacobian)) write_view(*jacobian, J.data());
  });
}

sgrt_status sgrt_rig_unproject(sgrt_context* context, const sgrt_rig* rig, const char* camera_id,
                               const sgrt_view* pixels, const sgrt_mut_view* directions, const sgrt_mut_view* jacobian,
                               double centre_mm[3]) {
  return guard([&] {
    const Camera& camera = camera_of(rig, camera_id);
    check_view(pixels, "pixels", Kind::kReal, {kAny, 2});
    const std::int64_t n = pixels->shape[0];
    check_limit(n, kMaxPoints, "pixels");
    check_output(directions, "directions", SGRT_F64, {n, 3});
    if (!absent(jacobian)) check_output(jacobian, "jacobian", SGRT_F64, {n, 3, 2});
    check_outputs(pixels, "pixels", directions, "directions", jacobian);
    std::vector<double> p(static_cast<std::size_t>(n) * 2), rays(static_cast<std::size_t>(n) * 3);
    std::vector<double> J(absent(jacobian) ? 0 : static_cast<std::size_t>(n) * 6);
    read_view(*pixels, p.data());
    parallel_for(
        run_of(context), n, kBlock,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i) {
            Mat32 d = Mat32::Constant(kNan);
            const Vec2 pixel(p[i * 2], p[i * 2 + 1]);
            const Vec3 ray = unproject(camera, pixel, J.empty() ? nullptr : &d);
            Eigen::Map<Vec3>{&rays[i * 3]} = ray;
            if (!J.empty()) Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>{&J[i * 6]} = d;
          }
        },
        "unproject");
    const Vec3 centre = camera.centre_in_room();
    write_view(*directions, rays.data());
    if (!absent(jacobian)) write_view(*jacobian, J.data());
    if (centre_mm) Eigen::Map<Vec3>{centre_mm} = centre;
  });
}
