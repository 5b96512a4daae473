// Bodies that are not rigid: the rigid part's motion is found apart from smooth changes of shape, or is refused; a
// scale; a displacement field. Shapes and directions are drawn, not chosen.
#include "registration/deform.hpp"

#include <cmath>

#include "registration/rigid_part.hpp"
#include "scenes.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

const Vec3 kIso(10, -20, -30);

// The torso of scenes.hpp with relief of a few cm, so that all six motions are told also by a part of it.
Vec3 body(double u, double v) {
  Vec3 x = torso(u, v);
  x[2] += 5 * std::sin(x[0] / 17) * std::cos(x[1] / 23) + 4 * std::sin(x[1] / 31 + 1);
  return x;
}

struct Bump {
  Vec3 centre, amount;  // mm
  double radius;        // mm
  Vec3 at(const Vec3& x) const {
    const double q = (x - centre).squaredNorm() / (radius * radius);
    return q < 1 ? Vec3((1 - q) * (1 - q) * amount) : Vec3::Zero();
  }
};

Surface ready(const Surface& s) {
  return estimate_normals(kSilent, s, NormalsOptions{});
}

Surface bent(Surface s, const Bump& bump) {
  for (Eigen::Index i = 0; i < s.size(); ++i) s.points.row(i) += bump.at(s.point(i)).transpose();
  return s;
}

struct Outcome {
  double rigid_mm, error_mm;  // of rigid ICP and of the answer
  DeformResult result;
};

double error_of(const IcpResult& r, const Pose& truth) {
  return (about(r.reference_from_live * truth, kIso).t).norm();
}

Outcome trial(const Bump& bump, double noise, Draw& draw, DeformMode mode = DeformMode::kRigid) {
  const Surface reference = ready(sample(body, 5000, noise, draw));
  const Pose D = displacement(3, 1, kIso, draw);
  Surface live = sample(body, 5000, 0, draw);
  live = moved(bent(std::move(live), bump), D);
  for (Eigen::Index i = 0; i < live.size(); ++i) live.points.row(i) += noise * gauss3(draw).transpose();
  live.sigma = Eigen::VectorXd::Constant(live.size(), noise);
  live = ready(live);
  DeformOptions o;
  o.mode = mode;
  Outcome out;
  out.rigid_mm = error_of(align(kSilent, reference, live, kIso, nullptr, Pose{}, o.icp), D);
  out.result = deform_align(kSilent, reference, live, kIso, nullptr, Pose{}, o);
  out.error_mm = error_of(out.result.icp, D);
  return out;
}

// REQ-DEFORM-001
TEST(Deform, ABreathOrAnExpressionDoesNotMoveTheIsocentre) {
  Draw draw(1);
  double worst = 0, rigid = 0;
  for (int i = 0; i < 6; ++i) {
    const Bump bump{body(draw.uniform(0.2, 0.8), draw.uniform(0.2, 0.8)), draw.uniform(1, 3) * draw.direction(),
                    draw.uniform(60, 100)};
    const Outcome o = trial(bump, 0.4, draw);
    ASSERT_EQ(o.result.icp.status, Status::kOk) << o.result.icp.message;
    worst = std::max(worst, o.error_mm);
    rigid = std::max(rigid, o.rigid_mm);
    EXPECT_GT(o.result.rigid_share, 0.6);
  }
  EXPECT_LT(worst, 0.3);
  EXPECT_GT(rigid, worst);
}

TEST(Deform, WithoutADeformationItIsTheRigidAnswer) {
  Draw draw(2);
  const Outcome o = trial({Vec3::Zero(), Vec3::Zero(), 1}, 0.3, draw);
  ASSERT_EQ(o.result.icp.status, Status::kOk);
  EXPECT_EQ(o.result.icp.verdict, Verdict::kOk) << o.result.icp.verdict_words;
  EXPECT_GT(o.result.rigid_share, 0.95);
  EXPECT_LT(o.result.structure, 0.05);
  EXPECT_LT(o.error_mm, 0.15);
  EXPECT_EQ(o.result.scale, 1);
}

// REQ-DEFORM-002
TEST(Deform, SaysThatItCannotTell) {
  Draw draw(3);
  // Most of the body swells: what stays is a rim.
  const Outcome o = trial({Vec3(0, 0, 20), Vec3(0, 0.5, 3), 230}, 0.3, draw);
  EXPECT_TRUE(o.result.icp.status == Status::kNotFound || o.result.icp.status == Status::kDegenerate);
  EXPECT_NE(o.result.icp.message.find("cannot tell the rigid motion"), std::string::npos) << o.result.icp.message;
  EXPECT_TRUE(std::isnan(o.result.icp.displacement.lat_mm));
  EXPECT_TRUE(std::isnan(o.result.icp.reference_from_live.R(0, 0)));
  EXPECT_TRUE(std::isnan(o.result.icp.covariance(5, 5)));
}

TEST(Deform, MarksWhatChangedItsShape) {
  Draw draw(4);
  const Bump bump{Vec3(60, 60, 20), Vec3(0, 0, 3), 80};
  const Outcome o = trial(bump, 0.3, draw);
  ASSERT_EQ(o.result.icp.status, Status::kOk);
  int moved_right = 0, moved_all = 0, still_right = 0, still_all = 0;
  for (std::size_t i = 0; i < o.result.rigid.size(); ++i) {
    if (o.result.rigid[i] == 255) continue;
    const double d = o.result.icp.distance[static_cast<Eigen::Index>(i)];
    if (d > 2) {
      ++moved_all;
      moved_right += o.result.rigid[i] == 0;
    } else if (d < 0.5) {
      ++still_all;
      still_right += o.result.rigid[i] == 1;
    }
  }
  EXPECT_GT(moved_all, 50);
  EXPECT_GT(moved_right, 0.95 * moved_all);
  EXPECT_GT(still_right, 0.85 * still_all);
}

TEST(Deform, TheFieldIsTheDeformation) {
  Draw draw(5);
  const Bump bump{Vec3(60, 60, 20), Vec3(0, 0, 4), 90};
  const Surface reference = ready(sample(body, 6000, 0.2, draw));
  const Surface plain = sample(body, 6000, 0, draw);
  const Surface live = ready(bent(plain, bump));
  DeformOptions o;
  o.mode = DeformMode::kField;
  const DeformResult r = deform_align(kSilent, reference, live, kIso, nullptr, Pose{}, o);
  ASSERT_EQ(r.icp.status, Status::kOk) << r.icp.message;
  double sum2 = 0, most = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < live.size(); ++i) {
    most = std::max(most, std::abs(live.normal(i).dot(bump.at(plain.point(i)))));
    const Vec3 u = r.deformation.row(i).transpose();
    if (!u.allFinite()) continue;
    const double error = live.normal(i).dot(u - bump.at(plain.point(i)));  // along the skin nothing is seen
    sum2 += error * error;
    ++count;
  }
  EXPECT_GT(count, 5000);
  EXPECT_LT(std::sqrt(sum2 / count), 0.25);
  EXPECT_GT(most, 2);
  EXPECT_NEAR(r.deformation_max, most, 0.2 * most);
}

TEST(Deform, TheScaleOfAPatientWhoGrew) {
  Draw draw(6);
  for (const double scale : {0.93, 1.0, 1.06}) {
    const Surface reference = ready(sample(body, 5000, 0.2, draw));
    Surface live = sample(body, 5000, 0, draw);
    for (Eigen::Index i = 0; i < live.size(); ++i) {
      live.points.row(i) = (kIso + (live.point(i) - kIso) / scale).transpose();
    }
    const Pose D = displacement(3, 1, kIso, draw);
    live = ready(moved(std::move(live), D));
    DeformOptions o;
    o.mode = DeformMode::kSimilarity;
    const DeformResult r = deform_align(kSilent, reference, live, kIso, nullptr, Pose{}, o);
    ASSERT_EQ(r.icp.status, Status::kOk) << r.icp.message;
    EXPECT_NEAR(r.scale, scale, 6 * r.scale_sigma + 1e-4);
    EXPECT_LT(r.scale_sigma, 2e-3);
    EXPECT_LT(r.icp.verdict_words.size(), 200U);
    // Live is scaled about the isocentre first.
    const Vec3 x(50, 60, 30), grown = D * Vec3(kIso + (x - kIso) / scale);
    EXPECT_LT((r.icp.reference_from_live * Vec3(kIso + r.scale * (grown - kIso)) - x).norm(), 0.25);
  }
}

TEST(Deform, Nonsense) {
  Draw draw(7);
  const Surface s = ready(sample(body, 600, 0.1, draw));
  const auto with = [&](auto change) {
    DeformOptions o;
    change(o);
    deform_align(kSilent, s, s, kIso, nullptr, Pose{}, o);
  };
  const double nan = std::nan("");
  expect_error(Status::kInvalidArgument, "min_rigid_share", [&] { with([&](auto& o) { o.min_rigid_share = nan; }); });
  expect_error(Status::kInvalidArgument, "max_structure_mm", [&] { with([&](auto& o) { o.max_structure = -1; }); });
  expect_error(Status::kInvalidArgument, "max_rivalry", [&] { with([&](auto& o) { o.max_rivalry = 2; }); });
  expect_error(Status::kInvalidArgument, "stiffness", [&] { with([&](auto& o) { o.stiffness = 0; }); });
  expect_error(Status::kInvalidArgument, "mode", [&] { with([&](auto& o) { o.mode = static_cast<DeformMode>(5); }); });
  const Surface flat = ready(sample(plane, 3000, 0.1, draw));
  const Surface board = ready(sample(plane, 3000, 0.1, draw));
  EXPECT_EQ(deform_align(kSilent, flat, board, kIso, nullptr, Pose{}, {}).icp.status, Status::kDegenerate);
  const Surface away = moved(s, Pose{Mat3::Identity(), Vec3(0, 0, 900)});
  EXPECT_EQ(deform_align(kSilent, s, away, kIso, nullptr, Pose{}, {}).icp.status, Status::kNotFound);
}

// Coherent heights are seen at a tenth of the noise of a patch; noise alone gives none.
TEST(RigidPart, StructureIsWhatNeighboursShare) {
  Draw draw(8);
  const int side = 12;
  Patches patches;
  patches.centre.resize(side * side);
  patches.area.assign(side * side, 1);
  patches.next.resize(side * side);
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      auto& next = patches.next[static_cast<std::size_t>(i * side + j)];
      if (i > 0) next.push_back((i - 1) * side + j);
      if (i + 1 < side) next.push_back((i + 1) * side + j);
      if (j > 0) next.push_back(i * side + j - 1);
      if (j + 1 < side) next.push_back(i * side + j + 1);
    }
  }
  const std::vector<std::uint8_t> all(side * side, 1);
  for (const double wave : {0.0, 0.15}) {
    Evidence e;
    e.sums.resize(side * side);
    e.variance.assign(side * side, 0.01);
    for (int k = 0; k < side * side; ++k) {
      PatchSum& s = e.sums[static_cast<std::size_t>(k)];
      s.w = 1;
      s.r = 0.1 * gauss(draw) + wave * std::sin(0.5 * (k % side)) * std::sqrt(2.0);
    }
    EXPECT_NEAR(structure_of(patches, e, all), wave, wave > 0 ? 0.05 : 0.0);
  }
}

}  // namespace
}  // namespace sgrt
