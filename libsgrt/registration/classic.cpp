// Closest points, weights, step. docs/theory/icp.md section 3.
#include "registration/classic.hpp"

#include <algorithm>
#include <cmath>

#include "registration/noise.hpp"

namespace sgrt {
namespace {

constexpr double kMostGain = 20;  // of an extrapolated step
constexpr double kRest = 0.1;     // of the steps' ratio: steadier than that the ratio tells where they lead

Vec3 point_at(const std::vector<float>& x, const std::vector<float>& y, const std::vector<float>& z, std::size_t i) {
  return {static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])};
}

class Classic {
 public:
  Classic(const Run& run, const Reference& reference, const IcpOptions& options, Workspace& work, Search& s)
      : run_(run), reference_(reference), field_(reference.field), options_(options), work_(work), s_(s) {
    const std::size_t n = work.live.x.size();
    work.r.resize(n);
    work.w.resize(n);
    work.surfel.resize(n);
  }

  void measure_noise(const Surface& live) { fill_live_noise(run_, reference_, live, s_.pose, pass_options(), work_); }

  void iterate() {
    GraduatedScale scale;
    Vec6 last = Vec6::Zero();
    double last_ratio = 0;
    while (s_.iterations < options_.max_iterations) {
      find_pairs();
      ++s_.iterations;
      if (static_cast<int>(pairs_.size()) < kMinPairs) return;
      weigh(scale);
      if (counted_ < kMinPairs) return;
      const Vec6 step = step_of(options_.residual, pairs_, field_.lever);
      const double moved = farthest(field_, step);
      const bool rest = moved < options_.step_tolerance && scale.settled();
      // Steps to closest points shrink by a constant ratio: go where they lead (Aitken's extrapolation; Besl and McKay
      // accelerate likewise).
      const double ratio = last.isZero() ? 0 : step.norm() / last.norm();
      const bool steady = scale.settled() && ratio < 1 && std::abs(ratio - last_ratio) < kRest * (1 - ratio) &&
                          step.dot(last) > 0.9 * step.norm() * last.norm();
      const double gain = steady ? std::min(kMostGain, 1 / (1 - ratio)) : 1;
      s_.pose = motion_about(gain * step, field_.centre) * s_.pose;
      last = steady ? Vec6::Zero().eval() : step;
      last_ratio = steady ? 0 : ratio;
      if (rest) {
        s_.converged = true;
        return;
      }
    }
  }

  // The sums of the last weights at the last pose, for the certificate.
  void sum() {
    PassOptions o = pass_options();
    o.given = work_.w.data();
    s_.sums = do_pass(run_, field_, work_.live, s_.pose, o);
  }

 private:
  PassOptions pass_options() const {
    PassOptions o = finest(reference_, options_, s_.limit);
    o.levels = static_cast<int>(field_.levels.size());
    return o;
  }

  void find_pairs() {
    PassOptions o = pass_options();
    o.unit_noise = true;
    o.r = work_.r.data();
    o.w = work_.w.data();
    o.surfel = work_.surfel.data();
    s_.sums = do_pass(run_, field_, work_.live, s_.pose, o);
    pairs_.clear();
    at_.clear();
    const LivePoints& live = work_.live;
    for (std::size_t i = 0; i < static_cast<std::size_t>(live.count); ++i) {
      if (!(work_.w[i] > 0)) continue;
      const kernels::Surfel& surfel = surfel_of(field_, work_.surfel[i]);
      ClosestPair c;
      c.y = s_.pose * (point_at(live.x, live.y, live.z, i) + live.centre) - field_.centre;
      Mat3 K;
      K << surfel.k[0], surfel.k[1], surfel.k[2], surfel.k[1], surfel.k[3], surfel.k[4], surfel.k[2], surfel.k[4],
          surfel.k[5];
      c.n = (normal_of(surfel) - K * (c.y - point_of(surfel))).normalized();
      if (!live.nx.empty()) c.m = s_.pose.R * point_at(live.nx, live.ny, live.nz, i);
      c.r = static_cast<double>(work_.r[i]);
      c.q = c.y - c.r * c.n;
      c.w = 1;
      pairs_.push_back(c);
      at_.push_back(i);
    }
  }

  // By kernel, scale and trimming; 1 over the noise, as in the fast search.
  void weigh(GraduatedScale& scale) {
    const LivePoints& live = work_.live;
    std::vector<float>& u = work_.values;
    u.resize(pairs_.size());
    for (std::size_t k = 0; k < u.size(); ++k) {
      const kernels::Surfel& surfel = surfel_of(field_, work_.surfel[at_[k]]);
      const float v = live.v.empty() ? live.v_all : live.v[at_[k]];
      u[k] = static_cast<float>(std::abs(pairs_[k].r)) / std::sqrt(v + surfel.height);
    }
    s_.scale = scale.next(std::max(1.0, 1.4826 * median_of(u, work_.scratch)));
    const float limit = trim_limit(u, options_.keep_share, work_.scratch);
    std::fill(work_.w.begin(), work_.w.end(), 0.0F);
    counted_ = 0;
    for (std::size_t k = 0; k < u.size(); ++k) {
      const double w = u[k] <= limit ? weight_of(options_.kernel, static_cast<double>(u[k]) / s_.scale) : 0;
      const float v = live.v.empty() ? live.v_all : live.v[at_[k]];
      work_.w[at_[k]] = static_cast<float>(w);
      pairs_[k].w = w / static_cast<double>(v + surfel_of(field_, work_.surfel[at_[k]]).variance);
      counted_ += w > 0 ? 1 : 0;
    }
  }

  const Run& run_;
  const Reference& reference_;
  const SurfelField& field_;
  const IcpOptions& options_;
  Workspace& work_;
  Search& s_;
  std::vector<ClosestPair> pairs_;
  std::vector<std::size_t> at_;  // the live point of each
  int counted_ = 0;
};

}  // namespace

bool is_classic(const IcpOptions& o) {
  return o.residual != Residual::kPlane || o.kernel != Kernel::kAuto || o.keep_share < 1;
}

Search classic_search(const Run& run, const Reference& reference, const Surface& live, const Pose& initial,
                      const IcpOptions& options, Workspace& work) {
  require(options.residual != Residual::kSymmetric || live.has_normals(),
          "residual: symmetric, expected a live surface with normals");
  Search s{initial, 0, false, options.max_distance, 1, {}};
  IcpOptions o = options;
  if (o.kernel == Kernel::kAuto) o.kernel = Kernel::kTukey;
  Classic classic(run, reference, o, work, s);
  // Noise that the surface does not tell is measured first where the search begins, then where it ended.
  const int phases = live.sigma.size() > 0 && live.covariance.rows() == 0 ? 1 : 2;
  for (int phase = 0; phase < phases; ++phase) {
    s.converged = false;
    classic.measure_noise(live);
    classic.iterate();
    if (!s.converged) break;
  }
  if (s.sums.pairs >= kMinPairs) classic.sum();
  return s;
}

}  // namespace sgrt
