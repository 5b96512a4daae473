// Which landmarks agree on a motion: every triple of pairs of one id proposes one. docs/theory/coarse.md section 2.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/run.hpp"
#include "registration/landmark_fit.hpp"

namespace sgrt {

using Mask = std::uint64_t;  // of pairs

struct LandmarkPair {
  std::int64_t i, j;  // rows of reference and live
};

struct LandmarkMotion {
  Pose pose;
  Mask mask = 0;
  int count = 0;
  double chi2 = 0;
  Mat6 information;  // at the isocentre
};

inline bool has(Mask mask, std::size_t k) {
  return (mask >> k & 1) != 0;
}

// Motions that triples of pairs propose and that other pairs agree with.
class LandmarkConsensus {
 public:
  LandmarkConsensus(const LandmarkSet& reference, const LandmarkSet& live, const Vec3& isocentre,
                    std::vector<LandmarkPair> pairs)
      : reference_(reference), live_(live), isocentre_(isocentre), pairs_(std::move(pairs)) {}

  // Every triple of pairs whose distances agree; what each leads to, once.
  void propose(const Run& run);

  bool on_a_line() const { return line_ && !triple_; }  // all triples that agree lie on a line
  const std::map<Mask, LandmarkMotion>& found() const { return found_; }
  const std::vector<LandmarkPair>& pairs() const { return pairs_; }
  Vec3 error(const Pose& T, std::size_t k) const;

 private:
  double chi2(const Pose& T, std::size_t k) const;
  const Mat3& reference_noise(std::size_t k) const;
  const Mat3& live_noise(std::size_t k) const;
  Mat3 noise(const Pose& T, std::size_t k) const;
  bool as_far(std::size_t a, std::size_t b) const;
  void climb(const std::array<std::size_t, 3>& triple);
  Mask agreeing(const Pose& T, double gate) const;
  bool fit(LandmarkMotion& c) const;

  const LandmarkSet &reference_, &live_;
  Vec3 isocentre_;
  std::vector<LandmarkPair> pairs_;
  std::map<Mask, LandmarkMotion> found_;
  bool triple_ = false, line_ = false;
};

}  // namespace sgrt
