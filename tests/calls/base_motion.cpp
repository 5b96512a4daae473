// Base calls: registration, tracking, boards, calibration.
#include "args.hpp"
#include "world.hpp"

#define BASE(function) void base([[maybe_unused]] Args_##function& a)

namespace calls {
namespace {

// The lump moved by a millimetre or so.
sgrt_surface* moved() {
  const double pose[16] = {1, 0, 0, 0.8, 0, 1, 0, -0.6, 0, 0, 1, 0.4, 0, 0, 0, 1};
  sgrt_surface* s = nullptr;
  must(sgrt_surface_move(nullptr, one<sgrt_surface>("sgrt_surface"), pose, &s), "moved lump");
  return static_cast<sgrt_surface*>(lasting("sgrt_surface", s));
}

sgrt_view* doubles(const std::vector<double>& values, std::vector<std::int64_t> shape) {
  return view(values.data(), SGRT_F64, shape);
}
sgrt_view* integers(const std::vector<std::int32_t>& values, std::vector<std::int64_t> shape) {
  return view(values.data(), SGRT_I32, shape);
}
const char* text(const std::string& s) {
  return static_cast<const char*>(in(s.c_str(), s.size() + 1));
}
const char* const* texts(const std::vector<std::string>& words) {
  std::vector<const char*> all;
  for (const std::string& word : words) all.push_back(text(word));
  return in(all);
}

sgrt_calibration_data* seen(const Sights& sights, const std::vector<std::string>& cameras, int placements,
                            const std::vector<double>& points) {
  const auto count = static_cast<std::int64_t>(cameras.size());
  auto* d = options(sgrt_calibration_data_init);
  d->camera_count = static_cast<std::int32_t>(count);
  d->placement_count = placements;
  d->camera_ids = texts(cameras);
  d->image_sizes = cameras[0] == "cam" ? *integers({kLaserWidth, kLaserHeight}, {1, 2})
                                       : *integers({640, 480, 640, 480}, {count, 2});
  d->points = *doubles(points, {static_cast<std::int64_t>(points.size() / 3), 3});
  d->index = *integers(sights.index, {sights.count(), 3});
  d->pixels = *doubles(sights.pixels, {sights.count(), 2});
  return d;
}

sgrt_calibration_data* boards_seen() {
  auto* d = seen(scene().sights, {"left", "right"}, kBoards, scene().board);
  d->pair_count = 1;
  d->pair_ids = texts({"pod"});
  d->pair_cameras = *integers({0, 1}, {1, 2});
  return d;
}

sgrt_calibration_options* calibration_options() {
  auto* o = options(sgrt_calibration_options_init);
  o->split_half = 0;
  return o;
}

sgrt_rig* calibrated() {
  sgrt_rig* rig = nullptr;
  must(sgrt_calibration_rig(one<sgrt_calibration>("sgrt_calibration"), &rig), "calibrated rig");
  return static_cast<sgrt_rig*>(lasting("sgrt_rig", rig));
}

sgrt_board* board() {
  sgrt_board* b = options(sgrt_board_init);
  b->columns = kColumns;
  b->rows = kRows;
  b->spacing_mm = 30;
  return b;
}

sgrt_tracker* tracker() {
  sgrt_tracker* t = nullptr;
  must(sgrt_tracker_create(context_of_calls, one<sgrt_surface>("sgrt_surface"), numbers({0, 0, 0}), nullptr, nullptr,
                           nullptr, nullptr, &t),
       "tracker");
  return static_cast<sgrt_tracker*>(lasting("sgrt_tracker", t));
}

}  // namespace

BASE(sgrt_icp_align) {
  a.live = moved();
}
BASE(sgrt_reference_align) {
  a.live = moved();
}
BASE(sgrt_reference_predict) {
  a.live_sigma_mm = 0.3;
}
BASE(sgrt_roi_advise) {
  const std::vector<const sgrt_roi*> all(1, one<sgrt_roi>("sgrt_roi"));
  a.candidates = static_cast<const sgrt_roi* const*>(in(all.data(), sizeof(void*)));
  a.count = 1;
}
BASE(sgrt_coarse_align) {
  const std::vector<double> face = {0,  0,  25, -17, -8,  8, 17,  -8, 8,   -16, 38, 2,
                                    16, 38, 2,  0,   -60, 5, -65, 30, -50, 65,  32, -48};
  std::vector<double> live, covariance;
  for (int i = 0; i < 8; ++i) {
    live.insert(live.end(), {-face[3 * i + 1] + 10, face[3 * i] - 20, face[3 * i + 2] + 30});
    covariance.insert(covariance.end(), {4, 0, 0, 0, 4, 0, 0, 0, 4});
  }
  a.reference_mm = doubles(face, {8, 3});
  a.reference_ids = integers({1, 2, 3, 4, 5, 6, 7, 8}, {8});
  a.reference_covariance_mm2 = doubles(covariance, {8, 3, 3});
  a.live_mm = doubles(live, {8, 3});
  a.live_ids = integers({1, 2, 3, 4, 5, 6, 7, 8}, {8});
  a.live_covariance_mm2 = doubles(covariance, {8, 3, 3});
}
BASE(sgrt_deform_align) {
  a.live = moved();
}

BASE(sgrt_tracker_push) {
  a.tracker = tracker();
  a.live = moved();
}
BASE(sgrt_tracker_set_reference) {
  a.tracker = tracker();
  a.reference = moved();
}

BASE(sgrt_board_points) {
  a.board = board();
  a.points = out_view(SGRT_F64, {kCorners, 3});
}
BASE(sgrt_board_detect) {
  a.board = board();
  a.image = view(scene().chessboard.data(), SGRT_U8, {kBoardHeight, kBoardWidth});
  a.pixels = out_view(SGRT_F64, {kCorners, 2});
  a.sigma_px = out_view(SGRT_F64, {kCorners});
}

BASE(sgrt_calibration_solve) {
  a.data = boards_seen();
  a.options = calibration_options();
}
BASE(sgrt_calibration_check) {
  a.rig = calibrated();
  a.data = boards_seen();
}
BASE(sgrt_calibration_room) {
  const std::vector<const sgrt_rig*> all(1, calibrated());
  a.rigs = static_cast<const sgrt_rig* const*>(in(all.data(), sizeof(void*)));
  a.count = 1;
  a.data = seen(scene().phantom, {"left", "right"}, 1, scene().phantom_points);
}
BASE(sgrt_calibration_laser) {
  const auto count = static_cast<std::int64_t>(scene().stripe_angle.size());
  std::vector<double> board;
  for (std::size_t i = 0; i < scene().board.size(); ++i) board.push_back(i % 3 == 2 ? 0 : 3 * scene().board[i]);
  auto* s = options(sgrt_laser_stripes_init);
  s->placement = *integers(scene().stripe_placement, {count});
  s->angle_rad = *doubles(scene().stripe_angle, {count});
  s->pixels = *doubles(scene().stripe_pixels, {count, 2});
  s->sigma_px = *doubles(scene().stripe_sigma, {count});
  a.laser_id = text("scanner");
  a.data = seen(scene().laser_board, {"cam"}, 3, board);
  a.stripes = s;
}
BASE(sgrt_calibration_tof) {
  std::vector<sgrt_view> frames;
  std::vector<double> poses;
  for (int b = 0; b < 3; ++b) {
    frames.push_back(*view(scene().tof_frames[b].data(), SGRT_F32, {1, 4, kTofHeight, kTofWidth}));
    poses.insert(poses.end(), {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 200. - 400 * b, 0, 0, 0, 1});
  }
  auto* o = options(sgrt_calibration_tof_options_init);
  o->board_mm[0] = o->board_mm[1] = -2000;
  o->board_mm[2] = o->board_mm[3] = 2000;
  a.tof_id = text("tof0");
  a.taps = in(frames);
  a.count = 3;
  a.room_from_board = doubles(poses, {3, 4, 4});
  a.data = nullptr;
  a.options = o;
}
BASE(sgrt_rig_pixel_covariance) {
  a.rig = calibrated();
  a.camera_id = text("right");
  a.x_in_room = doubles({0, 0, 600, 10, 20, 700}, {2, 3});
  a.covariance = out_view(SGRT_F64, {2, 3});
}
BASE(sgrt_rig_point_covariance) {
  a.rig = calibrated();
  a.pair_id = text("pod");
  a.x_in_room = doubles({0, 0, 600, 10, 20, 700}, {2, 3});
  a.noise_px = 0.1;
  a.covariance = out_view(SGRT_F64, {2, 6});
}

}  // namespace calls
