// The extension module sgrt._core: one line a section of sgrt.h, in its order.
#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
  using namespace sgrt_py;
  m.doc() = "sgrt.h for Python. Import `sgrt`, not this module.";
  register_library(m);
  register_context(m);
  register_surface(m);
  register_filter(m);
  register_roi(m);
  register_frame(m);
  register_rig(m);
  register_stereo(m);
  register_laser(m);
  register_tof(m);
  register_nurbs_curve(m);
  register_nurbs_surface(m);
  register_nurbs_fit(m);
  register_curvature(m);
  register_landmarks(m);
  register_volume(m);
  register_icp(m);
  register_advice(m);
  register_coarse(m);
  register_deform(m);
  register_tracker(m);
  register_calibration(m);
}
