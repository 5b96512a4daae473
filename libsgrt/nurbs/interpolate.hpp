// Curves and surfaces through data points (The NURBS Book A9.1, A9.4) or near them with fewer control points (A9.6,
// A9.7), and the chapter's own reconstruction, which takes data points for control points. docs/theory/nurbs.md.
#pragma once

#include "core/surface.hpp"
#include "nurbs/curve.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

// Which parameter a data point gets: equal steps, by chord length (eq. 9.4, 9.5), or by its root (eq. 9.6).
enum class Parameters { kUniform = 0, kChord = 1, kCentripetal = 2 };

// A curve of `count` control points: through all points where count is their number, else the least-squares curve that
// keeps the first and the last one. Throws kDegenerate where points coincide so that there is none.
NurbsCurve fit_curve(const Points& points, int degree, int count, Parameters parameters);

// The same for a grid of nu x nv points, v fastest, by count[0] x count[1] control points.
NurbsSurface fit_grid(const Points& points, int nu, int nv, const int degree[2], const int count[2],
                      Parameters parameters);

// The chapter's eight steps: the points of an organised surface become the control points, knots as in eq. 10.9 and
// 10.10 (uniform, clamped), degrees c and d. It approximates: a cap of radius R is flattened by h^2 / (3 R) at pitch h
// and degree 3. u runs along a row of the grid (with x, for a height field), v across the rows; v runs backwards where
// otherwise S_u x S_v would point against the surface's normals.
NurbsSurface chapter_surface(const Surface& surface, int c, int d);

}  // namespace sgrt
