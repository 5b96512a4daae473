// Pairs and triples of candidates laid on the model's, and their poses refined. docs/theory/landmarks.md eq. 6.
#include "shape/constellation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.hpp"
#include "shape/match_score.hpp"

namespace sgrt {
namespace {

constexpr std::size_t kAnchors = 8;   // points of the model that triples are made of
constexpr double kLeastSide = 10;     // mm, of a triple
constexpr double kNormalArm = 12;     // mm: how much a normal weighs against a place
constexpr std::size_t kKeep = 24;     // hypotheses of a pair or triple that go on
constexpr double kDifferent = 15;     // mm rms between two different answers
constexpr double kLeastCosine = 0.4;  // of normals with those of three candidates
constexpr double kLeastCosineOfTwo = 0.8;
constexpr double kLeastApart = 25;     // mm, of two points that tell a pose
constexpr std::size_t kRefined = 150;  // poses of all hypotheses of a pair or triple that go on
constexpr double kSame = 5;            // mm rms between two of them

struct Pair {
  Vec3 model, live, model_normal, live_normal;
  double weight;
};

// Least squares over places and normals; size within 1 +- range (Umeyama 1991).
void similarity(const std::vector<Pair>& pairs, double range, Pose* pose, double* size) {
  double sum = 0;
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  for (const Pair& p : pairs) a += p.weight * p.model, b += p.weight * p.live, sum += p.weight;
  a /= sum, b /= sum;
  Mat3 cross = Mat3::Zero();
  double spread_a = 0, spread_b = 0;
  for (const Pair& p : pairs) {
    const Vec3 da = p.model - a, db = p.live - b;
    cross += p.weight * (db * da.transpose() + kNormalArm * kNormalArm * p.live_normal * p.model_normal.transpose());
    spread_a += p.weight * da.squaredNorm(), spread_b += p.weight * db.squaredNorm();
  }
  *size = range > 0 && spread_a > 0 ? std::clamp(std::sqrt(spread_b / spread_a), 1 - range, 1 + range) : 1;
  const Eigen::JacobiSVD<Mat3> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double flip = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  pose->R = svd.matrixU() * Vec3(1, 1, flip).asDiagonal() * svd.matrixV().transpose();
  pose->t = b - *size * (pose->R * a);
}

class Search {
 public:
  Search(const LandmarkScene& scene, const LandmarkModel& model) : scene_(scene), model_(model), score_(scene, model) {}

  // Pairs and triples of the model's points that tell a pose.
  std::vector<std::vector<std::size_t>> sets() const {
    std::vector<std::vector<std::size_t>> out;
    for (const auto& t : triples()) out.push_back({t[0], t[1], t[2]});
    for (std::size_t i = 0; i < model_.points.size(); ++i) {
      for (std::size_t j = i + 1; j < model_.points.size(); ++j)
        if (distance(i, j) > kLeastApart) out.push_back({i, j});
    }
    return out;
  }

  // The best poses at which candidates lie on the points of a set.
  std::vector<Match> hypotheses(const std::vector<std::size_t>& set) const {
    auto out = set.size() == 2 ? on_two(set[0], set[1]) : on_three({set[0], set[1], set[2]});
    std::stable_sort(out.begin(), out.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
    if (out.size() > kKeep) out.resize(kKeep);
    return out;
  }

  void refine(Match& m) const {
    for (int round = 0; round < 4; ++round) {
      std::vector<Pair> pairs;
      for (std::size_t i = 0; i < model_.points.size(); ++i) {
        if (m.candidate[i] < 0 || !(m.value[i] > 0.02)) continue;
        const double s = score_.tolerance(i);
        pairs.push_back(pair(i, static_cast<std::size_t>(m.candidate[i]), m.value[i] / (s * s)));
      }
      if (pairs.size() < 3) {
        if (round == 0) score_(m, true);
        break;
      }
      Match next;
      similarity(pairs, model_.size_range, &next.pose, &next.size);
      score_(next, true);
      if (next.score < m.score - 1e-12 && round > 0) break;
      m = std::move(next);
    }
  }

  double apart(const Match& a, const Match& b) const {
    double sum = 0;
    for (const LandmarkPoint& p : model_.points) sum += (a.place(p.position) - b.place(p.position)).squaredNorm();
    return std::sqrt(sum / static_cast<double>(model_.points.size()));
  }

 private:
  std::vector<std::array<std::size_t, 3>> triples() const {
    std::vector<std::size_t> order(model_.points.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return score_.curved(a) > score_.curved(b); });
    order.resize(std::min(kAnchors, order.size()));
    std::vector<std::array<std::size_t, 3>> out;
    for (std::size_t i = 0; i < order.size(); ++i) {
      for (std::size_t j = i + 1; j < order.size(); ++j) {
        for (std::size_t k = j + 1; k < order.size(); ++k) {
          const std::array<std::size_t, 3> t = {order[i], order[j], order[k]};
          if (distance(t[0], t[1]) > kLeastSide && distance(t[1], t[2]) > kLeastSide &&
              distance(t[0], t[2]) > kLeastSide)
            out.push_back(t);
        }
      }
    }
    return out;
  }

  // Every way to lay candidates on two of the model's points, whose normals tell the rest.
  std::vector<Match> on_two(std::size_t i, std::size_t j) const {
    std::vector<Match> out;
    const std::size_t n = scene_.candidates.size();
    for (std::size_t a = 0; a < n; ++a) {
      if (!score_.alike(i, a)) continue;
      for (std::size_t b = 0; b < n; ++b) {
        if (b == a || !score_.alike(j, b) || !apart_alike(i, j, a, b)) continue;
        lay({pair(i, a, 1), pair(j, b, 1)}, kLeastCosineOfTwo, out);
      }
    }
    return out;
  }

  // Every way to lay candidates on a triple.
  std::vector<Match> on_three(const std::array<std::size_t, 3>& t) const {
    std::vector<Match> out;
    const std::size_t n = scene_.candidates.size();
    for (std::size_t a = 0; a < n; ++a) {
      if (!score_.alike(t[0], a)) continue;
      for (std::size_t b = 0; b < n; ++b) {
        if (b == a || !score_.alike(t[1], b) || !apart_alike(t[0], t[1], a, b)) continue;
        for (std::size_t c = 0; c < n; ++c) {
          if (c == a || c == b || !score_.alike(t[2], c) || !apart_alike(t[0], t[2], a, c) ||
              !apart_alike(t[1], t[2], b, c))
            continue;
          lay({pair(t[0], a, 1), pair(t[1], b, 1), pair(t[2], c, 1)}, kLeastCosine, out);
        }
      }
    }
    return out;
  }

  // The pose by these pairs joins the others, if it turns every normal to where the skin looks.
  void lay(const std::vector<Pair>& pairs, double least_cosine, std::vector<Match>& out) const {
    Match m;
    similarity(pairs, model_.size_range, &m.pose, &m.size);
    for (const Pair& p : pairs)
      if (!((m.pose.R * p.model_normal).dot(p.live_normal) > least_cosine)) return;
    score_(m, false);
    out.push_back(std::move(m));
  }

  double distance(std::size_t i, std::size_t j) const {
    return (model_.points[i].position - model_.points[j].position).norm();
  }
  bool apart_alike(std::size_t i, std::size_t j, std::size_t a, std::size_t b) const {
    const double d = distance(i, j), live = (scene_.candidates[a].x - scene_.candidates[b].x).norm();
    const double slack = 1.2 * (score_.tolerance(i) + score_.tolerance(j));
    if (live < d * (1 - model_.size_range) - slack || live > d * (1 + model_.size_range) + slack) return false;
    const double cosine = model_.points[i].normal.dot(model_.points[j].normal);
    return std::abs(scene_.candidates[a].n.dot(scene_.candidates[b].n) - cosine) < 0.6;
  }
  Pair pair(std::size_t i, std::size_t c, double weight) const {
    const LandmarkPoint& p = model_.points[i];
    return {p.position, scene_.candidates[c].x, p.normal, scene_.candidates[c].n, weight};
  }

  const LandmarkScene& scene_;
  const LandmarkModel& model_;
  Scorer score_;
};

}  // namespace

std::vector<Match> best_matches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model) {
  const Search search(scene, model);
  const auto sets = search.sets();
  std::vector<std::vector<Match>> found(sets.size());
  parallel_for(
      run, static_cast<std::int64_t>(sets.size()), 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i)
          found[static_cast<std::size_t>(i)] = search.hypotheses(sets[static_cast<std::size_t>(i)]);
      },
      "landmarks: poses");
  std::vector<Match> all;
  for (auto& list : found)
    all.insert(all.end(), std::make_move_iterator(list.begin()), std::make_move_iterator(list.end()));
  std::stable_sort(all.begin(), all.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
  std::vector<Match> kept;
  for (Match& m : all) {
    if (kept.size() == kRefined) break;
    if (std::none_of(kept.begin(), kept.end(), [&](const Match& k) { return search.apart(k, m) < kSame; }))
      kept.push_back(std::move(m));
  }
  parallel_for(
      run, static_cast<std::int64_t>(kept.size()), 4,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) search.refine(kept[static_cast<std::size_t>(i)]);
      },
      "landmarks: poses");
  std::stable_sort(kept.begin(), kept.end(), [](const Match& a, const Match& b) { return a.evidence > b.evidence; });
  std::vector<Match> out;
  for (Match& m : kept) {
    if (std::none_of(out.begin(), out.end(), [&](const Match& k) { return search.apart(k, m) < kDifferent; }))
      out.push_back(std::move(m));
  }
  return out;
}

}  // namespace sgrt
