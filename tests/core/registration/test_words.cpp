// The names of free motions.
#include "registration/words.hpp"

#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

// The six basis motions: turns about X, Y, Z through c, slides along X, Y, Z; scaled.
Motions basis_of(const std::vector<int>& which, const Vec3& c) {
  Motions basis(6, static_cast<Eigen::Index>(which.size()));
  for (std::size_t i = 0; i < which.size(); ++i) {
    Vec6 m = Vec6::Zero();
    m[which[i]] = 1;
    if (which[i] < 3) m.tail<3>() = c.cross(Vec3(m.head<3>()));
    basis.col(static_cast<Eigen::Index>(i)) = scaled(m);
  }
  return basis;
}

// The same space by other vectors.
Motions mixed(const Motions& basis, Draw& draw) {
  Eigen::MatrixXd m(basis.cols(), basis.cols());
  for (Eigen::Index i = 0; i < m.size(); ++i) m(i) = draw.uniform();
  return basis * m;
}

std::vector<std::string> names(const Motions& basis) {
  std::vector<std::string> words;
  for (const FreeMotion& f : name_motions(basis, Vec3(1000, 2000, 3000))) words.push_back(f.words);
  return words;
}

using Words = std::vector<std::string>;

TEST(Words, OfMixedSpaces) {
  Draw draw(1);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(names(mixed(basis_of({3, 4, 2}, Vec3::Zero()), draw)),
              (Words{"slides along LAT", "slides along LNG", "turns about VRT (RTN)"}));
    EXPECT_EQ(names(mixed(basis_of({4, 1}, Vec3(0, 0, -80)), draw)),
              (Words{"slides along LNG", "turns about LNG (ROLL) through (1000, 2000, 2920) mm"}));
    EXPECT_EQ(names(mixed(basis_of({0, 1, 2}, Vec3(5, 7, -90)), draw)),
              (Words{"turns about LAT (PITCH) through (1005, 2007, 2910) mm",
                     "turns about LNG (ROLL) through (1005, 2007, 2910) mm",
                     "turns about VRT (RTN) through (1005, 2007, 2910) mm"}));
    EXPECT_EQ(names(mixed(basis_of({0, 1, 2, 3, 4, 5}, Vec3::Zero()), draw)).size(), 6u);
  }
  EXPECT_TRUE(names(Motions(6, 0)).empty());
}

TEST(Words, OfSlantedMotions) {
  Vec6 slide = Vec6::Zero();
  slide.tail<3>() << 0.6, -0.8, 0;
  EXPECT_EQ(names(slide), Words{"slides along -60 % LAT + 80 % LNG"});
  Vec6 screw;
  screw << 0, 0, 100, 0, 0, 50;
  EXPECT_EQ(names(screw), Words{"turns about VRT (RTN) and slides along it"});
}

TEST(Words, MotionsAreScaledToTheirLargestEntry) {
  Draw draw(2);
  for (const FreeMotion& f : name_motions(mixed(basis_of({3, 4, 2}, Vec3(30, 0, 0)), draw), Vec3::Zero())) {
    EXPECT_NEAR(scaled(f.motion).cwiseAbs().maxCoeff(), 1, 1e-12);
  }
}

}  // namespace
}  // namespace sgrt
