// See world.hpp. Built in the order in which one handle needs another.
#include "world.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>

#include "args.hpp"

namespace calls {
namespace {

Scene the_scene;
std::map<std::string, void*> handles;

// The handle that the base call of a function gives.
void keep_answer(const char* type, const char* name) {
  for (const Function& f : functions()) {
    if (f.name != std::string(name)) continue;
    Call call(f);
    const Answer answer = call.run();
    must(answer.status, name);
    for (const Param& p : f.params) {
      if (p.kind != Param::kHandleOut) continue;
      void** slot;
      std::memcpy(&slot, call.args() + p.offset, sizeof slot);
      handles[type] = *slot;
      *slot = nullptr;  // kept
    }
    return;
  }
  must(SGRT_E_NOT_FOUND, name);
}

}  // namespace

const Scene& scene() {
  return the_scene;
}

void must(sgrt_status status, const char* what) {
  if (status == SGRT_OK) return;
  std::fprintf(stderr, "the world cannot be built: %s: %s\n", what, sgrt_last_error());
  std::exit(2);
}

void* example(const std::string& type) {
  const auto at = handles.find(type);
  return at == handles.end() ? nullptr : at->second;
}

void build_world() {
  the_scene = make_scene();
  sgrt_rig* rig = nullptr;
  must(sgrt_rig_from_json(the_scene.rig.data(), the_scene.rig.size(), &rig), "rig");
  handles["sgrt_rig"] = rig;
  light_scene(the_scene, rig);
  keep_answer("sgrt_surface", "sgrt_surface_create");
  keep_answer("sgrt_roi", "sgrt_roi_from_polygon");
  keep_answer("sgrt_stereo", "sgrt_stereo_match");
  keep_answer("sgrt_stripe", "sgrt_stripe_extract");
  keep_answer("sgrt_laser", "sgrt_laser_sweep");
  keep_answer("sgrt_tof", "sgrt_tof_measure");
  keep_answer("sgrt_nurbs_curve", "sgrt_nurbs_curve_create");
  keep_answer("sgrt_nurbs_surface", "sgrt_nurbs_surface_create");
  keep_answer("sgrt_nurbs_fit", "sgrt_nurbs_fit_create");
  keep_answer("sgrt_curvature", "sgrt_curvature_compute");
  keep_answer("sgrt_landmark_model", "sgrt_landmark_model_learn");
  keep_answer("sgrt_landmarks", "sgrt_landmarks_find");
  keep_answer("sgrt_volume", "sgrt_volume_skin");
  keep_answer("sgrt_reference", "sgrt_reference_create");
  keep_answer("sgrt_icp", "sgrt_icp_align");
  keep_answer("sgrt_advice", "sgrt_roi_advise");
  keep_answer("sgrt_coarse", "sgrt_coarse_align");
  keep_answer("sgrt_deform", "sgrt_deform_align");
  keep_answer("sgrt_calibration", "sgrt_calibration_solve");
  keep_answer("sgrt_filter_session", "sgrt_filter_session_create");
  keep_answer("sgrt_laser_session", "sgrt_laser_session_create");
  keep_answer("sgrt_tracker", "sgrt_tracker_create");
  // Sessions that are only read have seen a frame.
  must(sgrt_filter_session_push(nullptr, one<sgrt_filter_session>("sgrt_filter_session"),
                                one<sgrt_surface>("sgrt_surface"), 0, nullptr),
       "filter session");
  for (int i = 0; i < kReadings; ++i) {
    const sgrt_view image =
        sgrt_view_of(&the_scene.stripes[i * kLaserWidth * kLaserHeight], SGRT_U8, kLaserHeight, kLaserWidth, 0);
    must(sgrt_laser_session_push(nullptr, one<sgrt_laser_session>("sgrt_laser_session"), &image, nullptr,
                                 the_scene.angles[i], the_scene.times[i], nullptr),
         "laser session");
  }
  sgrt_tracker_info info;
  info.struct_size = sizeof info;
  must(sgrt_tracker_push(nullptr, one<sgrt_tracker>("sgrt_tracker"), one<sgrt_surface>("sgrt_surface"), 0, &info),
       "tracker");
}

void free_world() {
  for (const auto& [type, handle] : handles) free_handle(type, handle);
  handles.clear();
}

}  // namespace calls
