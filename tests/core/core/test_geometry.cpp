// SO(3) and SE(3) against each other, against Eigen's own rotations and against a matrix exponential by its series; the
// two rigid fits against each other and against the truth.
#include "core/geometry.hpp"

#include <cmath>
#include <limits>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

constexpr double kPi = 3.14159265358979323846;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// exp of a 4 x 4 twist by scaling, the Taylor series and squaring, in long double: an independent way.
Mat4 series_exp(const Vec6& xi) {
  using Wide = Eigen::Matrix<long double, 4, 4>;
  Mat4 twist = Mat4::Zero();
  twist.topLeftCorner<3, 3>() = skew(xi.head<3>());
  twist.topRightCorner<3, 1>() = xi.tail<3>();
  const Wide A = twist.cast<long double>() / 1024;
  Wide sum = Wide::Identity(), term = Wide::Identity();
  for (int k = 1; k < 30; ++k) {
    term = (term * A / k).eval();
    sum += term;
  }
  for (int k = 0; k < 10; ++k) sum = (sum * sum).eval();
  return sum.cast<double>();
}

double angle_of(int kind, Draw& draw) {
  switch (kind) {
    case 0:
      return 0;
    case 1:
      return std::pow(10, draw.uniform(-300, -8));
    case 2:
      return std::pow(10, draw.uniform(-9, 0));
    case 3:
      return draw.uniform(0, kPi);
    case 4:
      return 0.1 * (1 + draw.uniform(-1e-3, 1e-3));  // round the switch of the series
    default:
      return kPi - std::pow(10, draw.uniform(-14, -1));
  }
}

Vec6 draw_twist(int kind, Draw& draw) {
  Vec6 xi;
  xi << angle_of(kind, draw) * draw.direction(), draw.vec3(300);
  return xi;
}

TEST(Geometry, ExpIsTheMatrixExponential) {
  Draw draw(1);
  for (int i = 0; i < 3000; ++i) {
    const Vec6 xi = draw_twist(i % 6, draw);
    const Pose T = se3_exp(xi);
    const Mat4 expected = series_exp(xi);
    EXPECT_LT((T.R - Mat3(expected.block(0, 0, 3, 3))).norm(), 2e-15);
    EXPECT_LT((T.matrix() - expected).norm(), 1e-12);
    EXPECT_LT((T.R - so3_exp(xi.head<3>())).norm(), 1e-15);
    EXPECT_LT((T.R.transpose() * T.R - Mat3::Identity()).norm(), 4e-15);
  }
}

TEST(Geometry, ExpIsEigensRotation) {
  Draw draw(2);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 axis = draw.direction();
    const double angle = draw.uniform(-7, 7);
    EXPECT_LT((so3_exp(axis * angle) - Eigen::AngleAxisd(angle, axis).toRotationMatrix()).norm(), 3e-15);
  }
}

TEST(Geometry, LogUndoesExp) {
  Draw draw(3);
  for (int i = 0; i < 30000; ++i) {
    const Vec6 xi = draw_twist(i % 6, draw);
    const Vec6 back = se3_log(se3_exp(xi));
    EXPECT_LT((back - xi).head<3>().norm(), 1e-14 + 1e-15 * xi.head<3>().norm()) << xi.transpose();
    EXPECT_LT((back - xi).tail<3>().norm(), 1e-12) << xi.transpose();
  }
}

TEST(Geometry, LogKeepsRelativePrecisionOfTinyTurns) {
  for (double angle : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    const Vec3 w = angle * Vec3(1, -2, 2) / 3;
    EXPECT_LT((so3_log(so3_exp(w)) - w).norm(), 4e-16 * std::max(angle, 1e-1) + 1e-16 * angle) << angle;
  }
}

TEST(Geometry, LogAtPi) {
  for (const Vec3& axis :
       {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 1, 0).normalized(), Vec3(-1, 2, 3).normalized()}) {
    const Mat3 half_turn = 2 * axis * axis.transpose() - Mat3::Identity();
    const Vec3 w = so3_log(half_turn);
    EXPECT_NEAR(w.norm(), kPi, 1e-15);
    EXPECT_LE(w.norm(), kPi);
    EXPECT_LT((so3_exp(w) - half_turn).norm(), 1e-15);
  }
}

TEST(Geometry, ExpUndoesLogBeyondPi) {
  Draw draw(4);
  for (int i = 0; i < 1000; ++i) {
    Vec6 xi;
    xi << draw.uniform(kPi, 20) * draw.direction(), draw.vec3(300);
    const Pose T = se3_exp(xi), again = se3_exp(se3_log(T));
    EXPECT_LE(so3_log(T.R).norm(), kPi);
    EXPECT_LT((T.matrix() - again.matrix()).norm(), 1e-11);
  }
}

TEST(Geometry, AdjointMovesTwists) {
  Draw draw(5);
  for (int i = 0; i < 1000; ++i) {
    const Pose T = se3_exp(draw_twist(3, draw));
    const Vec6 xi = draw_twist(2 + i % 2, draw);
    const Pose conjugate = T * se3_exp(xi) * T.inverse();
    const Vec6 moved = adjoint(T) * xi;
    EXPECT_LT((conjugate.matrix() - se3_exp(moved).matrix()).norm(), 3e-12);
  }
}

TEST(Geometry, PosesComposeAndInvert) {
  Draw draw(6);
  for (int i = 0; i < 100; ++i) {
    const Pose A = se3_exp(draw_twist(3, draw)), B = se3_exp(draw_twist(3, draw));
    const Vec3 x = draw.vec3(500), pivot = draw.vec3(500);
    EXPECT_LT(((A * B) * x - A * (B * x)).norm(), 1e-12);
    EXPECT_LT((A.inverse() * (A * x) - x).norm(), 1e-12);
    EXPECT_LT((about(A, pivot) * x - (A * (x + pivot) - pivot)).norm(), 1e-12);
    EXPECT_LT(((A * B).matrix() - A.matrix() * B.matrix()).norm(), 1e-12);
  }
}

TEST(Geometry, RowsRoundTrip) {
  Draw draw(7);
  for (int i = 0; i < 200; ++i) {
    double rows[16], again[16];
    pose_to_rows(se3_exp(draw_twist(3, draw)), rows);
    EXPECT_EQ(rows[12], 0);
    EXPECT_EQ(rows[15], 1);
    const Pose pose = pose_from_rows(rows, "T");
    EXPECT_LT((pose.R.transpose() * pose.R - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-15);
    pose_to_rows(pose, again);
    for (int k = 0; k < 16; ++k) EXPECT_NEAR(again[k], rows[k], 1e-15);
  }
}

TEST(Geometry, RowsAreProjectedOntoARotation) {
  Draw draw(8);
  for (int i = 0; i < 200; ++i) {
    const Pose truth = se3_exp(draw_twist(3, draw));
    Mat3 noise;
    for (int k = 0; k < 9; ++k) noise(k) = draw.uniform(-1, 1) * 1e-7;
    double rows[16];
    pose_to_rows({truth.R + noise, truth.t}, rows);
    const Pose pose = pose_from_rows(rows, "T");
    EXPECT_LT((pose.R.transpose() * pose.R - Mat3::Identity()).norm(), 2e-15);
    const Eigen::JacobiSVD<Mat3> svd(truth.R + noise, Eigen::ComputeFullU | Eigen::ComputeFullV);
    EXPECT_LT((pose.R - svd.matrixU() * svd.matrixV().transpose()).norm(), 3e-15);  // the nearest rotation
    EXPECT_EQ(pose.t, truth.t);
    pose_to_rows(pose, rows);
    EXPECT_EQ(pose_from_rows(rows, "T").R, pose.R);  // to the last bit
  }
}

// REQ-FRAME-007
TEST(Geometry, RowsThatAreNoMotion) {
  double good[16];
  pose_to_rows(Pose{}, good);
  const auto with = [&](int index, double value, const char* words) {
    double rows[16];
    std::copy(good, good + 16, rows);
    rows[index] = value;
    expect_error(Status::kInvalidArgument, words, [&] { pose_from_rows(rows, "reference_from_live"); });
  };
  for (int i = 0; i < 16; ++i) {
    with(i, kNaN, "reference_from_live: expected 16 finite");
    with(i, std::numeric_limits<double>::infinity(), "finite");
  }
  with(0, 1 + 1e-5, "differs from the identity by");
  with(0, -1, "reflection");
  with(0, 0, "not a rigid motion");
  with(1, 1e300, "not a rigid motion");
  with(12, 1, "last row");
  with(15, 2, "last row");
}

Points draw_points(Eigen::Index n, double scale, const Vec3& centre, Draw& draw) {
  Points p(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) p.row(i) = (centre + draw.vec3(scale)).transpose();
  return p;
}

Points moved(const Pose& T, const Points& p) {
  return (p * T.R.transpose()).rowwise() + T.t.transpose();
}

TEST(RigidFit, ExactMotion) {
  Draw draw(9);
  for (int i = 0; i < 500; ++i) {
    const Pose truth = se3_exp(draw_twist(i % 6, draw));
    const Points p = draw_points(3 + i % 40, 100, draw.vec3(500), draw), q = moved(truth, p);
    Eigen::VectorXd w;
    if (i % 2) {
      w.resize(p.rows());
      for (auto& value : w) value = draw.uniform(0.1, 3);
    }
    for (const Pose& fit : {rigid_fit_svd(p, q, w), rigid_fit_quaternion(p, q, w)}) {
      EXPECT_LT((moved(fit, p) - q).cwiseAbs().maxCoeff(), 1e-10);
      EXPECT_LT((fit.R - truth.R).norm(), 1e-9);  // three points may lie nearly on a line
    }
  }
}

TEST(RigidFit, BothAgreeOnNoisyWeightedData) {
  Draw draw(10);
  for (int i = 0; i < 500; ++i) {
    const Points p = draw_points(20, 100, draw.vec3(500), draw);
    const Points q = moved(se3_exp(draw_twist(3, draw)), p) + draw_points(20, i % 3 ? 1 : 80, Vec3::Zero(), draw);
    Eigen::VectorXd w(20);
    for (auto& value : w) value = draw.uniform(0, 2);
    const Pose a = rigid_fit_svd(p, q, w), b = rigid_fit_quaternion(p, q, w);
    EXPECT_LT((a.R - b.R).norm(), 1e-10);
    EXPECT_LT((a.t - b.t).norm(), 1e-10 * 500);
    EXPECT_NEAR(a.R.determinant(), 1, 1e-12);
    // A minimum: no small motion on top lowers the cost.
    const auto cost = [&](const Pose& T) { return w.dot((moved(T, p) - q).rowwise().squaredNorm()); };
    for (int k = 0; k < 6; ++k) {
      for (double sign : {-1.0, 1.0}) {
        Vec6 step = Vec6::Zero();
        step(k) = sign * (k < 3 ? 1e-5 : 1e-3);
        EXPECT_GT(cost(a * se3_exp(step)), cost(a));
      }
    }
  }
}

TEST(RigidFit, WeightZeroIsNoPair) {
  Draw draw(11);
  const Pose truth = se3_exp(draw_twist(3, draw));
  Points p = draw_points(10, 100, Vec3::Zero(), draw), q = moved(truth, p);
  q.row(4) << 1e4, -1e4, 3e3;
  Eigen::VectorXd w = Eigen::VectorXd::Ones(10);
  w(4) = 0;
  for (auto fit : {rigid_fit_svd, rigid_fit_quaternion}) {
    EXPECT_LT((fit(p, q, w).R - truth.R).norm(), 1e-12);
    w.setZero();
    w.head(2).setOnes();
    expect_error(Status::kInsufficientData, "got 2", [&] { fit(p, q, w); });
    w.setOnes();
    w(4) = 0;
  }
}

TEST(RigidFit, ReflectedPointsGiveARotation) {
  Draw draw(12);
  for (int i = 0; i < 100; ++i) {
    Points p = draw_points(30, 100, Vec3::Zero(), draw);
    p.col(2) *= 0.2;
    Points q = p;
    q.col(2) *= -1;  // the mirror image: the best rotation keeps the flat cloud where it is
    const Pose a = rigid_fit_svd(p, q), b = rigid_fit_quaternion(p, q);
    EXPECT_NEAR(a.R.determinant(), 1, 1e-12);
    EXPECT_LT((a.R - b.R).norm(), 1e-10);
    EXPECT_LT(so3_log(a.R).norm(), 0.4);
  }
}

TEST(RigidFit, PlaneIsEnough) {
  Draw draw(13);
  const Pose truth = se3_exp(draw_twist(3, draw));
  Points p = draw_points(30, 100, Vec3::Zero(), draw);
  p.col(2).setConstant(7);
  const Points q = moved(truth, p);
  EXPECT_LT((rigid_fit_svd(p, q).R - truth.R).norm(), 1e-12);
  EXPECT_LT((rigid_fit_quaternion(p, q).R - truth.R).norm(), 1e-12);
}

TEST(RigidFit, LeavesATurnFree) {
  Draw draw(14);
  for (auto fit : {rigid_fit_svd, rigid_fit_quaternion}) {
    for (int i = 0; i < 100; ++i) {
      const Vec3 from = draw.vec3(i % 2 ? 1e4 : 0), along = draw.direction();
      Points line(20, 3);
      for (int k = 0; k < 20; ++k) line.row(k) = (from + draw.uniform(-100, 100) * along).transpose();
      const Points q = moved(se3_exp(draw_twist(3, draw)), line), cloud = draw_points(20, 100, from, draw);
      expect_error(Status::kDegenerate, "line", [&] { fit(line, q, {}); });
      expect_error(Status::kDegenerate, "line", [&] { fit(cloud, line, {}); });
      expect_error(Status::kDegenerate, "coincide", [&] { fit(from.transpose().replicate(20, 1), cloud, {}); });
      expect_error(Status::kDegenerate, "coincide", [&] { fit(cloud, from.transpose().replicate(20, 1), {}); });
    }
    // A symmetric cloud and its mirror image: every turn about the axis of symmetry is as good.
    Points p(6, 3);
    p << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
    expect_error(Status::kDegenerate, "", [&] { fit(p, -p, {}); });
  }
}

TEST(RigidFit, Nonsense) {
  Draw draw(15);
  const Points p = draw_points(5, 100, Vec3::Zero(), draw);
  for (auto fit : {rigid_fit_svd, rigid_fit_quaternion}) {
    for (int n : {0, 1, 2}) {
      expect_error(Status::kInsufficientData, "got " + std::to_string(n), [&] { fit(p.topRows(n), p.topRows(n), {}); });
    }
    expect_error(Status::kInvalidArgument, "q: expected as many points as p, 5, got 4",
                 [&] { fit(p, p.topRows(4), {}); });
    expect_error(Status::kInvalidArgument, "weights: expected one a pair, 5, got 3",
                 [&] { fit(p, p, Eigen::Vector3d::Ones()); });
    for (double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
      Points broken = p;
      broken(3, 1) = bad;
      expect_error(Status::kInvalidArgument, "p[3]", [&] { fit(broken, p, {}); });
      expect_error(Status::kInvalidArgument, "q[3]", [&] { fit(p, broken, {}); });
    }
    for (double bad : {kNaN, -1.0}) {
      Eigen::VectorXd w = Eigen::VectorXd::Ones(5);
      w(2) = bad;
      expect_error(Status::kInvalidArgument, "weights[2]", [&] { fit(p, p, w); });
    }
  }
}

}  // namespace
}  // namespace sgrt
