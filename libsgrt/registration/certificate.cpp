// Observability and covariance. docs/theory/icp.md eq. 10-16.
#include "registration/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/predict.hpp"
#include "registration/words.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kSlopeFloor = 1e-3;  // rad: less relief than this is none, however little the noise
constexpr int kMacro = 2;  // levels up: cells wider than a surfel's fit, so that the reference's noise is theirs alone
constexpr double kDetect = 1.959964 + 1.644854;  // sigmas found 95 times in 100 at a false alarm in 20

Vec6 row_of(const Vec3& x, const Vec3& n) {
  Vec6 j;
  j << x.cross(n), n;
  return j;
}

// What the reference's own noise does, cell by cell of a coarse level (eq. 11-12).
struct ReferencePart {
  Mat6 score = Mat6::Zero();       // of its height noise, for the covariance
  Mat6 false_part = Mat6::Zero();  // the information that noise in its normals makes up
};

void clear_weights(const SurfelField& field, Workspace& work) {
  work.weights.resize(field.levels.size());
  for (std::size_t k = 0; k < work.weights.size(); ++k) work.weights[k].assign(field.levels[k].surfels.size(), 0);
}

// Weights of the pairs on each surfel.
void fill_weights(const SurfelField& field, Workspace& work) {
  clear_weights(field, work);
  const LivePoints& live = work.live;
  for (std::size_t i = 0; i < static_cast<std::size_t>(live.count); ++i) {
    if (!(work.w[i] > 0) || work.surfel[i] < 0) continue;
    const double v = (live.v.empty() ? live.v_all : live.v[i]) + surfel_of(field, work.surfel[i]).variance;
    work.weights[static_cast<std::size_t>(level_of(work.surfel[i]))][index_of(work.surfel[i])] += work.w[i] / v;
  }
}

ReferencePart reference_part(const Reference& reference, Workspace& work) {
  const SurfelField& field = reference.field;
  const auto top = std::min<std::size_t>(kMacro, field.levels.size() - 1);
  const SurfelLevel& macro = field.levels[top];
  work.macro_sum.assign(macro.surfels.size(), Vec6::Zero());
  work.macro_weight.assign(macro.surfels.size(), 0);
  for (std::size_t level = 0; level <= top; ++level) {
    for (std::size_t i = 1; i < work.weights[level].size(); ++i) {
      const double w = work.weights[level][i];
      if (!(w > 0)) continue;
      std::size_t m = i;
      for (std::size_t k = level; k < top; ++k) m = static_cast<std::size_t>(field.levels[k].parent[m]);
      const kernels::Surfel& s = field.levels[level].surfels[i];
      work.macro_sum[m] += w * row_of(point_of(s), normal_of(s));
      work.macro_weight[m] += w;
    }
  }
  ReferencePart out;
  for (std::size_t m = 1; m < work.macro_weight.size(); ++m) {
    if (!(work.macro_weight[m] > 0)) continue;
    const kernels::Surfel& s = macro.surfels[m];
    const double variance = macro.noise[m] * reference.correlation_points;
    const Vec6& G = work.macro_sum[m];
    out.score += variance / std::max(1.0F, macro.samples[m]) * G * G.transpose();
    const double slope = macro.slope_variance[m] * std::max<double>(variance, field.roughness2);
    const Vec3 n = normal_of(s);
    Eigen::Matrix<double, 6, 3> D;  // dJ / dn
    D << skew(point_of(s)), Mat3::Identity();
    out.false_part += work.macro_weight[m] * slope * D * (Mat3::Identity() - n * n.transpose()) * D.transpose();
  }
  return out;
}

// The motions, scaled and at the isocentre, whose information does not exceed what noise makes up (eq. 13).
Motions free_motions(const Sums& s, const Mat6& false_part, double lever, const Mat6& iso_from_centre) {
  Vec6 unit;
  unit << Vec3::Constant(1 / lever), Vec3::Ones();
  const auto U = unit.asDiagonal();
  Mat6 total = U * s.A * U;
  const Mat6 shape = total - U * false_part * U;
  const double sum = total.diagonal().tail<3>().sum();  // of the weights: normals are unit
  total.diagonal().array() += kSlopeFloor * kSlopeFloor * sum;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Mat6> eigen(shape, total);
  // The noise that a direction saw may exceed its expectation by about 6 / sqrt(count) of it: 3 sigma.
  const double margin = 18 / std::sqrt(std::max(1.0, s.pairs));
  const double threshold = (1 + margin) / (2 + margin);
  Motions free(6, 0);
  for (int i = 0; i < 6; ++i) {
    if (eigen.eigenvalues()[i] > threshold) continue;
    free.conservativeResize(6, free.cols() + 1);
    free.col(free.cols() - 1) = scaled(iso_from_centre * (U * eigen.eigenvectors().col(i)).eval()).normalized();
  }
  return free;
}

// The mode of the reference that has this name and is not yet taken; -1: none.
int namesake(const Reference& reference, const std::string& name, unsigned taken) {
  for (std::size_t j = 0; j < reference.mode_names.size(); ++j) {
    if ((taken >> j & 1) == 0 && !name.empty() && name == reference.mode_names[j]) return static_cast<int>(j);
  }
  return -1;
}

// The pose error that one draw of a cause makes, as an outer product: of a mode of the live surface, of one of the
// reference, or of both where one draw moves both (eq. 15).
Mat6 of_cause(const Reference& reference, const Surface& live, const Points* live_mode, int reference_mode,
              const Pose& T, const Mat6& inverse, const Workspace& work) {
  const SurfelField& field = reference.field;
  Vec6 g = Vec6::Zero();
  for (std::size_t i = 0; i < static_cast<std::size_t>(work.live.count); ++i) {
    const std::int32_t code = work.surfel[i];
    if (!(work.w[i] > 0) || code < 0) continue;
    const kernels::Surfel& s = surfel_of(field, code);
    Vec3 u = Vec3::Zero();
    if (live_mode != nullptr) u += T.R * live_mode->row(work.live.row[i]).transpose();
    if (reference_mode >= 0) {
      const auto& mode = reference.modes[static_cast<std::size_t>(reference_mode)];
      const float* of = &mode[static_cast<std::size_t>(level_of(code))][3 * index_of(code)];
      u -= Vec3(of[0], of[1], of[2]);
    }
    if (!u.allFinite()) continue;
    const Vec3 y = T * live.point(work.live.row[i]) - field.centre, n = normal_of(s);
    const double v = (work.live.v.empty() ? work.live.v_all : work.live.v[i]) + s.variance;
    g += work.w[i] / v * n.dot(u) * row_of(y, n);
  }
  const Vec6 error = inverse * g;
  return error * error.transpose();
}

Mat6 mode_covariance(const Reference& reference, const Surface& live, const Pose& T, const Mat6& inverse,
                     const Workspace& work) {
  Mat6 sum = Mat6::Zero();
  unsigned taken = 0;
  static_assert(kMaxModes <= 32);
  for (std::size_t k = 0; k < live.modes.size(); ++k) {
    const int j = k < live.mode_names.size() ? namesake(reference, live.mode_names[k], taken) : -1;
    if (j >= 0) taken |= 1U << j;
    sum += of_cause(reference, live, &live.modes[k], j, T, inverse, work);
  }
  for (std::size_t j = 0; j < reference.modes.size(); ++j) {
    if ((taken >> j & 1) == 0) sum += of_cause(reference, live, nullptr, static_cast<int>(j), T, inverse, work);
  }
  return sum;
}

Mat6 symmetric(const Mat6& m) {
  return 0.5 * (m + m.transpose());
}

// The covariance's principal directions with turns at kTurnLever, the least certain first.
void fill_directions(const Mat6& covariance, std::array<Direction, 6>& out) {
  Vec6 unit;
  unit << Vec3::Constant(kTurnLever), Vec3::Ones();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(Mat6(unit.asDiagonal() * covariance * unit.asDiagonal()));
  for (int i = 0; i < 6; ++i) {
    Vec6 motion = eigen.eigenvectors().col(5 - i);
    int largest;
    motion.cwiseAbs().maxCoeff(&largest);
    if (motion[largest] < 0) motion = -motion;
    motion.head<3>() /= kTurnLever;
    Direction& d = out[static_cast<std::size_t>(i)];
    d.motion = motion;
    d.sigma = std::sqrt(std::max(eigen.eigenvalues()[5 - i], 0.0));
    d.detectable = kDetect * d.sigma;
  }
}

Motions too_loose(const Mat6& covariance, double degenerate_sigma) {
  Vec6 unit;
  unit << Vec3::Constant(kTurnLever), Vec3::Ones();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(Mat6(unit.asDiagonal() * covariance * unit.asDiagonal()));
  Motions loose(6, 0);
  for (int i = 0; i < 6; ++i) {
    if (std::sqrt(std::max(eigen.eigenvalues()[i], 0.0)) <= degenerate_sigma) continue;
    loose.conservativeResize(6, loose.cols() + 1);
    loose.col(loose.cols() - 1) = eigen.eigenvectors().col(i);
  }
  return loose;
}

// Names the free motions; false where there are any.
bool determined(const Reference& reference, const Sums& sums, const Mat6& false_part, const Vec3& isocentre,
                Certificate& c) {
  c.covariance.setConstant(kNan);
  c.random = c.shared = c.covariance;
  const Mat6 iso_from_centre = adjoint(Pose{Mat3::Identity(), reference.field.centre - isocentre});
  c.free = name_motions(free_motions(sums, false_part, reference.field.lever, iso_from_centre), isocentre);
  return c.free.empty();
}

// Carries the covariances from the centre to the isocentre; a motion that is too uncertain there is free, too.
void finish(const Reference& reference, const Mat6& random, const Mat6& shared, const Vec3& isocentre,
            double degenerate_sigma, Certificate& c) {
  const Mat6 iso_from_centre = adjoint(Pose{Mat3::Identity(), reference.field.centre - isocentre});
  const auto at_isocentre = [&](const Mat6& m) { return symmetric(iso_from_centre * m * iso_from_centre.transpose()); };
  const Mat6 covariance = at_isocentre(random) + at_isocentre(shared);
  c.free = name_motions(too_loose(covariance, degenerate_sigma), isocentre);
  if (!c.free.empty()) return;
  c.covariance = covariance;
  c.random = at_isocentre(random);
  c.shared = at_isocentre(shared);
  fill_directions(covariance, c.directions);
}

}  // namespace

Certificate certify(const Run& run, const Reference& reference, const Surface& live, const Pose& T, const Sums& sums,
                    const Vec3& isocentre, const IcpOptions& options, double limit, Workspace& work) {
  const SurfelField& field = reference.field;
  work.r.resize(work.live.x.size());
  work.surfel.resize(work.live.x.size());
  PassOptions o = finest(reference, options, limit);
  o.levels = static_cast<int>(field.levels.size());
  o.given = work.w.data();
  o.score = true;
  o.r = work.r.data();
  o.surfel = work.surfel.data();
  const Sums score = do_pass(run, field, work.live, T, o);

  Certificate c;
  c.chi2 = sums.chi / sums.weight * sums.pairs / std::max(1.0, sums.pairs - 6);
  fill_weights(field, work);
  const ReferencePart part = reference_part(reference, work);
  if (!determined(reference, sums, part.false_part, isocentre, c)) return c;
  const Mat6 inverse = Mat6(sums.A - part.false_part).ldlt().solve(Mat6::Identity());
  const double misfit = std::max(1.0, c.chi2);
  finish(reference, live.correlation_points * misfit * inverse * score.A * inverse,
         misfit * inverse * part.score * inverse + mode_covariance(reference, live, T, inverse, work), isocentre,
         options.degenerate_sigma, c);
  return c;
}

Outlook outlook_of(const Reference& reference, const std::uint8_t* marked, double live_sigma, Workspace& work) {
  const SurfelField& field = reference.field;
  const SurfelLevel& level = field.levels[0];
  clear_weights(field, work);
  Outlook out;
  const double v_live = live_sigma * live_sigma;
  for (std::size_t i = 1; i < level.surfels.size(); ++i) {
    const kernels::Surfel& s = level.surfels[i];
    if (marked != nullptr ? marked[i] == 0 : !(s.counts > 0)) continue;
    const Vec6 j = row_of(point_of(s), normal_of(s));
    const double n = level.samples[i], v = v_live + s.variance;
    work.weights[0][i] = n / v;
    const Mat6 jj = j * j.transpose();
    out.sums.A += n / v * jj;
    out.live_score += n * v_live / (v * v) * jj;
    out.sums.pairs += n;
  }
  const ReferencePart part = reference_part(reference, work);
  out.reference_score = part.score;
  out.false_part = part.false_part;
  return out;
}

Certificate predict(const Reference& reference, const Outlook& o, const Vec3& isocentre, double degenerate_sigma) {
  Certificate c;
  c.chi2 = 1;
  if (!determined(reference, o.sums, o.false_part, isocentre, c)) return c;
  const Mat6 inverse = Mat6(o.sums.A - o.false_part).ldlt().solve(Mat6::Identity());
  finish(reference, inverse * o.live_score * inverse, inverse * o.reference_score * inverse, isocentre,
         degenerate_sigma, c);
  return c;
}

}  // namespace sgrt
