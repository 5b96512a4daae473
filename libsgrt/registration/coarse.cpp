// Exhaustive starts, beam, refinement, verdict. docs/theory/coarse.md.
#include "registration/coarse.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.hpp"
#include "core/parallel.hpp"
#include "registration/pass.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kPlaces = 48;  // of the reference
constexpr std::size_t kHandles = 3;  // live points that are laid on them
constexpr int kSpins = 16;
constexpr double kHandleRadius = 30;  // mm: skin about a handle that gives its normal
constexpr double kScanCell = 12;      // mm, of the level at least on which starts are scanned
constexpr std::int64_t kScanPoints = 96, kBeamPoints = 400, kLastPoints = 2000;
constexpr std::size_t kBeam = 80, kLast = 16;
constexpr double kMinCos = 0.5;
constexpr double kLeastScore = 0.2;    // below it nothing fits
constexpr double kNearlyAsGood = 0.9;  // of the best score
constexpr double kApart = 12;          // mm rms: farther from each other two poses are different answers

struct Candidate {
  Pose pose;
  double score;
};

bool better(const Candidate& a, const Candidate& b) {
  return a.score > b.score;
}

// How far two poses lay the live points from each other, mm rms.
double apart(const LivePoints& live, const Pose& a, const Pose& b) {
  const Pose d = b.inverse() * a;
  const double turn = (d.R - Mat3::Identity()).norm() / std::sqrt(2.0) * live.lever * std::sqrt(2.0 / 3);
  const double shift = (d * live.centre - live.centre).norm();
  return std::hypot(turn, shift);
}

// Well spread members of x, beginning with the one nearest the middle (Gonzalez 1985).
std::vector<std::size_t> spread_out(const std::vector<Vec3>& x, const Vec3& middle, std::size_t count) {
  std::vector<std::size_t> chosen;
  std::vector<double> nearest(x.size(), 1e300);
  std::size_t next = 0;
  for (std::size_t i = 1; i < x.size(); ++i) {
    if ((x[i] - middle).squaredNorm() < (x[next] - middle).squaredNorm()) next = i;
  }
  while (chosen.size() < std::min(count, x.size())) {
    chosen.push_back(next);
    for (std::size_t i = 0; i < x.size(); ++i) {
      nearest[i] = std::min(nearest[i], (x[i] - x[chosen.back()]).squaredNorm());
      if (nearest[i] > nearest[next] || nearest[next] == 0) next = i;
    }
  }
  return chosen;
}

struct Place {
  Vec3 x, n;
};

std::vector<Place> places_of(const SurfelField& field) {
  std::size_t level = field.levels.size() - 1;
  while (level > 0 && field.levels[level].count < static_cast<int>(kPlaces)) --level;
  std::vector<Vec3> x;
  std::vector<Place> all, out;
  for (const kernels::Surfel& s : field.levels[level].surfels) {
    if (!(s.counts > 0)) continue;
    x.push_back(point_of(s));
    all.push_back({point_of(s) + field.centre, normal_of(s)});
  }
  for (const std::size_t i : spread_out(x, Vec3::Zero(), kPlaces)) out.push_back(all[i]);
  return out;
}

// Live points well inside the surface with the normal of the skin about them.
std::vector<Place> handles_of(const LivePoints& live) {
  LivePoints some;
  draw_subset(live, kLastPoints, some);
  std::vector<Vec3> x;
  const auto n = static_cast<std::size_t>(some.count);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p(some.x[i], some.y[i], some.z[i]);
    if (p.norm() < 1.1 * live.lever) x.push_back(p);
  }
  std::vector<Place> out;
  for (const std::size_t i : spread_out(x, Vec3::Zero(), kHandles)) {
    const double radius = std::min(kHandleRadius, 0.4 * live.lever);
    Mat3 scatter = Mat3::Zero();
    Vec3 mean = Vec3::Zero(), normal = Vec3::Zero();
    std::vector<std::size_t> near;
    for (std::size_t k = 0; k < n; ++k) {
      if ((Vec3(some.x[k], some.y[k], some.z[k]) - x[i]).norm() < radius) near.push_back(k);
    }
    if (near.size() < 5) continue;
    for (const std::size_t k : near) {
      mean += Vec3(some.x[k], some.y[k], some.z[k]) / static_cast<double>(near.size());
      if (!some.nx.empty()) normal += Vec3(some.nx[k], some.ny[k], some.nz[k]);
    }
    for (const std::size_t k : near) {
      const Vec3 d = Vec3(some.x[k], some.y[k], some.z[k]) - mean;
      scatter += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(scatter);
    Vec3 axis = eigen.eigenvectors().col(0);
    if (axis.dot(normal) < 0) axis = -axis;
    out.push_back({mean + live.centre, axis});
    if (some.nx.empty()) out.push_back({mean + live.centre, -axis});
  }
  return out;
}

Pose start_of(const Place& place, const Place& handle, double spin) {
  const Mat3 turn = Eigen::Quaterniond::FromTwoVectors(handle.n, place.n).toRotationMatrix();
  const Mat3 R = so3_exp(spin * place.n) * turn;
  return {R, place.x - R * handle.x};
}

class Scan {
 public:
  Scan(const Reference& reference, const LivePoints& points, int level, double width)
      : reference_(reference), points_(points), level_(level), width_(width) {
    r_.resize(points.x.size());
    w_.resize(points.x.size());
  }

  // Steps, then the score of the pose they lead to.
  Candidate climb(Pose pose, int steps) {
    const SurfelField& field = reference_.field;
    for (int i = 0; i <= steps; ++i) {
      PassOptions o;
      o.level = level_;
      o.levels = kernels::kMaxLevels;
      o.limit = 4 * width_;
      o.min_cos = kMinCos;
      o.signs_unsure = !reference_.has_normals;
      o.unit_noise = true;
      o.scale = width_ / 2.5;
      o.r = r_.data();
      o.w = w_.data();
      const Sums sums = do_pass(Run{}, field, points_, pose, o);
      if (i == steps || sums.pairs < 6) break;
      Vec6 step = step_of(sums, field.lever);
      const double moved = farthest(field, step);
      if (moved > 60) step *= 60 / moved;
      pose = motion_about(step, field.centre) * pose;
    }
    return {pose, score()};
  }

  double median() const {
    std::vector<float> r;
    for (std::size_t i = 0; i < static_cast<std::size_t>(points_.count); ++i) {
      if (w_[i] > 0) r.push_back(std::abs(r_[i]));
    }
    if (r.empty()) return 0;
    return static_cast<double>(sgrt::median(r));
  }

 private:
  double score() const {
    double sum = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(points_.count); ++i) {
      if (!(w_[i] > 0)) continue;
      const double u = static_cast<double>(r_[i]) / width_;
      sum += std::max(0.0, 1 - u * u);
    }
    return sum / static_cast<double>(points_.count);
  }

  const Reference& reference_;
  const LivePoints& points_;
  int level_;
  double width_;
  std::vector<float> r_, w_;
};

// The best so many that lie apart.
std::vector<Candidate> distinct(std::vector<Candidate> all, const LivePoints& live, std::size_t count, double gap) {
  std::stable_sort(all.begin(), all.end(), better);
  std::vector<Candidate> out;
  for (const Candidate& c : all) {
    if (out.size() == count) break;
    const bool fresh =
        std::none_of(out.begin(), out.end(), [&](const Candidate& o) { return apart(live, c.pose, o.pose) < gap; });
    if (fresh) out.push_back(c);
  }
  return out;
}

// Climbs from each pose on so many live points at a level.
std::vector<Candidate> climb_all(const Run& run, const Reference& reference, const LivePoints& points, int level,
                                 double width, int steps, const std::vector<Pose>& from) {
  std::vector<Candidate> out(from.size());
  parallel_for(
      run, static_cast<std::int64_t>(from.size()), 16,
      [&](std::int64_t begin, std::int64_t end) {
        Scan scan(reference, points, level, width);
        for (std::int64_t i = begin; i < end; ++i) {
          out[static_cast<std::size_t>(i)] = scan.climb(from[static_cast<std::size_t>(i)], steps);
        }
      },
      "coarse registration");
  return out;
}

std::vector<Pose> poses_of(const std::vector<Candidate>& candidates) {
  std::vector<Pose> out;
  out.reserve(candidates.size());
  for (const Candidate& c : candidates) out.push_back(c.pose);
  return out;
}

std::vector<Pose> all_starts(const Reference& reference, const LivePoints& live) {
  std::vector<Pose> out;
  for (const Place& handle : handles_of(live)) {
    for (const Place& place : places_of(reference.field)) {
      for (int k = 0; k < kSpins; ++k) out.push_back(start_of(place, handle, 2 * kPi * k / kSpins));
    }
  }
  return out;
}

std::string text_of_score(double score) {
  return text_of(std::round(1000 * score) / 1000);
}

}  // namespace

CoarseResult find_anywhere(const Run& run, const Reference& reference, const LivePoints& live) {
  CoarseResult out;
  const SurfelField& field = reference.field;
  int level = 0;
  while (level + 1 < static_cast<int>(field.levels.size()) && field.cell * std::exp2(level) < kScanCell) ++level;
  LivePoints few, some, many;
  draw_subset(live, kScanPoints, few);
  draw_subset(live, kBeamPoints, some);
  draw_subset(live, kLastPoints, many);
  std::vector<Candidate> beam = climb_all(run, reference, few, level, 12, 3, all_starts(reference, live));
  beam = distinct(std::move(beam), live, kBeam, 15);
  beam = climb_all(run, reference, some, level, 8, 8, poses_of(beam));
  beam = distinct(std::move(beam), live, kBeam / 2, kApart);
  beam = climb_all(run, reference, some, 0, 4, 8, poses_of(beam));
  beam = distinct(std::move(beam), live, kLast, kApart);
  beam = climb_all(run, reference, many, 0, 3, 5, poses_of(beam));
  beam = distinct(std::move(beam), live, kLast, kApart);
  if (beam.empty() || beam[0].score < kLeastScore) {
    out.status = Status::kNotFound;
    out.message = "no pose lays the live surface on the reference: the best scores " +
                  text_of_score(beam.empty() ? 0 : beam[0].score) + ", at least " + text_of_score(kLeastScore) +
                  " is needed";
    return out;
  }
  // As strict as the best allows: what noise and change of shape leave of it.
  Scan best(reference, many, 0, 3);
  best.climb(beam[0].pose, 0);
  const double width = std::clamp(5 * best.median(), 0.5, 5.0);
  beam = distinct(climb_all(run, reference, many, 0, width, 3, poses_of(beam)), live, kLast, kApart);
  out.pose = beam[0].pose;
  out.score = beam[0].score;
  out.runner_up = beam.size() > 1 ? beam[1].pose : beam[0].pose;
  out.runner_up_score = beam.size() > 1 ? beam[1].score : 0;
  if (out.runner_up_score > kNearlyAsGood * out.score) {
    out.status = Status::kDegenerate;
    out.message = "two poses fit nearly as well (scores " + text_of_score(out.score) + " and " +
                  text_of_score(out.runner_up_score) + ", " +
                  std::to_string(std::lround(apart(live, out.pose, out.runner_up))) + " mm apart)";
  }
  return out;
}

}  // namespace sgrt
