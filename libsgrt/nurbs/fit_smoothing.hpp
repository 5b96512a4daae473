// How much to smooth: restricted maximum likelihood (Wahba 1985; Wood 2011) or generalised cross-validation (Craven and
// Wahba 1979) of the weight lambda of the bending energy. docs/theory/nurbs_fit.md eq. 11-13.
#pragma once

#include "nurbs/fit_system.hpp"

namespace sgrt {

struct Solution {
  double lambda = 0;
  Band factor;          // of X^T W X + lambda P
  Eigen::MatrixXd c;    // coefficients less the trend
  double deviance = 0;  // sum w r^2 + lambda c^T P c, all columns
  double score = 0;     // REML or GCV, what is minimised
};

struct Smoother {
  const Run& run;
  const FitGrid& grid;
  const Band& energy;
  FitSmoothing method;
  double lambda;  // where it is given
};

// Of one lambda; score +infinity where the matrix is not positive definite. count: samples behind the sums.
Solution solve_at(const Smoother& smoother, const Normal& normal, double count, double lambda);

// The best lambda by a search from `start` in steps of a factor exp(step).
Solution choose(const Smoother& smoother, const Normal& normal, double count, double start, double step);

// lambda at which energy and data have the same trace.
double balanced_lambda(const Normal& normal, const Band& energy);

// Where the surface bends more than lambda expects it becomes softer, and stiffer where less: one step of Fellner and
// Schall's fixed point (Wood and Fasiolo 2017) in a window about each cell. Without points nothing changes.
void adapt(const Smoother& smoother, const Solution& solution, double count, std::vector<double>& stiffness);

// How much of the bias that the prior expects is there: 0 for a surface that the smoothing leaves as it is, 1 for one
// as rough as the prior. From what a second smoothing takes off, less what it takes off noise of this variance.
double bias_share(const Smoother& smoother, const Normal& normal, const Band& factor, double lambda,
                  const Eigen::MatrixXd& c, double variance);

// tr(A^-1 P) from the band of A^-1.
double trace_product(const Band& inverse, const Band& P);

}  // namespace sgrt
