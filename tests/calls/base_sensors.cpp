// Base calls: library, context, surfaces, regions, frames, rig and sensors.
#include "args.hpp"
#include "world.hpp"

#define BASE(function) void base([[maybe_unused]] Args_##function& a)

namespace calls {
namespace {

constexpr std::int64_t kLump = kLumpSide;

const char* text(const std::string& s) {
  return static_cast<const char*>(in(s.c_str(), s.size() + 1));
}

sgrt_surface_data* lump_data() {
  auto* d = options(sgrt_surface_data_init);
  d->points = *view(scene().lump.data(), SGRT_F64, {kLump, kLump, 3});
  d->normals = *view(scene().lump_normals.data(), SGRT_F64, {kLump, kLump, 3});
  d->sigma_mm = *view(scene().lump_sigma.data(), SGRT_F64, {kLump, kLump});
  std::vector<double> mode;  // of the scale
  for (double x : scene().lump) mode.push_back(1e-3 * x);
  d->modes = *view(mode.data(), SGRT_F64, {1, kLump, kLump, 3});
  d->mode_names = static_cast<const char* const*>(in(std::vector<const char*>{text("calls/0")}));
  return d;
}

sgrt_view* image(const std::vector<std::uint8_t>& pixels, std::int64_t height, std::int64_t width) {
  return view(pixels.data(), SGRT_U8, {height, width});
}

sgrt_view* stripe_image() {
  return image(scene().stripes, kLaserHeight, kLaserWidth);
}

sgrt_view* taps() {
  return view(scene().taps.data(), SGRT_U16, {1, 4, kTofHeight, kTofWidth});
}

const double kSlightTurn[16] = {0.8, -0.6, 0, 1, 0.6, 0.8, 0, -2, 0, 0, 1, 0.5, 0, 0, 0, 1};

const double* pose() {
  return static_cast<const double*>(in(kSlightTurn, sizeof kSlightTurn));
}

template <class T>
T* session(const char* type, sgrt_status status, T*& made) {
  must(status, type);
  return static_cast<T*>(lasting(type, made));
}

sgrt_stereo_session* stereo_session() {
  sgrt_stereo_session* s = nullptr;
  return session("sgrt_stereo_session",
                 sgrt_stereo_session_create(context_of_calls, one<sgrt_rig>("sgrt_rig"), "pod", nullptr, &s), s);
}

}  // namespace

BASE(sgrt_surface_create) {
  auto* d = lump_data();
  a.data = d;
}
BASE(sgrt_surface_from_height_field) {
  std::vector<double> z;
  for (std::size_t i = 2; i < scene().lump.size(); i += 3) z.push_back(scene().lump[i]);
  a.z_mm = view(z.data(), SGRT_F64, {kLump, kLump});
  a.origin_mm = numbers({-60, -60});
  a.spacing_mm = numbers({5, 5});
}
BASE(sgrt_surface_move) {
  a.pose = pose();
}
BASE(sgrt_surface_fuse) {
  const std::vector<const sgrt_surface*> both(2, one<sgrt_surface>("sgrt_surface"));
  a.surfaces = static_cast<const sgrt_surface* const*>(in(both.data(), sizeof(void*) * 2));
  a.count = 2;
}
BASE(sgrt_surface_distance) {
  a.distance_mm = out_view(SGRT_F64, {kLump, kLump});
}
BASE(sgrt_surface_filter) {
  a.reason = out_view(SGRT_U8, {kLump, kLump});
}

BASE(sgrt_filter_session_push) {
  sgrt_filter_session* s = nullptr;
  a.session = session("sgrt_filter_session", sgrt_filter_session_create(nullptr, &s), s);
}

BASE(sgrt_roi_from_polygon) {
  const double corners[] = {-50, -50, 50, -50, 50, 50, 0, 20, -50, 50};
  a.vertices_xy_mm = view(corners, SGRT_F64, {5, 2});
}
BASE(sgrt_roi_from_box) {
  a.min_mm = numbers({-50, -50, -100});
  a.max_mm = numbers({50, 50, 100});
}
BASE(sgrt_roi_mask) {
  a.mask = out_view(SGRT_U8, {kLump, kLump});
}
BASE(sgrt_roi_move) {
  a.pose = pose();
}

BASE(sgrt_frame_shift_from_pose) {
  a.reference_from_live = pose();
}
BASE(sgrt_frame_four_dof) {
  a.reference_from_live = pose();
}
BASE(sgrt_frame_fixed_from_couch) {
  a.couch_deg = 20;
}
BASE(sgrt_frame_fixed_from_gantry) {
  a.gantry_deg = 20;
}
BASE(sgrt_frame_couch_turn) {
  a.couch_deg = 20;
}

BASE(sgrt_rig_from_json) {
  a.text = static_cast<const char*>(in(scene().rig.data(), scene().rig.size()));
  a.size = scene().rig.size();
}
BASE(sgrt_rig_project) {
  const double x[] = {0, 0, 0, 10, -20, 30, 0, 0, 2000};
  a.camera_id = text("l");
  a.x_in_room = view(x, SGRT_F64, {3, 3});
  a.pixels = out_view(SGRT_F64, {3, 2});
  a.jacobian = out_view(SGRT_F64, {3, 2, 3});
}
BASE(sgrt_rig_unproject) {
  const double x[] = {0, 0, 30, 20};
  a.camera_id = text("l");
  a.pixels = view(x, SGRT_F64, {2, 2});
  a.directions = out_view(SGRT_F64, {2, 3});
  a.jacobian = out_view(SGRT_F64, {2, 3, 2});
}

BASE(sgrt_stereo_match) {
  a.pair_id = text("pod");
  a.left = image(scene().left, kHeight, kWidth);
  a.right = image(scene().right, kHeight, kWidth);
}
BASE(sgrt_stereo_session_create) {
  a.pair_id = text("pod");
}
BASE(sgrt_stereo_session_push) {
  a.session = stereo_session();
  a.left = image(scene().left, kHeight, kWidth);
  a.right = image(scene().right, kHeight, kWidth);
}
BASE(sgrt_stereo_session_set_prior) {
  a.session = stereo_session();
}

BASE(sgrt_stripe_extract) {
  a.image = stripe_image();
  a.dark = nullptr;
}
BASE(sgrt_laser_plane) {
  a.laser_id = text("scanner");
}
BASE(sgrt_laser_sweep) {
  a.laser_id = text("scanner");
  a.images = view(scene().stripes.data(), SGRT_U8, {kReadings, kLaserHeight, kLaserWidth});
  a.angle_rad = view(scene().angles.data(), SGRT_F64, {kReadings});
  a.time_s = view(scene().times.data(), SGRT_F64, {kReadings});
}
BASE(sgrt_laser_session_create) {
  a.laser_id = text("scanner");
}
BASE(sgrt_laser_session_push) {
  sgrt_laser_session* s = nullptr;
  a.session = session(
      "sgrt_laser_session",
      sgrt_laser_session_create(context_of_calls, one<sgrt_rig>("sgrt_rig"), "scanner", nullptr, nullptr, &s), s);
  a.image = stripe_image();
  a.angle_rad = scene().angles[0];
}
BASE(sgrt_laser_signal) {
  a.laser_id = text("scanner");
  a.image = stripe_image();
  a.angle_rad = scene().angles[0];
  double plane[4];
  must(sgrt_laser_plane(one<sgrt_rig>("sgrt_rig"), "scanner", a.angle_rad, plane), "plane");
  // Where the light crosses the body over y = 0.
  const double x = (plane[3] - 20 * plane[2]) / (plane[0] + 0.1 * plane[2]);
  a.point_mm = numbers({x, 0, 0});
  a.axis = numbers({0, 0, 1});
  a.radius_mm = 40;
}

BASE(sgrt_tof_measure) {
  a.tof_id = text("tof0");
  a.taps = taps();
}
BASE(sgrt_tof_session_create) {
  a.tof_id = text("tof0");
}
BASE(sgrt_tof_session_push) {
  sgrt_tof_session* s = nullptr;
  a.session = session("sgrt_tof_session",
                      sgrt_tof_session_create(context_of_calls, one<sgrt_rig>("sgrt_rig"), "tof0", nullptr, &s), s);
  a.taps = taps();
}
BASE(sgrt_tof_keep) {
  a.lent = one<sgrt_tof>("sgrt_tof");
}

}  // namespace calls
