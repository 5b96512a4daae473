// Least squares over a disc. docs/theory/curvature.md eq. 11-13.
#include "shape/jet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape/forms.hpp"

namespace sgrt {
namespace {

constexpr double kLeastCosine = 0.2;   // of a neighbour's normal: another sheet otherwise
constexpr double kOneSided = 0.2;      // mean offset of the neighbours over the radius
constexpr double kFilled = 0.2;        // mean square of their distance over that of the radius: half where all is full
constexpr double kSheet = 0.3;         // height over the radius, of points in the same sheet
constexpr double kAgainst = 0.1;       // mean of the negative cosines of normals: less is the bend of a thin part
constexpr double kSteepest = 1;        // slope of the fit over the disc's plane
constexpr std::int64_t kMost = 16384;  // points of a disc; of denser ones every second, fourth ... counts

Mat3 axes_about(const Vec3& n) {
  Mat3 axes;
  axes.topRows<2>() = tangent_plane(n);
  axes.row(2) = n.transpose();
  return axes;
}

// Value and derivatives at the middle, over the radius: h, h_u, h_v, h_uu / 2, h_uv, h_vv / 2, and the covariance of
// the value and of the second derivatives; the rest of it is not set.
struct Solved {
  Vec6 x;
  Mat6 covariance;
  double residual;
};

// By Cholesky, M = L L^T, in plain loops: six unknowns are too few for anything larger. Of the inverse only what is
// asked for: with X = L^-1 it is X^T X, and the last three unknowns need the last three columns of X alone.
bool solve_quadric(const double* sums, Solved& out) {
  double L[6][6], X[6][6], y[6], g[6];
  int k = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) L[j][i] = sums[k++];
    g[i] = sums[k++];
  }
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (int j = 0; j < 6; ++j) {
    double d = L[j][j];
    for (int l = 0; l < j; ++l) d -= L[j][l] * L[j][l];
    if (!(d > 0)) return false;
    const double root = std::sqrt(d), inverse = 1 / root;
    least = std::min(least, root), most = std::max(most, root);
    L[j][j] = inverse;
    for (int i = j + 1; i < 6; ++i) {
      double sum = L[i][j];
      for (int l = 0; l < j; ++l) sum -= L[i][l] * L[j][l];
      L[i][j] = sum * inverse;
    }
  }
  if (!(least > 1e-4 * most)) return false;
  double explained = 0;
  for (int i = 0; i < 6; ++i) {
    double sum = g[i];
    for (int l = 0; l < i; ++l) sum -= L[i][l] * y[l];
    y[i] = sum * L[i][i];
    explained += y[i] * y[i];
  }
  for (const int j : {0, 3, 4, 5}) {
    X[j][j] = L[j][j];
    for (int i = j + 1; i < 6; ++i) {
      double sum = 0;
      for (int l = j; l < i; ++l) sum -= L[i][l] * X[l][j];
      X[i][j] = sum * L[i][i];
    }
  }
  for (int i = 5; i >= 0; --i) {
    double sum = y[i];
    for (int l = i + 1; l < 6; ++l) sum -= L[l][i] * out.x[l];
    out.x[i] = sum * L[i][i];
  }
  out.covariance.setZero();
  for (int l = 0; l < 6; ++l) out.covariance(0, 0) += X[l][0] * X[l][0];
  for (int i = 3; i < 6; ++i) {
    for (int j = 3; j <= i; ++j) {
      for (int l = i; l < 6; ++l) out.covariance(i, j) += X[l][i] * X[l][j];
      out.covariance(j, i) = out.covariance(i, j);
    }
  }
  out.residual = std::max(0.0, sums[k] - explained);
  return true;
}

template <int Size>
bool solve_jet(const double* u, const double* v, const double* w, const double* one, long n, Solved& out) {
  using Matrix = Eigen::Matrix<double, Size, Size>;
  using Vector = Eigen::Matrix<double, Size, 1>;
  Matrix M = Matrix::Zero();
  Vector g = Vector::Zero();
  double ww = 0;
  for (long i = 0; i < n; ++i) {
    if (one[i] == 0) continue;
    Vector row;
    const double a = u[i], b = v[i];
    row.template head<6>() << 1, a, b, a * a, a * b, b * b;
    row.template segment<4>(6) << a * a * a, a * a * b, a * b * b, b * b * b;
    if constexpr (Size == 15)
      row.template tail<5>() << a * a * a * a, a * a * a * b, a * a * b * b, a * b * b * b, b * b * b * b;
    M.noalias() += row * row.transpose();
    g += row * w[i];
    ww += w[i] * w[i];
  }
  const Eigen::LLT<Matrix> llt(M);
  if (llt.info() != Eigen::Success) return false;
  const Vector pivots = llt.matrixLLT().diagonal();
  if (!(pivots.minCoeff() > 1e-5 * pivots.maxCoeff())) return false;
  const Matrix inverse = llt.solve(Matrix::Identity());
  const Vector x = llt.solve(g);
  out.x = x.template head<6>();
  out.covariance = inverse.template topLeftCorner<6, 6>();
  out.residual = std::max(0.0, ww - x.dot(g));
  return true;
}

// From heights over the disc's plane to the tensor on the fitted surface (eq. 12).
void to_tensor(const Solved& s, const Vec3& p, const Mat3& axes, double radius, Jet& jet) {
  const double hu = s.x[1], hv = s.x[2];
  const Vec3 eu = axes.row(0), ev = axes.row(1), n = axes.row(2);
  const double g2 = 1 + hu * hu + hv * hv, g = std::sqrt(g2);
  jet.normal = (n - hu * eu - hv * ev) / g;
  jet.foot = p + radius * s.x[0] * n;
  // On e1 along S_u and e2 = normal x e1; S_u = eu + hu n, S_v = ev + hv n.
  const double E = 1 + hu * hu, F = hu * hv;
  jet.e1 = (eu + hu * n) / std::sqrt(E);
  jet.e2 = jet.normal.cross(jet.e1);
  // With (l, m, q) = -(h_uu, h_uv, h_vv) / g: a = l / E, b = (m - F/E l) / area, c = (E q - 2 F m + F^2/E l) / area^2.
  Mat3 J;
  J << 1 / E, 0, 0, -F / E / g, 1 / g, 0, F * F / E / g2, -2 * F / g2, E / g2;
  const Vec3 second(2 * s.x[3], s.x[4], 2 * s.x[5]);
  J *= -1 / (g * radius);
  const Vec3 tensor = J * second;
  jet.a = tensor[0], jet.b = tensor[1], jet.c = tensor[2];
  const Mat3 twice = J * Vec3(2, 1, 2).asDiagonal();
  // Heights were over the radius, so their variance is over its square.
  jet.covariance = twice * s.covariance.bottomRightCorner<3, 3>() * twice.transpose() / (radius * radius);
  jet.foot_variance = s.covariance(0, 0) / g2;
  jet.residual = s.residual * radius * radius / g2;
}

}  // namespace

Mat3 tensor_of(const Jet& j) {
  return j.a * j.e1 * j.e1.transpose() + j.b * (j.e1 * j.e2.transpose() + j.e2 * j.e1.transpose()) +
         j.c * j.e2 * j.e2.transpose();
}

JetFitter::JetFitter(const Run& run, const Pyramid& pyramid, int degree)
    : pyramid_(pyramid), degree_(degree), avx2_(run.isa == Isa::kAvx2) {}

void JetFitter::gather(const Vec3& p, const Mat3& axes, double radius) {
  std::size_t level = 0;
  // The jets' higher terms would see the cubes.
  while (degree_ == 2 && level + 1 < pyramid_.levels.size() && radius >= pyramid_.least_radius[level + 1]) ++level;
  const SkinCells& cells = pyramid_.levels[level];
  kernels::Disc disc;
  Eigen::Map<Vec3>(disc.centre) = p;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(disc.axes) = axes;
  disc.radius = radius;
  disc.least_cosine = kLeastCosine;
  const auto sheet = cells.sheet();
  const auto call = avx2_ ? kernels::gather_avx2 : kernels::gather_baseline;
  n_ = 0;
  cells.each_run(p, radius, [&](std::int64_t begin, std::int64_t end) {
    if (begin == end) return;
    const auto need = static_cast<std::size_t>(n_ + (end - begin) + 4);
    if (u_.size() < need) {
      for (auto* v : {&u_, &v_, &w_, &one_}) v->resize(2 * need);
    }
    n_ += call(sheet, disc, begin, end, u_.data() + n_, v_.data() + n_, w_.data() + n_, one_.data() + n_);
    if (n_ > kMost) thin_out();
  });
}

// Every second point, in whole groups of four.
void JetFitter::thin_out() {
  long kept = 0;
  for (long i = 0; i + 8 <= n_; i += 8, kept += 4) {
    for (long l = 0; l < 4; ++l) {
      for (auto* v : {&u_, &v_, &w_, &one_})
        (*v)[static_cast<std::size_t>(kept + l)] = (*v)[static_cast<std::size_t>(i + 2 * l)];
    }
  }
  n_ = kept;
}

Jet JetFitter::fit(const Vec3& p, const Vec3& normal, double radius) {
  const Mat3 axes = axes_about(normal);
  gather(p, axes, radius);
  Jet jet;
  jet.unknowns = unknowns_of(degree_);
  double sums[kernels::kMoments];
  const auto moments = avx2_ ? kernels::moments_avx2 : kernels::moments_baseline;
  moments(u_.data(), v_.data(), w_.data(), one_.data(), n_, sums);
  jet.count = static_cast<int>(std::lround(sums[0]));
  if (jet.count < jet.unknowns) {
    jet.fault = JetFault::kTooFew;
    return jet;
  }
  Solved s;
  const bool solved = degree_ == 2   ? solve_quadric(sums, s)
                      : degree_ == 3 ? solve_jet<10>(u_.data(), v_.data(), w_.data(), one_.data(), n_, s)
                                     : solve_jet<15>(u_.data(), v_.data(), w_.data(), one_.data(), n_, s);
  if (std::hypot(sums[1], sums[2]) > kOneSided * sums[0] || sums[7] + sums[13] < kFilled * sums[0])
    jet.fault = JetFault::kBorder;
  if (!solved || !(std::hypot(s.x[1], s.x[2]) < kSteepest)) {
    if (jet.fault == JetFault::kNone) jet.fault = solved ? JetFault::kNotASheet : JetFault::kTooFew;
    return jet;
  }
  to_tensor(s, p, axes, radius, jet);
  return jet;
}

double JetFitter::agreement(const Vec3& p, const Vec3& normal, double radius) const {
  const SkinCells& cells = pyramid_.levels[0];
  double sum = 0, against = 0, count = 0;
  cells.each_run(p, radius, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < std::min(end, begin + kMost); ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Vec3 d(cells.x[at] - p[0], cells.y[at] - p[1], cells.z[at] - p[2]);
      // A thin body has a far side too: only points in the same sheet count.
      if (d.squaredNorm() > radius * radius || std::abs(d.dot(normal)) > kSheet * radius) continue;
      const double c = normal[0] * cells.nx[at] + normal[1] * cells.ny[at] + normal[2] * cells.nz[at];
      sum += c;
      against += std::max(0.0, -c);
      count += 1;
    }
  });
  return against > kAgainst * count ? sum / count : 1;
}

}  // namespace sgrt
