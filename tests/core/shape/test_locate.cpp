// Landmarks located: forms of all patients by their constellation, a patient's own by the skin about them; found in any
// pose, as sure as they say, and never invented.
#include "shape/locate.hpp"

#include <cmath>
#include <vector>

#include "shape/surfaces.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::normal_draw;

// A bump (height > 0) or dent of the skin z(x, y) = sum h exp(-r^2 / 2 s^2).
struct Form {
  double x, y, height, width;
};

const std::vector<Form> kForms = {{-42, -33, 6, 7}, {38, -40, 7, 8}, {44, 26, -6, 7},  {-30, 40, 7, 7}, {2, -2, -7, 8},
                                  {-46, 4, -5, 7},  {8, 44, 6, 8},   {12, -36, -6, 7}, {28, 2, 5, 7}};

double height_at(const std::vector<Form>& forms, double x, double y, Vec3* normal) {
  double z = 0, zx = 0, zy = 0;
  for (const Form& f : forms) {
    const double dx = x - f.x, dy = y - f.y, s2 = f.width * f.width;
    const double e = f.height * std::exp(-(dx * dx + dy * dy) / (2 * s2));
    z += e, zx -= e * dx / s2, zy -= e * dy / s2;
  }
  *normal = Vec3(-zx, -zy, 1).normalized();
  return z;
}

// Skin of these forms over [x0, x1] x [-58, 58], scaled, then moved, with noise along the normal.
Surface skin(const std::vector<Form>& forms, const Pose& pose, double size, double noise, Draw& draw, double x0 = -58,
             double x1 = 58) {
  const double step = 1.6;
  std::vector<Vec3> points, normals;
  for (double x = x0; x <= x1; x += step) {
    for (double y = -58; y <= 58; y += step) {
      Vec3 n;
      const double z = height_at(forms, x, y, &n);
      points.push_back(pose * Vec3(size * Vec3(x, y, z)) + noise * normal_draw(draw) * (pose.R * n));
      normals.push_back(pose.R * n);
    }
  }
  Surface s;
  s.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  s.normals.resize(s.points.rows(), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    s.points.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
    s.normals.row(static_cast<Eigen::Index>(i)) = normals[i].transpose();
  }
  return s;
}

Vec3 top_of(const Form& f) {
  return Vec3(f.x, f.y, f.height);
}

// What all patients share: each place known to sigma.
LandmarkModel constellation(double sigma) {
  LandmarkModel m;
  m.id = "forms";
  m.scale = 5;
  m.size_range = 0.1;
  for (std::size_t i = 0; i < kForms.size(); ++i) {
    const Form& f = kForms[i];
    const double k = f.height / (f.width * f.width);
    LandmarkPoint p;
    p.name = "form" + std::to_string(i);
    p.position = top_of(f), p.normal = Vec3(0, 0, 1);
    p.k1 = p.k2 = k;
    p.sigma = sigma;
    m.points.push_back(p);
  }
  return m;
}

const Pose kPoses[] = {{Mat3::Identity(), Vec3::Zero()},
                       {so3_exp(Vec3(0.3, -0.5, 1.9)), Vec3(40, -700, 12)},
                       {so3_exp(Vec3(-2.2, 0.4, 0.8)), Vec3(-3, 5, 900)}};

// REQ-LMK-001
TEST(Locate, FormsOfAllPatientsInAnyPoseAndSize) {
  Draw draw(31);
  const LandmarkModel model = constellation(2);
  for (const Pose& pose : kPoses) {
    for (const double size : {0.94, 1.0, 1.06}) {
      const LocatedLandmarks found = locate(sgrt::Run{}, skin(kForms, pose, size, 0.1, draw), model, {});
      ASSERT_EQ(found.status, Status::kOk) << found.message;
      EXPECT_GT(found.score, size == 1 ? 0.8 : 0.6);
      EXPECT_NEAR(found.size, size, 0.02);
      EXPECT_EQ(found.seen, 9);
      EXPECT_EQ(found.matched, 9);
      for (std::size_t i = 0; i < kForms.size(); ++i) {
        ASSERT_TRUE(found.points[i].found) << i;
        EXPECT_LT((found.points[i].position - pose * Vec3(size * top_of(kForms[i]))).norm(), 1) << i;
        EXPECT_LT((found.live_from_model * Vec3(found.size * top_of(kForms[i])) - pose * Vec3(size * top_of(kForms[i])))
                      .norm(),
                  2)
            << i;
      }
    }
  }
}

TEST(Locate, IsAsSureAsItSays) {
  Draw draw(32);
  const double sigma = 2;
  int inside = 0, all = 0;
  for (int trial = 0; trial < 12; ++trial) {
    // A patient whose forms lie elsewhere by sigma in the tangent plane.
    std::vector<Form> forms = kForms;
    for (Form& f : forms) f.x += sigma * normal_draw(draw), f.y += sigma * normal_draw(draw);
    const LocatedLandmarks found = locate(sgrt::Run{}, skin(forms, kPoses[1], 1, 0.4, draw), constellation(sigma), {});
    ASSERT_EQ(found.status, Status::kOk) << found.message;
    for (std::size_t i = 0; i < forms.size(); ++i) {
      if (!found.points[i].found) continue;
      const Vec3 d = found.points[i].position - kPoses[1] * top_of(forms[i]);
      const Eigen::LDLT<Mat3> covariance(found.points[i].covariance);
      ASSERT_TRUE(covariance.isPositive());
      ++all;
      inside += d.dot(covariance.solve(d)) < 7.815;  // chi-squared, 3 degrees of freedom, 95 %
    }
  }
  EXPECT_GE(all, 100);
  EXPECT_GT(inside, 0.88 * all) << inside << " of " << all;
}

TEST(Locate, WhatIsNotInViewIsNan) {
  Draw draw(33);
  // Three of nine forms lie beyond x = 20.
  const LocatedLandmarks found =
      locate(sgrt::Run{}, skin(kForms, kPoses[1], 1, 0.1, draw, -58, 20), constellation(2), {});
  ASSERT_EQ(found.status, Status::kOk) << found.message;
  for (std::size_t i = 0; i < kForms.size(); ++i) {
    EXPECT_EQ(found.points[i].found, kForms[i].x < 20) << i;
    EXPECT_EQ(std::isnan(found.points[i].position[0]), !found.points[i].found);
    EXPECT_EQ(std::isnan(found.points[i].covariance(2, 2)), !found.points[i].found);
  }
}

// REQ-LMK-002
TEST(Locate, SkinBetweenTheFormsTells) {
  Draw draw(38);
  LandmarkModel model = constellation(2);
  const Vec2 between[] = {{-16, 22}, {22, -20}, {-20, -16}, {24, 22}, {-10, -48}};
  for (const Vec2& at : between) model.skin.push_back({Vec3(at[0], at[1], 0), Vec3(0, 0, 1), 3});
  const LocatedLandmarks right = locate(sgrt::Run{}, skin(kForms, kPoses[1], 1, 0.1, draw), model, {});
  ASSERT_EQ(right.status, Status::kOk) << right.message;
  EXPECT_GT(right.score, 0.8);
  // The same forms on skin that rises between them.
  std::vector<Form> risen = kForms;
  for (const Vec2& at : between) risen.push_back({at[0], at[1], 14, 6});
  const LocatedLandmarks other = locate(sgrt::Run{}, skin(risen, kPoses[1], 1, 0.1, draw), model, {});
  EXPECT_LT(other.score, 0.9 * right.score);
  // Places beyond the surface: they should be in view and are not.
  LandmarkModel wide = model;
  for (SkinPlace& p : wide.skin) p.position *= 6;
  const LocatedLandmarks missing = locate(sgrt::Run{}, skin(kForms, kPoses[1], 1, 0.1, draw), wide, {});
  EXPECT_LT(missing.score, 0.9 * right.score);
}

void expect_nothing(const LocatedLandmarks& found, const char* why) {
  EXPECT_EQ(found.status, Status::kNotFound);
  EXPECT_NE(found.message.find(why), std::string::npos) << found.message;
  EXPECT_TRUE(std::isnan(found.live_from_model.t[0]) && std::isnan(found.live_from_model.R(0, 0)));
  EXPECT_TRUE(std::isnan(found.size));
  for (const Landmark& l : found.points) {
    EXPECT_FALSE(l.found);
    EXPECT_TRUE(std::isnan(l.position[0]) && std::isnan(l.covariance(0, 0)) && std::isnan(l.repeat_covariance(0, 0)));
  }
}

std::vector<Form> shifted(const std::vector<Form>& forms, double x) {
  std::vector<Form> out = forms;
  for (Form& f : out) f.x += x;
  return out;
}

// REQ-LMK-002
TEST(Locate, InventsNothing) {
  Draw draw(34);
  const LandmarkModel model = constellation(2);
  expect_nothing(locate(sgrt::Run{}, skin({}, kPoses[1], 1, 0.1, draw), model, {}), "not on the surface");
  std::vector<Form> mirrored = kForms;
  for (Form& f : mirrored) f.x = -f.x;
  expect_nothing(locate(sgrt::Run{}, skin(mirrored, kPoses[0], 1, 0.1, draw), model, {}), "");
  std::vector<Form> inside_out = kForms;
  for (Form& f : inside_out) f.height = -f.height;
  expect_nothing(locate(sgrt::Run{}, skin(inside_out, kPoses[0], 1, 0.1, draw), model, {}), "");
  // Twice on one surface.
  std::vector<Form> twice = shifted(kForms, -65);
  for (const Form& f : shifted(kForms, 65)) twice.push_back(f);
  expect_nothing(locate(sgrt::Run{}, skin(twice, kPoses[0], 1, 0.1, draw, -120, 120), model, {}), "in two ways");
  Surface unknown = skin(kForms, kPoses[0], 1, 0.1, draw);
  unknown.normals.setConstant(std::nan(""));
  expect_nothing(locate(sgrt::Run{}, unknown, model, {}), "nowhere on the surface is the curvature known");
}

TEST(Locate, OwnSkinInAnyPose) {
  Draw draw(35);
  const Surface reference = skin(kForms, kPoses[0], 1, 0.1, draw);
  const LandmarkModel all_patients = constellation(2);
  LearnOptions learning;
  learning.count = 9;
  const LandmarkModel named = learn_model(sgrt::Run{}, reference, &all_patients, learning);
  ASSERT_EQ(named.points.size(), 9u);
  EXPECT_EQ(named.points[3].name, "form3");
  EXPECT_EQ(named.id, "forms of a reference");
  for (std::size_t i = 0; i < 9; ++i) {
    const Vec3 d = named.points[i].position - top_of(kForms[i]);
    EXPECT_LT(d.norm(), 1) << i;
    EXPECT_LT(d.dot((named.points[i].place_covariance + 1e-6 * Mat3::Identity()).inverse() * d), 20) << i;
  }
  const LandmarkModel distinct = learn_model(sgrt::Run{}, reference, nullptr, learning);
  EXPECT_GE(distinct.points.size(), 7u);
  for (const LandmarkModel* model : {&named, &distinct}) {
    for (const Pose& pose : kPoses) {
      const LocatedLandmarks found = locate(sgrt::Run{}, skin(kForms, pose, 1, 0.2, draw), *model, {});
      ASSERT_EQ(found.status, Status::kOk) << found.message;
      EXPECT_GT(found.score, 0.9);
      EXPECT_EQ(found.size, 1);
      for (std::size_t i = 0; i < model->points.size(); ++i) {
        const Landmark& l = found.points[i];
        ASSERT_TRUE(l.found);
        const Vec3 d = l.position - pose * model->points[i].position;
        EXPECT_LT(d.norm(), 0.3) << i;
        EXPECT_LT(d.dot(l.repeat_covariance.inverse() * d), 25) << i;
        EXPECT_GE((l.covariance - l.repeat_covariance).trace(), 0);
      }
    }
  }
}

TEST(Locate, AnothersSkinIsNotOnesOwn) {
  Draw draw(36);
  LearnOptions learning;
  learning.count = 9;
  const LandmarkModel own = learn_model(sgrt::Run{}, skin(kForms, kPoses[0], 1, 0.1, draw), nullptr, learning);
  std::vector<Form> other = kForms;  // forms alike in other places
  for (std::size_t i = 0; i < other.size(); ++i) std::swap(other[i].x, other[(5 * i + 3) % other.size()].y);
  expect_nothing(locate(sgrt::Run{}, skin(other, kPoses[1], 1, 0.1, draw), own, {}), "skin is not on the surface");
  expect_nothing(locate(sgrt::Run{}, skin(kForms, kPoses[1], 1.2, 0.1, draw), own, {}), "skin is not on the surface");
  std::vector<Form> twice = shifted(kForms, -65);
  for (const Form& f : shifted(kForms, 65)) twice.push_back(f);
  expect_nothing(locate(sgrt::Run{}, skin(twice, kPoses[0], 1, 0.1, draw, -120, 120), own, {}), "in two ways");
}

TEST(Locate, LearningNeedsPlacesThatStandOut) {
  Draw draw(37);
  const Surface flat = skin({}, kPoses[0], 1, 0.1, draw);
  test::expect_error(Status::kNotFound, "too few places that stand out",
                     [&] { learn_model(sgrt::Run{}, flat, nullptr, {}); });
  const LandmarkModel model = constellation(2);
  test::expect_error(Status::kNotFound, "not on the surface", [&] { learn_model(sgrt::Run{}, flat, &model, {}); });
  LearnOptions few;
  few.count = 3;
  test::expect_error(Status::kInvalidArgument, "count: 3", [&] { learn_model(sgrt::Run{}, flat, nullptr, few); });
}

}  // namespace
}  // namespace sgrt
