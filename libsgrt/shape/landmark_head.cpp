// Any adult head, from facial anthropometry (Farkas 1994: nose about 50 mm high and 35 wide, eyes' inner corners 33 mm
// apart), the tip of the nose in the origin, x to the patient's left, y to the vertex, z to the front. Curvatures are
// those of rounded forms of such sizes; only their signs and orders of magnitude count.
#include "shape/landmark_model.hpp"

namespace sgrt {
namespace {

struct Row {
  const char* name;
  double x, y, z, nx, ny, nz, k1, k2, sigma;
};
// x > 0: a pair, of which this is the left one.
constexpr Row kRows[] = {
    {"nose_apex", 0, 0, 0, 0, 0, 1, 0.11, 0.08, 3},           {"ala", 15.5, -6, -11, 0.7, -0.2, 0.7, 0.12, 0.04, 3},
    {"nasion", 0, 43, -24, 0, 0.2, 1, 0.05, -0.07, 4.5},      {"nasolabial", 22, -17, -25, 0.3, 0, 1, -0.06, -0.12, 4},
    {"nasofacial", 18.5, 9, -22, 0.3, 0, 1, -0.03, -0.12, 4}, {"chin", 0, -69, -14, 0, -0.2, 1, 0.06, 0.04, 6},
    {"eye_inner", 16.5, 35, -30, 0, 0, 1, -0.07, -0.09, 3.5},
};

// Forehead, cheek bones and the corners of the mouth, in the same frame.
struct SkinRow {
  double x, y, z, nx, ny, nz, sigma;
};
constexpr SkinRow kSkin[] = {
    {0, 73, -25, 0, 0.2, 1, 8},     {20, 72, -28, 0.25, 0.2, 0.95, 8},  {40, 75, -37, 0.5, 0.15, 0.85, 8},
    {48, 1, -40, 0.65, 0, 0.75, 7}, {32, -36, -35, 0.45, -0.1, 0.9, 7},
};

LandmarkPoint point_of(const Row& r, const std::string& name, double side) {
  LandmarkPoint p;
  p.name = name;
  p.position = Vec3(side * r.x, r.y, r.z);
  p.normal = Vec3(side * r.nx, r.ny, r.nz).normalized();
  p.k1 = r.k1, p.k2 = r.k2, p.sigma = r.sigma;
  return p;
}

}  // namespace

LandmarkModel head_model() {
  LandmarkModel m;
  m.id = "head";
  m.scale = 6;
  m.size_range = 0.2;
  for (const Row& r : kRows) {
    if (r.x == 0) {
      m.points.push_back(point_of(r, r.name, 1));
    } else {
      m.points.push_back(point_of(r, std::string(r.name) + "_left", 1));
      m.points.push_back(point_of(r, std::string(r.name) + "_right", -1));
    }
  }
  for (const SkinRow& r : kSkin) {
    m.skin.push_back({Vec3(r.x, r.y, r.z), Vec3(r.nx, r.ny, r.nz).normalized(), r.sigma});
    if (r.x > 0) m.skin.push_back({Vec3(-r.x, r.y, r.z), Vec3(-r.nx, r.ny, r.nz).normalized(), r.sigma});
  }
  return m;
}

}  // namespace sgrt
