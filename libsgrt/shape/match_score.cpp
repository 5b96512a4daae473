// Values of landmarks, score and evidence of a pose. docs/theory/landmarks.md eq. 7-8.
#include "shape/match_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLikeness = 0.7;    // sigma of the logarithm of a curvedness
constexpr double kShape = 0.4;       // sigma of a shape index
constexpr double kAlone = 0.5;       // persistence over H, of a candidate that counts in full
constexpr double kPlaceSlack = 1.2;  // of the tolerated distance over sigma, while the body is still a rigid copy
constexpr double kPeakSlack = 0.25;  // of the scale: how far noise may move an extremum
constexpr double kLeastCosine = 0.4;
constexpr double kTilt = 0.4;          // sigma of one less the cosine between the skin's normal and the model's
constexpr double kSkinAlone = 0.7;     // value of skin that is bent as it should be, without an extremum
constexpr double kFacing = 0.5;        // cosine with the direction of sight, from which a place should be in view
constexpr double kMissing = 0.6;       // weight of a place that should be in view and is not
constexpr double kEmpty = 1;           // tolerances before the skin, from which a place is known to be empty
constexpr double kReach = 2.5;         // sigmas to the skin between the landmarks
constexpr double kSmooth = 0.04;       // 1/mm, of that skin
constexpr double kSkinExpected = 0.8;  // its value at a right pose
constexpr double kBent = 0.06;         // 1/mm, of a landmark that counts in full: weakly bent ones tell little
constexpr double kPower = 0.75;
constexpr double kNoSkin = 1.2;      // nepers that a landmark in view without its extremum tells against a pose
constexpr double kSkinTells = 3;     // nepers that its skin may tell for it
constexpr double kBetweenTells = 2;  // nepers of a place between the landmarks, over the logarithm of its value
constexpr double kOfScore = 50;      // nepers of the score, which sees what the extrema do not

double square(double x) {
  return x * x;
}

}  // namespace

bool taken(const Match& match, std::size_t i) {
  for (std::size_t j = 0; j < match.candidate.size(); ++j) {
    if (j == i || match.candidate[j] != match.candidate[i]) continue;
    if (match.value[j] > match.value[i] || (match.value[j] == match.value[i] && j < i)) return true;
  }
  return false;
}

Scorer::Scorer(const LandmarkScene& scene, const LandmarkModel& model)
    : scene_(scene), model_(model), sight_(*scene.surface, scene.grain->spacing) {
  for (auto* v : {&curved_, &shape_, &tolerance_, &rare_}) v->reserve(model.points.size());
  sign_.reserve(model.points.size());
  for (auto* v : {&candidate_curved_, &candidate_shape_, &stands_out_}) v->reserve(scene.candidates.size());
  double count[2] = {1, 1}, area = 0;
  for (const Candidate& c : scene.candidates) ++count[c.sign > 0];
  for (const std::uint8_t r : scene.field().reason) area += r == 0 ? square(scene.grain->spacing) : 0;
  for (const LandmarkPoint& p : model.points) {
    sign_.push_back(sign_of(p));
    // A disc wider than the model's sees less of a form of radius 1 / C.
    const double C = curvedness(p.k1, p.k2);
    curved_.push_back(C * std::hypot(1, C * model.scale) / std::hypot(1, C * scene.scale));
    shape_.push_back(shape_index(p.k1, p.k2));
    tolerance_.push_back(std::hypot(kPlaceSlack * p.sigma, kPeakSlack * scene.scale));
    rare_.push_back(area / count[sign_.back() > 0] / (2 * kPi * square(tolerance_.back())));
  }
  for (const Candidate& c : scene.candidates) {
    candidate_curved_.push_back(curvedness(c.k1, c.k2));
    candidate_shape_.push_back(shape_index(c.k1, c.k2));
    // A bump on a flank is less of a landmark than one that stands alone.
    stands_out_.push_back(std::sqrt(std::min(1.0, c.persistence / (kAlone * std::abs(c.mean)))));
  }
}

bool Scorer::alike(std::size_t i, std::size_t c) const {
  return scene_.candidates[c].sign == sign_[i] && std::abs(std::log(candidate_curved_[c] / curved_[i])) < 2 * kLikeness;
}

double Scorer::weight(std::size_t i) const {
  return std::min(1.0, curved_[i] / kBent);
}

void Scorer::operator()(Match& m, bool seen) const {
  const std::size_t n = model_.points.size();
  take_extrema(m);
  m.seen = m.matched = 0;
  m.evidence = 0;
  double sum = 0, all = 0;
  std::vector<double> alone(n, std::numeric_limits<double>::quiet_NaN());  // evidence without an extremum
  for (std::size_t i = 0; i < n; ++i) {
    double skin = 0;  // what the skin at the place is worth without an extremum
    if (seen && !ask_skin(m, i, &all, &skin)) continue;
    ++m.seen;
    m.matched += m.value[i] > kMatched;
    sum += weight(i) * std::max(m.value[i], skin);
    all += weight(i);
    alone[i] = weight(i) * (kSkinTells * skin - kNoSkin);
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (std::isnan(alone[i])) continue;
    const bool own = m.candidate[i] >= 0 && m.value[i] > 0 && !taken(m, i);
    m.evidence += own ? std::max(alone[i], weight(i) * std::log(rare_[i] * m.value[i])) : alone[i];
  }
  // Bodies of an extreme size are rare: the range is two sigmas.
  const double extreme = model_.size_range > 0 ? 2 * (m.size - 1) / model_.size_range : 0;
  sum *= std::exp(-0.25 * square(extreme));
  m.evidence -= 0.5 * square(extreme);
  if (seen) {
    const double lies = skin_lies(m);
    sum *= lies;
    m.evidence += kBetweenTells * static_cast<double>(model_.skin.size()) * std::log(lies);
  }
  // A few points alone are no match, however well they lie.
  // The power takes back what chance costs a right match: a place off by its sigma is no worse than expected.
  m.score = all > 0 ? std::pow(sum / std::max(all, 0.5 * static_cast<double>(n)), kPower) : 0;
  m.evidence += kOfScore * m.score;
}

// The extremum that fits each landmark best, and how well.
void Scorer::take_extrema(Match& m) const {
  m.candidate.assign(model_.points.size(), -1);
  m.value.assign(model_.points.size(), 0);
  for (std::size_t i = 0; i < model_.points.size(); ++i) {
    const Vec3 x = m.place(model_.points[i].position), normal = m.pose.R * model_.points[i].normal;
    const double s2 = square(tolerance_[i]);
    for (std::size_t c = 0; c < scene_.candidates.size(); ++c) {
      const Candidate& k = scene_.candidates[c];
      const double d2 = (k.x - x).squaredNorm();
      if (k.sign != sign_[i] || d2 > 9 * s2 || k.n.dot(normal) < kLeastCosine) continue;
      const double like = std::log(candidate_curved_[c] / curved_[i]) / kLikeness;
      const double shape = (candidate_shape_[c] - shape_[i]) / kShape;
      const double value = stands_out_[c] * std::exp(-0.5 * d2 / s2 - 0.25 * like * like - 0.25 * shape * shape);
      if (value > m.value[i]) m.value[i] = value, m.candidate[i] = static_cast<int>(c);
    }
  }
}

// Of landmark i: false where there is no skin whose curvature is known; `all` grows by what that says against the
// match.
bool Scorer::ask_skin(Match& m, std::size_t i, double* all, double* skin) const {
  const Vec3 x = m.place(model_.points[i].position), normal = m.pose.R * model_.points[i].normal;
  const auto hit = scene_.nearest.nearest(x, std::max(6.0, 2 * tolerance_[i]));
  if (hit.index < 0 || scene_.field().reason[static_cast<std::size_t>(hit.index)] != 0) {
    m.value[i] = 0, m.candidate[i] = -1;
    const double near = hit.index < 0 ? 0 : std::exp(-0.25 * hit.distance2 / square(tolerance_[i]));
    const double absent = weight(i) * (1 - near) * missing(x, normal, tolerance_[i]);
    *all += absent;
    m.evidence -= kNoSkin * absent;
    return false;
  }
  // Skin that passes the place by, or looks elsewhere, speaks against the match too.
  const double off = normal.dot(scene_.surface->point(hit.index) - x) / tolerance_[i];
  const double tilt = (1 - normal.dot(scene_.field().normals.row(hit.index))) / kTilt;
  const double lies = std::exp(-0.25 * off * off - 0.25 * tilt * tilt);
  m.value[i] *= lies;
  *skin = kSkinAlone * lies * likeness(i, static_cast<std::size_t>(hit.index));
  return true;
}

// Of the skin at a point of the surface to the model's at landmark i.
double Scorer::likeness(std::size_t i, std::size_t row) const {
  const auto r = static_cast<Eigen::Index>(row);
  const double k1 = scene_.field().k1[r], k2 = scene_.field().k2[r];
  if (!((k1 + k2) * sign_[i] > 0)) return 0;
  const double like = std::log(curvedness(k1, k2) / curved_[i]) / kLikeness;
  const double shape = (shape_index(k1, k2) - shape_[i]) / kShape;
  return std::exp(-0.25 * like * like - 0.25 * shape * shape);
}

// How much it speaks against a match that there is no skin at x: skin that should face the sensor does unless other
// skin hides it, the more where the sensor looked through the place.
double Scorer::missing(const Vec3& x, const Vec3& normal, double tolerance) const {
  const double before = sight_.before_skin(x);
  if (before > kEmpty * tolerance) return 1;
  return !(before < -tolerance) && normal.dot(sight_.towards()) > kFacing ? kMissing : 0;
}

// 0 to 1: whether the skin between the landmarks lies where it should and is smooth.
double Scorer::skin_lies(const Match& m) const {
  double sum = kSkinExpected, all = 1;
  for (const SkinPlace& p : model_.skin) {
    const Vec3 x = m.place(p.position), normal = m.pose.R * p.normal;
    const double s = kPlaceSlack * p.sigma;
    const auto hit = scene_.nearest.nearest(x, kReach * s);
    if (hit.index < 0) {
      all += missing(x, normal, s);
      continue;
    }
    const double off = normal.dot(scene_.surface->point(hit.index) - x) / s;
    double tilt = 0, bent = 0;
    if (scene_.field().reason[static_cast<std::size_t>(hit.index)] == 0) {
      tilt = (1 - normal.dot(scene_.field().normals.row(hit.index))) / kTilt;
      bent = scene_.field().curvedness[hit.index] / kSmooth;
    }
    sum += std::exp(-0.25 * (off * off + tilt * tilt + bent * bent));
    ++all;
  }
  return std::min(1.0, sum / all / kSkinExpected);
}

}  // namespace sgrt
