// The rig on trial: how far matches lie off their epipolar line, which a wrong rig shows and a right one does not.
// docs/theory/stereo.md eq. 19.
#pragma once

#include "stereo/dense.hpp"

namespace sgrt {

struct EpipolarWork {
  std::vector<std::int64_t> at;       // grid points that are asked
  std::vector<double> off, variance;  // of each, px and px^2; NaN where it has no answer
  std::vector<double> sorted;
};

struct EpipolarCheck {
  std::int64_t count = 0;
  double median, sigma;  // px, of the right image's row less the left one's; sigma: of the median
  double rms;            // px, over the image, noise taken out; NaN all where fewer than 20 windows answer
};

EpipolarCheck check_epipolar(const Run& run, const RectifiedImage& left, const WarpWork& warped, const Grid& grid,
                             int window, float damping, const MatchField& field, EpipolarWork& work);

}  // namespace sgrt
