// Rig JSON: any text is refused in one line or read; what was read comes back bit for bit, and its cameras answer.
#include <string>

#include "fuzz.hpp"

namespace {

void use_cameras(const sgrt_rig* rig, const sgrt_rig_info& info) {
  const double points[] = {0, 0, 0, 100, -50, 30, 1e5, 1e5, -1e5, 0, 0, 1000, NAN, 0, 0};
  const sgrt_view x = sgrt_view_of(points, SGRT_F64, 5, 3, 0);
  std::vector<double> pixels(10), rays(15), jacobian(30), covariance(15);
  const sgrt_mut_view p = sgrt_mut_view_of(pixels.data(), SGRT_F64, 5, 2, 0),
                      r = sgrt_mut_view_of(rays.data(), SGRT_F64, 5, 3, 0),
                      j = sgrt_mut_view_of(jacobian.data(), SGRT_F64, 5, 2, 3),
                      k = sgrt_mut_view_of(jacobian.data(), SGRT_F64, 5, 3, 2),
                      c = sgrt_mut_view_of(covariance.data(), SGRT_F64, 5, 3, 0);
  for (int i = 0; i < info.camera_count && i < 4; ++i) {
    sgrt_rig_camera camera;
    camera.struct_size = sizeof camera;
    fuzz::require(fuzz::ok(sgrt_rig_camera_get(rig, i, &camera)), "every camera can be read");
    fuzz::require(fuzz::rigid(camera.camera_from_room), "a pose is a rigid motion");
    const char* id = sgrt_rig_text(rig, SGRT_RIG_CAMERA_ID, i);
    fuzz::checked(sgrt_rig_project(nullptr, rig, id, &x, &p, &j));
    const sgrt_view seen = sgrt_view_of(pixels.data(), SGRT_F64, 5, 2, 0);
    fuzz::checked(sgrt_rig_unproject(nullptr, rig, id, &seen, &r, &k, nullptr));
    fuzz::checked(sgrt_rig_pixel_covariance(nullptr, rig, id, &x, &c));
  }
}

// The smallest images of every unit: the sessions' set-up (rectification, rays) is where odd lenses hurt.
void use_units(const sgrt_rig* rig, const sgrt_rig_info& info) {
  std::vector<double> covariance(6);
  const double point[] = {0, 0, 0};
  const sgrt_view x = sgrt_view_of(point, SGRT_F64, 1, 3, 0);
  const sgrt_mut_view c = sgrt_mut_view_of(covariance.data(), SGRT_F64, 1, 6, 0);
  for (int i = 0; i < info.pair_count && i < 2; ++i) {
    fuzz::checked(sgrt_rig_point_covariance(nullptr, rig, sgrt_rig_text(rig, SGRT_RIG_PAIR_ID, i), &x, 0.1, &c));
  }
  for (int i = 0; i < info.tof_count; ++i) {
    sgrt_rig_tof tof;
    tof.struct_size = sizeof tof;
    fuzz::require(fuzz::ok(sgrt_rig_tof_get(rig, i, &tof)), "every time-of-flight unit can be read");
  }
  double plane[4];
  for (const char* id : {"laser", "l", "fan"}) fuzz::checked(sgrt_laser_plane(rig, id, 0.1, plane));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sgrt_rig* rig = nullptr;
  const sgrt_status status = fuzz::checked(sgrt_rig_from_json(reinterpret_cast<const char*>(data), size, &rig));
  fuzz::require((status == SGRT_OK) == (rig != nullptr), "a handle if and only if SGRT_OK");
  if (rig == nullptr) {
    fuzz::require(status == SGRT_E_FORMAT || status == SGRT_E_LIMIT, "a text is refused as format or limit");
    return 0;
  }
  const std::string text = sgrt_rig_text(rig, SGRT_RIG_JSON, 0);
  sgrt_rig* again = nullptr;
  fuzz::require(fuzz::ok(sgrt_rig_from_json(text.data(), text.size(), &again)), "what was written can be read");
  fuzz::require(text == sgrt_rig_text(again, SGRT_RIG_JSON, 0), "reading and writing changes nothing");
  sgrt_rig_free(again);
  sgrt_rig_info info;
  info.struct_size = sizeof info;
  fuzz::require(fuzz::ok(sgrt_rig_summary(rig, &info)), "a summary");
  use_cameras(rig, info);
  use_units(rig, info);
  sgrt_rig_free(rig);
  return 0;
}
