// Triples, poses, scores. docs/theory/landmarks.md eq. 6-8.
#include "shape/constellation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr std::size_t kAnchors = 8;  // points of the model that triples are made of
constexpr double kLeastSide = 10;    // mm, of a triple
constexpr double kNormalArm = 12;    // mm: how much a normal weighs against a place
constexpr double kLikeness = 0.7;    // sigma of the logarithm of a curvedness
constexpr double kShape = 0.4;       // sigma of a shape index
constexpr double kAlone = 0.5;       // persistence over H, of a candidate that counts in full
constexpr double kFacing = 0.4;      // cosine with the mean normal, from which a place should be in view
constexpr double kMissing = 0.6;     // weight of a place that should be in view and is not
constexpr double kPlaceSlack = 1.2;  // of the tolerated distance over sigma, while the body is still a rigid copy
constexpr double kPeakSlack = 0.25;  // of the scale: how far noise may move an extremum
constexpr std::size_t kKeep = 24;    // hypotheses that are refined
constexpr double kDifferent = 15;    // mm rms between two different answers
constexpr double kLeastCosine = 0.4;
constexpr double kSkinAlone = 0.7;  // value of skin that is bent as it should be, without an extremum
constexpr double kPower = 0.75;
constexpr double kTilt = 0.4;  // sigma of one less the cosine between the skin's normal and the model's

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
  Search(const LandmarkScene& scene, const LandmarkModel& model) : scene_(scene), model_(model) {
    for (auto* v : {&curved_, &shape_}) v->reserve(model.points.size());
    sign_.reserve(model.points.size());
    for (auto* v : {&candidate_curved_, &candidate_shape_, &stands_out_}) v->reserve(scene.candidates.size());
    for (const LandmarkPoint& p : model.points) {
      sign_.push_back(sign_of(p));
      // A disc wider than the model's sees less of a form of radius 1 / C.
      const double C = curvedness(p.k1, p.k2);
      curved_.push_back(C * std::hypot(1, C * model.scale) / std::hypot(1, C * scene.scale));
      shape_.push_back(shape_index(p.k1, p.k2));
    }
    for (const Candidate& c : scene.candidates) {
      candidate_curved_.push_back(curvedness(c.k1, c.k2));
      candidate_shape_.push_back(shape_index(c.k1, c.k2));
      // A bump on a flank is less of a landmark than one that stands alone.
      stands_out_.push_back(std::sqrt(std::min(1.0, c.persistence / (kAlone * std::abs(c.mean)))));
    }
    facing_ = Vec3::Zero();
    for (std::int64_t i = 0; i < scene.surface->size(); ++i) {
      if (oriented(*scene.surface, i)) facing_ += scene.surface->normal(i);
    }
    facing_ /= std::max(1.0, static_cast<double>(scene.nearest.size()));
  }

  std::vector<std::array<std::size_t, 3>> triples() const {
    std::vector<std::size_t> order(model_.points.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return curved_[a] > curved_[b]; });
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

  // Every way to lay candidates on a triple.
  std::vector<Match> hypotheses(const std::array<std::size_t, 3>& t) const {
    std::vector<Match> out;
    const std::size_t n = scene_.candidates.size();
    for (std::size_t a = 0; a < n; ++a) {
      if (!alike(t[0], a)) continue;
      for (std::size_t b = 0; b < n; ++b) {
        if (b == a || !alike(t[1], b) || !apart_alike(t[0], t[1], a, b)) continue;
        for (std::size_t c = 0; c < n; ++c) {
          if (c == a || c == b || !alike(t[2], c) || !apart_alike(t[0], t[2], a, c) || !apart_alike(t[1], t[2], b, c))
            continue;
          const std::vector<Pair> pairs = {pair(t[0], a, 1), pair(t[1], b, 1), pair(t[2], c, 1)};
          Match m;
          similarity(pairs, model_.size_range, &m.pose, &m.size);
          bool upright = true;
          for (const Pair& p : pairs)
            upright = upright && (m.pose.R * p.model_normal).dot(p.live_normal) > kLeastCosine;
          if (!upright) continue;
          score(m, false);
          out.push_back(std::move(m));
        }
      }
    }
    return out;
  }

  void refine(Match& m) const {
    for (int round = 0; round < 4; ++round) {
      std::vector<Pair> pairs;
      for (std::size_t i = 0; i < model_.points.size(); ++i) {
        if (m.candidate[i] < 0 || !(m.value[i] > 0.02)) continue;
        const double s = tolerance(i);
        pairs.push_back(pair(i, static_cast<std::size_t>(m.candidate[i]), m.value[i] / (s * s)));
      }
      if (pairs.size() < 3) break;
      Match next;
      similarity(pairs, model_.size_range, &next.pose, &next.size);
      score(next, true);
      if (next.score < m.score - 1e-12 && round > 0) break;
      m = std::move(next);
    }
  }

  // seen: asks whether the skin is there, which takes longer.
  void score(Match& m, bool seen) const {
    const std::size_t n = model_.points.size();
    m.candidate.assign(n, -1);
    m.value.assign(n, 0);
    m.seen = m.matched = 0;
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 x = m.place(model_.points[i].position), normal = m.pose.R * model_.points[i].normal;
      const double s2 = tolerance(i) * tolerance(i);
      for (std::size_t c = 0; c < scene_.candidates.size(); ++c) {
        const Candidate& k = scene_.candidates[c];
        const double d2 = (k.x - x).squaredNorm();
        if (k.sign != sign_[i] || d2 > 9 * s2 || k.n.dot(normal) < kLeastCosine) continue;
        const double like = std::log(candidate_curved_[c] / curved_[i]) / kLikeness;
        const double shape = (candidate_shape_[c] - shape_[i]) / kShape;
        const double value = stands_out_[c] * std::exp(-0.5 * d2 / s2 - 0.25 * like * like - 0.25 * shape * shape);
        if (value > m.value[i]) m.value[i] = value, m.candidate[i] = static_cast<int>(c);
      }
      double skin = 0;  // what the skin at the place is worth without an extremum
      if (seen) {
        const auto hit = scene_.nearest.nearest(x, std::max(6.0, 2 * tolerance(i)));
        if (hit.index < 0 || scene_.field().reason[static_cast<std::size_t>(hit.index)] != 0) {
          m.value[i] = 0, m.candidate[i] = -1;
          // Skin that should face the sensor and is not there speaks against the match.
          if (hit.index < 0 && normal.dot(facing_) > kFacing) all += kMissing * std::min(1.0, curved_[i] / 0.06);
          continue;
        }
        // Skin that passes the place by, or looks elsewhere, speaks against the match too.
        const double off = normal.dot(scene_.surface->point(hit.index) - x) / tolerance(i);
        const double tilt = (1 - normal.dot(scene_.field().normals.row(hit.index))) / kTilt;
        const double lies = std::exp(-0.25 * off * off - 0.25 * tilt * tilt);
        m.value[i] *= lies;
        skin = kSkinAlone * lies * likeness(i, static_cast<std::size_t>(hit.index));
      }
      ++m.seen;
      m.matched += m.value[i] > kMatched;
      // Weakly bent points tell little, whether they match or not.
      const double weight = std::min(1.0, curved_[i] / 0.06);
      sum += weight * std::max(m.value[i], skin);
      all += weight;
    }
    // Bodies of an extreme size are rare: the range is two sigmas.
    const double extreme = model_.size_range > 0 ? 2 * (m.size - 1) / model_.size_range : 0;
    sum *= std::exp(-0.25 * extreme * extreme);
    // A few points alone are no match, however well they lie.
    // The power takes back what chance costs a right match: a place off by its sigma is no worse than expected.
    m.score = all > 0 ? std::pow(sum / std::max(all, 0.5 * static_cast<double>(n)), kPower) : 0;
  }

  double apart(const Match& a, const Match& b) const {
    double sum = 0;
    for (const LandmarkPoint& p : model_.points) sum += (a.place(p.position) - b.place(p.position)).squaredNorm();
    return std::sqrt(sum / static_cast<double>(model_.points.size()));
  }

 private:
  double distance(std::size_t i, std::size_t j) const {
    return (model_.points[i].position - model_.points[j].position).norm();
  }
  double tolerance(std::size_t i) const {
    return std::hypot(kPlaceSlack * model_.points[i].sigma, kPeakSlack * scene_.scale);
  }
  bool alike(std::size_t i, std::size_t c) const {
    return scene_.candidates[c].sign == sign_[i] &&
           std::abs(std::log(candidate_curved_[c] / curved_[i])) < 2 * kLikeness;
  }
  bool apart_alike(std::size_t i, std::size_t j, std::size_t a, std::size_t b) const {
    const double d = distance(i, j), live = (scene_.candidates[a].x - scene_.candidates[b].x).norm();
    const double slack = 1.2 * (tolerance(i) + tolerance(j));
    if (live < d * (1 - model_.size_range) - slack || live > d * (1 + model_.size_range) + slack) return false;
    const double cosine = model_.points[i].normal.dot(model_.points[j].normal);
    return std::abs(scene_.candidates[a].n.dot(scene_.candidates[b].n) - cosine) < 0.6;
  }
  // Of the skin at a point of the surface to the model's at landmark i.
  double likeness(std::size_t i, std::size_t row) const {
    const auto r = static_cast<Eigen::Index>(row);
    const double k1 = scene_.field().k1[r], k2 = scene_.field().k2[r];
    if (!((k1 + k2) * sign_[i] > 0)) return 0;
    const double like = std::log(curvedness(k1, k2) / curved_[i]) / kLikeness;
    const double shape = (shape_index(k1, k2) - shape_[i]) / kShape;
    return std::exp(-0.25 * like * like - 0.25 * shape * shape);
  }
  Pair pair(std::size_t i, std::size_t c, double weight) const {
    const LandmarkPoint& p = model_.points[i];
    return {p.position, scene_.candidates[c].x, p.normal, scene_.candidates[c].n, weight};
  }

  const LandmarkScene& scene_;
  const LandmarkModel& model_;
  std::vector<int> sign_;
  std::vector<double> curved_, candidate_curved_, shape_, candidate_shape_, stands_out_;
  Vec3 facing_;  // mean normal: towards the sensor; short on a closed body
};

}  // namespace

std::vector<Match> best_matches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model) {
  const Search search(scene, model);
  const auto triples = search.triples();
  std::vector<std::vector<Match>> found(triples.size());
  parallel_for(
      run, static_cast<std::int64_t>(triples.size()), 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          auto& list = found[static_cast<std::size_t>(i)];
          list = search.hypotheses(triples[static_cast<std::size_t>(i)]);
          std::stable_sort(list.begin(), list.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
          if (list.size() > kKeep) list.resize(kKeep);
        }
      },
      "landmarks: poses");
  std::vector<Match> all;
  for (auto& list : found)
    all.insert(all.end(), std::make_move_iterator(list.begin()), std::make_move_iterator(list.end()));
  std::stable_sort(all.begin(), all.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
  std::vector<Match> kept;
  for (Match& m : all) {
    if (kept.size() == kKeep) break;
    if (std::none_of(kept.begin(), kept.end(), [&](const Match& k) { return search.apart(k, m) < 5; }))
      kept.push_back(std::move(m));
  }
  for (Match& m : kept) search.refine(m);
  std::stable_sort(kept.begin(), kept.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
  std::vector<Match> out;
  for (Match& m : kept) {
    if (std::none_of(out.begin(), out.end(), [&](const Match& k) { return search.apart(k, m) < kDifferent; }))
      out.push_back(std::move(m));
  }
  return out;
}

}  // namespace sgrt
