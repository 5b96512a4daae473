// Registration against analytic surfaces: exact, with noise, with what spoils it, and every status.
#include "registration/icp.hpp"

#include <limits>

#include "core/parallel.hpp"
#include "scenes.hpp"
#include "surface/distance.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

const Vec3 kIso(10, 20, -80);

struct Scene {
  Surface reference, live;
  Pose D;  // reference to live
};

Scene scene(const Shape& shape, std::int64_t n, double sigma, double mm, double deg, unsigned seed) {
  Draw draw(seed);
  Scene s;
  s.D = displacement(mm, deg, kIso, draw);
  s.reference = sample(shape, n, sigma, draw);
  s.live = moved(sample(shape, n, sigma, draw), s.D);
  return s;
}

IcpResult run(const Scene& s, const IcpOptions& options = {}, const Roi* roi = nullptr, const Pose& initial = {}) {
  return align(kSilent, s.reference, s.live, kIso, roi, initial, options);
}

double error_mm(const IcpResult& r, const Pose& D) {
  return about(r.reference_from_live * D, kIso).t.norm();
}
double error_deg(const IcpResult& r, const Pose& D) {
  return so3_log(r.reference_from_live.R * D.R).norm() * 180 / kPi;
}

void expect_no_pose(const IcpResult& r, Status status, const std::string& words) {
  EXPECT_EQ(static_cast<int>(r.status), static_cast<int>(status)) << r.verdict_words;
  EXPECT_NE(r.message.find(words), std::string::npos) << r.message;
  EXPECT_EQ(r.message, r.verdict_words);
  EXPECT_EQ(r.verdict, Verdict::kNone);
  EXPECT_TRUE(r.reference_from_live.R.array().isNaN().all() && r.reference_from_live.t.array().isNaN().all());
  EXPECT_TRUE(r.covariance.array().isNaN().all());
  for (const SixDof& six : {SixDof(r.displacement), SixDof(r.correction)}) {
    for (const double v : {six.lat_mm, six.lng_mm, six.vrt_mm, six.pitch_deg, six.roll_deg, six.rtn_deg, six.mag_mm}) {
      EXPECT_TRUE(std::isnan(v));
    }
  }
  EXPECT_TRUE(std::isnan(r.rms));
}

// REQ-ICP-001
TEST(Icp, FindsWhatWasMoved) {
  const Scene s = scene(torso, 5000, 0, 15, 3, 1);
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_EQ(r.verdict_words, "ok");
  EXPECT_LT(error_mm(r, s.D), 0.005);  // of sampling: the two surfaces share no point
  EXPECT_LT(error_deg(r, s.D), 0.003);
  const PatientDisplacement d = displacement_of(s.D.inverse(), kIso);
  EXPECT_NEAR(r.displacement.lat_mm, d.lat_mm, 0.005);
  EXPECT_NEAR(r.displacement.rtn_deg, d.rtn_deg, 0.003);
  EXPECT_GT(r.inlier_share, 0.95);
  EXPECT_EQ(r.pair_count, std::count(r.inlier.begin(), r.inlier.end(), 1));
}

TEST(Icp, TheSamePointsComeBackWithinTheSmoothing) {
  Scene s = scene(torso, 3000, 0, 15, 3, 2);
  s.live = moved(s.reference, s.D);
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_LT(error_mm(r, s.D), 0.01);
  EXPECT_LT(error_deg(r, s.D), 0.002);
}

// REQ-ICP-001
TEST(Icp, NoiseOfATorso) {
  for (unsigned seed = 3; seed < 6; ++seed) {
    const Scene s = scene(torso, 20000, 0.3, 15, 3, seed);
    const IcpResult r = run(s);
    ASSERT_EQ(r.status, Status::kOk) << r.message;
    EXPECT_EQ(r.verdict_words, "ok");
    EXPECT_LT(error_mm(r, s.D), 0.08);
    EXPECT_LT(error_deg(r, s.D), 0.03);
    EXPECT_GT(r.rms, 0.3);  // the live noise and what smoothing leaves of the reference's
    EXPECT_LT(r.rms, 0.34);
  }
}

TEST(Icp, TheIsocentreIsWhereTheShiftIsToldNotWhereItIsFound) {
  const Scene s = scene(torso, 4000, 0.1, 10, 2, 7);
  const IcpResult near = run(s);
  const IcpResult far = align(kSilent, s.reference, s.live, Vec3(500, 0, 0), nullptr, {}, {});
  ASSERT_EQ(far.status, Status::kOk) << far.message;
  EXPECT_LT((far.reference_from_live.t - near.reference_from_live.t).norm(), 1e-6);
  EXPECT_GT(far.covariance(5, 5), 2 * near.covariance(5, 5));
  // D_true = D exp(delta): the covariance at one isocentre follows from that at another.
  const Mat6 shift = adjoint(Pose{Mat3::Identity(), kIso - Vec3(500, 0, 0)});
  EXPECT_LT((shift * near.covariance * shift.transpose() - far.covariance).norm(), 1e-6 * far.covariance.norm());
}

TEST(Icp, InitialGuessBeyondTheCaptureRange) {
  Scene s = scene(torso, 4000, 0.2, 10, 2, 8);
  const Pose turn = about(Pose{so3_exp(Vec3(0, 0, kPi)), Vec3(40, 0, 0)}, -kIso);
  s.live = moved(s.live, turn);
  const Pose D = turn * s.D;
  const IcpResult lost = run(s);
  EXPECT_FALSE(lost.status == Status::kOk && lost.verdict == Verdict::kOk) << lost.verdict_words;
  const IcpResult found = run(s, {}, nullptr, turn.inverse());
  ASSERT_EQ(found.status, Status::kOk) << found.message;
  EXPECT_LT(error_mm(found, D), 0.1);
}

// REQ-ICP-004
TEST(Icp, AWrongMinimumIsNeverOk) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double deg : {60.0, -60.0, 90.0, 120.0, 180.0}) {
      Scene s = scene(torso, 4000, 0.2, 0, 0, 9);
      s.D = about(Pose{so3_exp(Vec3(Mat3::Identity().col(axis)) * deg * kPi / 180), Vec3::Zero()}, -kIso);
      s.live = moved(s.live, s.D);
      const IcpResult r = run(s);
      if (r.status == Status::kOk && error_mm(r, s.D) > 0.1) EXPECT_LT(r.rms, 3) << r.verdict_words;
      if (r.status != Status::kOk || r.verdict != Verdict::kOk) continue;
      EXPECT_LT(error_mm(r, s.D), 0.1) << "axis " << axis << " by " << deg << " deg";
    }
  }
}

// REQ-ICP-006
TEST(Icp, GarbageHolesAndACouch) {
  Scene s = scene(torso, 6000, 0.2, 12, 2, 10);
  Draw draw(11);
  Surface spoiled = s.live;
  spoiled.points.conservativeResize(6000 + 300 + 2000, 3);
  spoiled.sigma = Eigen::VectorXd::Constant(spoiled.size(), 0.2);
  for (std::int64_t i = 0; i < 300; ++i) spoiled.points.row(6000 + i) = (200 * draw.vec3()).transpose();
  for (std::int64_t i = 6300; i < spoiled.size(); ++i) {
    spoiled.points.row(i) << 300 * draw.uniform(), 300 * draw.uniform(), -110 + 0.2 * gauss(draw);
  }
  for (int hole = 0; hole < 8; ++hole) {
    const Vec3 centre = s.live.point(700 * hole);
    for (std::int64_t i = 0; i < 6000; ++i) {
      if ((s.live.point(i) - centre).norm() < 20) spoiled.points.row(i).setConstant(std::nan(""));
    }
  }
  s.live = spoiled;
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_LT(error_mm(r, s.D), 0.1);
  EXPECT_LT(error_deg(r, s.D), 0.06);
  EXPECT_LT(r.inlier_share, 0.8);
}

// The rows of s for which keep(point) holds.
template <class Keep>
Surface only(const Surface& s, Keep&& keep) {
  Surface out;
  out.points.resize(s.size(), 3);
  std::int64_t n = 0;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (keep(s.point(i))) out.points.row(n++) = s.points.row(i);
  }
  out.points.conservativeResize(n, 3);
  if (s.sigma.size() > 0) out.sigma = s.sigma.head(n);
  return out;
}

// REQ-ICP-011
TEST(Icp, PartialOverlapIsFoundAndSaid) {
  Scene s = scene(torso, 16000, 0.2, 10, 2, 12);
  s.reference = only(s.reference, [](const Vec3& x) { return x[1] < 50; });
  s.live = only(s.live, [](const Vec3& x) { return x[1] > -50; });  // 40 % of either
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_NEAR(r.inlier_share, 0.4, 0.05);
  EXPECT_LT(error_mm(r, s.D), 0.3);
  EXPECT_EQ(r.verdict, Verdict::kWeak);
  EXPECT_NE(r.verdict_words.find("of the live points match"), std::string::npos) << r.verdict_words;
}

TEST(Icp, RoiIsThePartThatCounts) {
  Scene s = scene(torso, 12000, 0.2, 8, 1, 13);
  // Outside the box the patient has changed: it must not matter.
  for (std::int64_t i = 0; i < s.live.size(); ++i) {
    const Vec3 x = s.D.inverse() * s.live.point(i);
    if (std::abs(x[0]) > 115 || std::abs(x[1]) > 135) s.live.points.row(i) += Vec3(0, 0, 4).transpose();
  }
  const Roi roi = roi_from_box(Vec3(-100, -120, -300), Vec3(100, 120, 300));
  const IcpResult inside = run(s, {}, &roi), all = run(s);
  ASSERT_EQ(inside.status, Status::kOk) << inside.message;
  EXPECT_LT(error_mm(inside, s.D), 0.1);
  EXPECT_GT(inside.inlier_share, 0.95);
  EXPECT_LT(inside.pair_count, 8000);
  EXPECT_FALSE(all.status == Status::kOk && all.verdict == Verdict::kOk && error_mm(all, s.D) > 1) << all.verdict_words;
  const Roi nowhere = roi_from_box(Vec3(900, 0, 0), Vec3(901, 1, 1));
  expect_no_pose(run(s, {}, &nowhere), Status::kInsufficientData, "within the roi has 0");
}

TEST(Icp, ASmallReferenceOnALargeLiveSurface) {
  Scene s = scene(torso, 12000, 0.2, 8, 1, 14);
  s.reference = only(s.reference, [](const Vec3& x) { return std::abs(x[0]) < 110 && std::abs(x[1]) < 60; });
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_LT(r.inlier_share, 0.3);
  EXPECT_LT(error_mm(r, s.D), 0.3);
}

TEST(Icp, DistanceMapAtThePose) {
  Scene s = scene(torso, 4000, 0.1, 8, 1, 15);
  s.reference = estimate_normals(kSilent, s.reference, {});
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  const Eigen::VectorXd map = signed_distance(kSilent, s.reference, s.live, r.reference_from_live, DistanceOptions{40});
  const Eigen::ArrayXd apart = (map - r.distance).array().abs();
  EXPECT_GT((apart == apart).count(), 3850);
  EXPECT_LT(std::sqrt((apart == apart).select(apart, 0).square().sum() / 4000), 0.08);
  EXPECT_LT(std::sqrt(r.distance.array().isNaN().select(0, r.distance).squaredNorm() / 4000), 0.15);
}

// REQ-ICP-005
TEST(Icp, StatusesWithoutAPose) {
  const Scene s = scene(torso, 2000, 0.2, 5, 1, 16);
  Scene t = s;
  t.live.points.rowwise() += Eigen::RowVector3d(0, 0, 500);
  expect_no_pose(run(t), Status::kNotFound, "do not overlap");
  for (const std::int64_t n : {1, 3, 5}) {
    t = s;
    t.reference.points.conservativeResize(n, 3);
    t.reference.sigma.conservativeResize(n);
    expect_no_pose(run(t), Status::kInsufficientData, " has " + std::to_string(n) + " usable points");
    std::swap(t.reference, t.live);
    expect_no_pose(run(t), Status::kInsufficientData, " has " + std::to_string(n) + " usable points");
  }
  t = s;
  t.reference.points.rowwise() = t.reference.points.row(0).eval();
  expect_no_pose(run(t), Status::kInsufficientData, "usable points");
  t.live = t.reference;
  expect_no_pose(run(t), Status::kInsufficientData, "usable points");
  IcpOptions once;
  once.max_iterations = 1;
  expect_no_pose(run(s, once), Status::kNotConverged, "still moving");
}

TEST(Icp, SeldomFailsToComeToRest) {
  // Few and noisy points make pairs flicker between two poses.
  for (unsigned seed = 100; seed < 160; ++seed) {
    const IcpResult r = run(scene(torso, 1000, 0.8, 10, 2, seed));
    EXPECT_NE(r.status, Status::kNotConverged) << "seed " << seed;
  }
}

TEST(Icp, NormalsAreTakenAsGivenOrEstimated) {
  Scene s = scene(torso, 4000, 0.1, 8, 1, 17);
  const IcpResult estimated = run(s);
  s.reference = estimate_normals(kSilent, s.reference, {});
  s.live = estimate_normals(kSilent, s.live, {});
  const IcpResult given = run(s);
  EXPECT_LT((estimated.reference_from_live.t - given.reference_from_live.t).norm(), 1e-6);
  // Normals that are given mean what they say: the inner side of a skin is not its outer side.
  s.live.normals *= -1;
  EXPECT_EQ(run(s).status, Status::kNotFound);
}

TEST(Icp, FromThirtyMillimetresAndTwentyDegrees) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Scene s = scene(torso, 4000, 0.2, 30, 20, 200 + seed);
    const IcpResult r = run(s);
    ASSERT_EQ(r.status, Status::kOk) << seed << ": " << r.message;
    EXPECT_LT(error_mm(r, s.D), 0.2) << seed;
  }
}

// REQ-ICP-008
TEST(Icp, APreparedReferenceGivesTheSame) {
  const Scene s = scene(torso, 4000, 0.2, 10, 2, 30);
  const auto reference = prepare_reference(kSilent, s.reference, nullptr);
  const IcpResult a = run(s), b = align(kSilent, *reference, s.live, kIso, Pose{}, {});
  EXPECT_EQ(a.reference_from_live.t, b.reference_from_live.t);
  EXPECT_EQ(a.covariance, b.covariance);
}

TEST(Icp, InsideOutAndMetresAreSaid) {
  Scene s = scene(torso, 4000, 0.2, 5, 1, 31);
  s.reference = estimate_normals(kSilent, s.reference, {});
  s.live = estimate_normals(kSilent, s.live, {});
  Scene t = s;
  t.live.normals *= -1;
  expect_no_pose(run(t), Status::kNotFound, "inside out");
  t = s;
  t.live.points /= 1000;
  expect_no_pose(run(t), Status::kNotFound, "is the live one in metres?");
  t = s;
  t.reference.points /= 1000;
  expect_no_pose(run(t), Status::kNotFound, "is the reference in metres?");
  t.live.points /= 1000;
  expect_no_pose(run(t), Status::kNotFound, "are they in metres?");
}

// REQ-ICP-004
TEST(Icp, AMirroredSurfaceIsNeverOk) {
  Scene s = scene(torso, 4000, 0.2, 5, 1, 32);
  s.live.points.col(0) *= -1;
  IcpOptions anywhere;
  anywhere.anywhere = true;
  for (const IcpOptions& o : {IcpOptions{}, anywhere}) {
    const IcpResult r = run(s, o);
    EXPECT_FALSE(r.status == Status::kOk && r.verdict == Verdict::kOk) << r.verdict_words;
  }
}

TEST(Icp, AnIsocentreTwoMetresAwayIsWeak) {
  const Scene s = scene(torso, 4000, 0.2, 5, 1, 33);
  const IcpResult r = align(kSilent, s.reference, s.live, Vec3(0, 2200, 0), nullptr, {}, {});
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_EQ(r.verdict, Verdict::kWeak);
  EXPECT_NE(r.verdict_words.find("mm from the surface: 0.1 deg there is"), std::string::npos) << r.verdict_words;
}

TEST(Icp, NothingToLayOnEachOther) {
  const Scene s = scene(torso, 3000, 0.2, 5, 1, 40);
  Scene t = s;
  t.live = moved(s.live, Pose{Mat3::Identity(), Vec3(0, 0, 600)});
  expect_no_pose(run(t), Status::kNotFound, "do not overlap");
  for (const bool live : {true, false}) {
    t = s;
    Surface& one = live ? t.live : t.reference;
    one.points = one.points.topRows(3).eval();
    one.sigma = one.sigma.head(3).eval();
    expect_no_pose(run(t), Status::kInsufficientData, "3 usable points");
  }
  t = s;
  t.live.points.rowwise() = t.live.points.row(0).eval();
  expect_no_pose(run(t), Status::kInsufficientData, "all coincide");
  t = s;
  t.reference.points.rowwise() = t.reference.points.row(0).eval();
  EXPECT_NE(run(t).status, Status::kOk);
  EXPECT_TRUE(run(t).reference_from_live.t.array().isNaN().all());
}

TEST(Icp, AReferenceWithHolesWhereTheRoiIs) {
  Scene s = scene(torso, 6000, 0.2, 5, 1, 41);
  const Roi roi = roi_from_box(Vec3(-50, -50, -300), Vec3(50, 50, 300));
  for (std::int64_t i = 0; i < s.reference.size(); ++i) {
    if (contains(roi, s.reference, i)) s.reference.points.row(i).setConstant(std::nan(""));
  }
  expect_no_pose(run(s, {}, &roi), Status::kInsufficientData, "within the roi has 0 usable points");
}

TEST(Icp, NoiseThatIsNone) {
  Scene s = scene(torso, 3000, 0, 5, 1, 42);
  s.live.covariance.setZero(s.live.size(), 6);
  s.live.sigma.resize(0);
  const IcpResult r = run(s);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_LT(error_mm(r, s.D), 0.05);
  EXPECT_TRUE(r.covariance.allFinite() && r.covariance(3, 3) > 0);
  s.live.covariance.resize(0, 6);
  s.live.sigma = Eigen::VectorXd::Constant(s.live.size(), std::nan(""));
  expect_error(Status::kInvalidArgument, "sigma", [&] { make_surface(s.live); });
}

// Turned by half a turn the skin may come to rest on itself with residuals of millimetres: that is no match.
// REQ-ICP-004
TEST(Icp, WhatDoesNotMatchIsNotFound) {
  for (int axis = 0; axis < 3; ++axis) {
    Scene s = scene(torso, 4000, 0.2, 0, 0, 9);
    s.live = moved(s.live, about(Pose{so3_exp(kPi * Vec3(Mat3::Identity().col(axis))), Vec3::Zero()}, -kIso));
    const IcpResult r = run(s);
    EXPECT_FALSE(r.status == Status::kOk && r.rms > 3) << axis << ": " << r.verdict_words;
  }
}

// REQ-DET-002
TEST(Icp, SameBitsAtAnyNumberOfThreads) {
  const Scene s = scene(torso, 6000, 0.3, 15, 3, 18);
  const IcpResult one = run(s);
  for (const int threads : {2, 3, 4, 8, 16}) {
    ThreadPool pool(threads);
    sgrt::Run many;
    many.pool = &pool;
    const IcpResult r = align(many, s.reference, s.live, kIso, nullptr, {}, {});
    EXPECT_EQ(r.reference_from_live.R, one.reference_from_live.R);
    EXPECT_EQ(r.reference_from_live.t, one.reference_from_live.t);
    EXPECT_EQ(r.covariance, one.covariance);
    EXPECT_EQ(r.rms, one.rms);
    EXPECT_EQ(r.inlier, one.inlier);
    EXPECT_TRUE((r.distance.array() == one.distance.array() || r.distance.array().isNaN()).all());
  }
}

// REQ-CTX-002
TEST(Icp, CancelIsObeyed) {
  const Scene s = scene(torso, 3000, 0.3, 15, 3, 19);
  int calls = 0;
  sgrt::Run counting;
  counting.progress = [&](double, const char*) { return ++calls < 0; };
  align(counting, s.reference, s.live, kIso, nullptr, {}, {});
  const int all = calls;
  EXPECT_GT(all, 20);
  for (int at = 1; at <= all; at += std::max(1, all / 20)) {
    sgrt::Run cancelling;
    int seen = 0;
    cancelling.progress = [&](double, const char*) { return ++seen >= at; };
    expect_error(Status::kCancelled, "", [&] { align(cancelling, s.reference, s.live, kIso, nullptr, {}, {}); });
  }
}

TEST(Icp, BadArguments) {
  const Scene s = scene(torso, 500, 0.3, 5, 1, 20);
  const auto refuses = [&](const std::string& words, auto&& change) {
    IcpOptions o;
    change(o);
    expect_error(Status::kInvalidArgument, words, [&] { run(s, o); });
  };
  refuses("max_iterations is 0", [](IcpOptions& o) { o.max_iterations = 0; });
  refuses("max_distance_mm is -1", [](IcpOptions& o) { o.max_distance = -1; });
  refuses("max_angle_deg is 91", [](IcpOptions& o) { o.max_angle_deg = 91; });
  refuses("min_inlier_share is 1.5", [](IcpOptions& o) { o.min_inlier_share = 1.5; });
  refuses("step_tolerance_mm is 0", [](IcpOptions& o) { o.step_tolerance = 0; });
  refuses("weak_sigma_mm is nan", [](IcpOptions& o) { o.weak_sigma = std::nan(""); });
  refuses("degenerate_sigma_mm is inf", [](IcpOptions& o) { o.degenerate_sigma = INFINITY; });
  expect_error(Status::kInvalidArgument, "isocentre_mm",
               [&] { align(kSilent, s.reference, s.live, Vec3(0, std::nan(""), 0), nullptr, {}, {}); });
  Pose lost;
  lost.t[0] = std::nan("");
  expect_error(Status::kInvalidArgument, "initial_reference_from_live", [&] { run(s, {}, nullptr, lost); });
}

TEST(Icp, FarFromTheOriginIsAsGood) {
  Scene s = scene(torso, 4000, 0.1, 8, 1, 21);
  const Pose away{Mat3::Identity(), Vec3(9e4, -9e4, 9e4)};
  const IcpResult near = run(s);
  s.reference = moved(s.reference, away);
  s.live = moved(s.live, away);
  const IcpResult far = align(kSilent, s.reference, s.live, kIso + away.t, nullptr, {}, {});
  ASSERT_EQ(far.status, Status::kOk) << far.message;
  EXPECT_NEAR(far.displacement.vrt_mm, near.displacement.vrt_mm, 1e-3);
}

}  // namespace
}  // namespace sgrt
