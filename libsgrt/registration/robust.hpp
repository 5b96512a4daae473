// Weights of residuals: one kernel, a scale that shrinks from round to round, and trimming. Holland and Welsch (1977);
// Yang et al. (2020); Chetverikov et al. (2002). docs/theory/icp.md section 3.
#pragma once

#include <vector>

namespace sgrt {

enum class Kernel : int {
  kAuto = 0,   // Tukey on the way, least squares on the inliers at the end: the fast search
  kNone = 1,   // least squares
  kTukey = 2,  // (1 - (u / 4.685)^2)^2
  kWelsch = 3  // exp(-(u / 2.985)^2)
};

// u: |residual| over its scale. Both constants lose 5 % on Gaussian residuals.
double weight_of(Kernel kernel, double u);

// The scale of a round: wide at first, so that all pull, then down to `least`, in the unit of the residuals.
class GraduatedScale {
 public:
  double next(double least);
  bool settled() const { return settled_; }

 private:
  double scale_ = 0;
  bool settled_ = false;
};

// What `share` of the values does not exceed, by way of `scratch`. Infinity for a share of 1.
float trim_limit(const std::vector<float>& values, double share, std::vector<float>& scratch);

// Exact; 0 where there is none. Reads `values` twice and moves none of them.
double median_of(const std::vector<float>& values, std::vector<float>& scratch);

}  // namespace sgrt
