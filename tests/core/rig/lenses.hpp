// Real lenses for the tests: OpenCV's sample calibration (left_intrinsics.yml), the DIC challenge's distorted camera
// (DICe, epipolar_distortion/cal.xml), a depth camera's rational model, and what a pod of this project looks like.
#pragma once

#include <vector>

#include "rig/rig.hpp"

namespace sgrt::test {

inline Camera lens(const char* id, int width, int height, double f, double cx, double cy, int count,
                   const std::array<double, 8>& distortion) {
  Camera c;
  c.id = id;
  c.width = width;
  c.height = height;
  c.fx = c.fy = f;
  c.cx = cx;
  c.cy = cy;
  c.distortion_count = count;
  c.distortion = distortion;
  return c;
}

inline std::vector<Camera> real_lenses() {
  Vec6 twist;
  twist << 0.4, -1.9, 0.7, 120, -340, 2000;
  std::vector<Camera> all = {
      lens("pinhole", 1280, 1024, 2400, 640.5, 511.25, 0, {}),
      lens("pod", 1280, 1024, 2412.7, 652.1, 498.3, 5, {-0.112, 0.173, 3.1e-4, -4.7e-4, -0.05}),
      lens("opencv", 640, 480, 535.91573396163199, 342.28315473308373, 235.57082909788173, 5,
           {-0.26637260909660682, -0.038588898922304653, 0.0017831947042852964, -0.00028122100441115472,
            0.23839153080878486}),
      lens("dice", 1920, 1080, 2666.6666666666667, 959.5, 539.5, 5,
           {-0.2361956054191, -0.09858048851165, 0, 0, -0.3652319258538}),
      lens("depth", 1280, 720, 610.5, 637.2, 366.1, 8,
           {0.4716, -2.5241, 5.4e-4, -2.1e-4, 1.4489, 0.3497, -2.3492, 1.3779}),
  };
  for (Camera& camera : all) camera.camera_from_room = se3_exp(twist);
  all[1].fy = 2409.1;
  return all;
}

}  // namespace sgrt::test
