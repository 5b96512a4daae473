// From coefficients to what is handed out: the surface on clamped knots, the covariance of neighbouring coefficients,
// and where there were points. docs/theory/nurbs_fit.md eq. 18-20.
#pragma once

#include "nurbs/fit_system.hpp"

namespace sgrt {

// fit.surface and fit.conversion_error from fit.coefficients.
void make_surface_of(NurbsFit& fit);

// fit.covariance from the band of the inverse and of that at lambda (1 + step), times `scale`. Needs fit.occupied.
void keep_covariance(NurbsFit& fit, const Band& inverse, const Band& stiffer, double step, double share, double scale);

// fit.occupied from the points with robust[k] > 0.
void mark_occupied(NurbsFit& fit, const FitPoints& points, const std::vector<double>& robust);

// The model itself at (u, v) mm: base + f e, or the three columns.
Vec3 model_point(const NurbsFit& fit, double u, double v);

}  // namespace sgrt
