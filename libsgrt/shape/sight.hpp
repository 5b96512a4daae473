// What lies on the lines of sight of the sensor that saw a surface: a place before the skin it saw is empty, one behind
// it is hidden. The direction of sight is the mean normal's, as a surface does not say where its sensor was.
// docs/theory/landmarks.md eq. 8.
#pragma once

#include <vector>

#include "core/surface.hpp"

namespace sgrt {

class Sight {
 public:
  Sight(const Surface& surface, double spacing);

  // Unit direction to the sensor; nil for a closed body, of which nothing can be said.
  const Vec3& towards() const { return towards_; }
  // mm that x lies before the foremost skin about its line of sight, negative behind it; NaN where there is no skin.
  double before_skin(const Vec3& x) const;

 private:
  Vec3 towards_;
  Eigen::Matrix<double, 2, 3> plane_;
  Vec2 corner_;
  double cell_ = 1;
  Eigen::Index columns_ = 0, rows_ = 0;
  std::vector<double> front_;  // mm along towards_, of the foremost skin in a cell; NaN: none
};

}  // namespace sgrt
