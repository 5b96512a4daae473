// The beam-hold signal: on only with a trusted pose within tolerance; off is easy, on again is hard.
#include "tracking/beam.hpp"

#include <limits>
#include <vector>

#include "expect.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

BeamOptions conventional() {
  BeamOptions o{};
  o.tolerance = tolerance_of(Profile::kConventional);
  return o;
}

Measured at(double time, double mm, double deg = 0, double breathing = kNaN) {
  return {time, true, false, mm, deg, breathing};
}

TEST(Beam, TolerancesOfTheProfiles) {
  EXPECT_EQ(tolerance_of(Profile::kConventional).mm, 2);
  EXPECT_EQ(tolerance_of(Profile::kConventional).deg, 1);
  for (const Profile p : {Profile::kSbrt, Profile::kSrs}) {
    EXPECT_EQ(tolerance_of(p).mm, 1);
    EXPECT_EQ(tolerance_of(p).deg, 0.5);
  }
  test::expect_error(Status::kInvalidArgument, "profile: 7", [] { tolerance_of(static_cast<Profile>(7)); });
}

// REQ-TRACK-001
TEST(Beam, HoldsUntilItKnows) {
  Beam beam(conventional());
  EXPECT_FALSE(beam.on());
  EXPECT_EQ(beam.why(), kHoldNoPose);
  EXPECT_TRUE(beam.take(at(0, 2)));  // the first: the plain tolerance
  EXPECT_EQ(beam.why(), 0);
}

// REQ-TRACK-002
TEST(Beam, WhatIsNotANumberHolds) {
  for (const Measured& m :
       {at(0, kNaN), at(0, 0, kNaN), Measured{0, false, false, 0, 0, 0}, Measured{0, true, true, 0, 0, 0}}) {
    Beam beam(conventional());
    ASSERT_TRUE(beam.take(at(0, 0)));
    EXPECT_FALSE(beam.take(m));
    EXPECT_NE(beam.why(), 0);
  }
  BeamOptions gated = conventional();
  gated.gated = true;
  EXPECT_FALSE(Beam(gated).take(at(0, 0, 0, kNaN)));
  EXPECT_TRUE(Beam(gated).take(at(0, 0, 0, 1.5)));
  EXPECT_FALSE(Beam(gated).take(at(0, 0, 0, 1.51)));
  EXPECT_FALSE(Beam(gated).take(at(0, 0, 0, -1.51)));
}

// Noise of 0.1 mm about the tolerance does not make it flicker.
// REQ-TRACK-004
TEST(Beam, DoesNotFlicker) {
  Beam beam(conventional());
  test::Draw draw(5);
  beam.take(at(0, 0));
  int changes = 0;
  bool was = true;
  for (int i = 1; i < 1000; ++i) {
    const bool on = beam.take(at(i, 2 + 0.1 * draw.uniform()));
    changes += on != was;
    was = on;
  }
  EXPECT_EQ(changes, 1);
  EXPECT_FALSE(was);
  EXPECT_EQ(beam.why() & ~kHoldReturning & ~kHoldTranslation, 0);
  EXPECT_TRUE(beam.take(at(1000, 1.6)));
}

// REQ-TRACK-004
TEST(Beam, ReturnsOnlyAfterAWhile) {
  BeamOptions o = conventional();
  o.resume = 1;
  Beam beam(o);
  beam.take(at(0, 3));
  EXPECT_FALSE(beam.take(at(1, 1)));
  EXPECT_EQ(beam.why(), kHoldReturning);
  EXPECT_FALSE(beam.take(at(1.9, 1)));
  EXPECT_FALSE(beam.take(at(2.0, 1.9)));  // within the tolerance, but not well inside: the wait starts again
  EXPECT_FALSE(beam.take(at(2.1, 1)));
  EXPECT_FALSE(beam.take(at(3.0, 1)));
  EXPECT_TRUE(beam.take(at(3.1, 1)));
  EXPECT_TRUE(beam.take(at(3.2, 1.9)));  // on: only the tolerance counts
}

// REQ-TRACK-001
TEST(Beam, NamesAllThatIsWrong) {
  BeamOptions o = conventional();
  o.gated = true;
  Beam beam(o);
  beam.take(at(0, 3, 2, 9));
  EXPECT_EQ(beam.why(), kHoldTranslation | kHoldRotation | kHoldBreathing);
  beam.take({1, true, true, 3, 0, 9});
  EXPECT_EQ(beam.why(), kHoldWeak | kHoldTranslation | kHoldBreathing);
  beam.take({2, false, false, kNaN, kNaN, 0});
  EXPECT_EQ(beam.why(), kHoldNoPose);
}

}  // namespace
}  // namespace sgrt
