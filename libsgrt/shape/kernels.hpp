// The hot loop of curvature, compiled once per instruction set from moments_kernel.inl (plain C inside).
#pragma once

namespace sgrt::kernels {

constexpr int kMoments = 28;  // 21 of the basis by itself, 6 with the height, and the height squared

// Points in a frame, sorted by cell; arrays end in four numbers more.
struct Sheet {
  const double *x, *y, *z;     // mm
  const double *nx, *ny, *nz;  // unit normals
  const double* weight;        // how many measured points each stands for
};

struct Disc {
  double centre[3];
  double axes[9];       // rows: two of the tangent plane, then the normal
  double radius;        // mm
  double least_cosine;  // of a point's normal with the frame's
};

// Points begin ... end - 1 of the sheet that lie in the disc, over its radius: u, v, w (the height), and weight;
// the others 0 0 0 0. Writes whole groups of four; returns how many numbers each array then holds more.
long gather_baseline(const Sheet& sheet, const Disc& disc, long begin, long end, double* u, double* v, double* w,
                     double* one);
long gather_avx2(const Sheet& sheet, const Disc& disc, long begin, long end, double* u, double* v, double* w,
                 double* one);

// Weighted sums of the products of (1, u, v, g u^2, g u v, g v^2, w), g = 1 + w^2 / (u^2 + v^2) (eq. 11): the upper
// triangle row by row.
void moments_baseline(const double* u, const double* v, const double* w, const double* one, long n, double* sums);
void moments_avx2(const double* u, const double* v, const double* w, const double* one, long n, double* sums);

}  // namespace sgrt::kernels
