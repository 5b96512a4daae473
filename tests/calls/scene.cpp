// See scene.hpp. Nothing of the library is used but the light plane of the laser.
#include "scene.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace calls {
namespace {

using Vec = std::array<double, 3>;

// A height field and its normals, n x n points, `step` apart.
template <class Height>
void field(int n, double step, Height&& z, std::vector<double>& points, std::vector<double>& normals) {
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double x = step * (j - n / 2), y = step * (i - n / 2), h = 1e-4;
      const double zx = (z(x + h, y) - z(x - h, y)) / (2 * h), zy = (z(x, y + h) - z(x, y - h)) / (2 * h);
      const double length = std::sqrt(1 + zx * zx + zy * zy);
      points.insert(points.end(), {x, y, z(x, y)});
      normals.insert(normals.end(), {-zx / length, -zy / length, 1 / length});
    }
  }
}

double lump(double u, double v) {
  return 30 * std::cos(u / 55) * std::cos(v / 80) + 6 * std::sin(u / 14 + 0.4) * std::cos(v / 18);
}

double bumps(double x, double y) {
  constexpr double kBumps[6][4] = {{-30, -25, 7, 6}, {25, -30, 6, 7}, {30, 20, -7, 7},
                                   {-20, 30, 7, 7},  {0, 0, -6, 6},   {-38, 5, -6, 7}};
  double z = 0;
  for (const auto& b : kBumps) {
    z += b[2] * std::exp(-((x - b[0]) * (x - b[0]) + (y - b[1]) * (y - b[1])) / (2 * b[3] * b[3]));
  }
  return z;
}

std::string camera(const char* id, int width, int height, double focal, double x) {
  const auto n = [](double v) { return std::to_string(v); };
  return std::string("{\"id\": \"") + id + "\", \"image_size\": [" + std::to_string(width) + ", " +
         std::to_string(height) + "], \"model\": \"pinhole\", \"intrinsics\": [" + n(focal) + ", " + n(focal) + ", " +
         n(width / 2. - 0.5) + ", " + n(height / 2. - 0.5) + "], \"camera_from_room\": [[1, 0, 0, " + n(-x) +
         "], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]}";
}

std::string rig_text() {
  return "{\"schema\": \"sgrt-rig/1\", \"id\": \"calls\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": [" +
         camera("l", kWidth, kHeight, 240, -75) + ", " + camera("r", kWidth, kHeight, 240, 75) + ", " +
         camera("cam", kLaserWidth, kLaserHeight, 180, 0) + ", " + camera("range", kTofWidth, kTofHeight, 30, 0) +
         "], \"pairs\": [{\"id\": \"pod\", \"left\": \"l\", \"right\": \"r\"}],"
         " \"lasers\": [{\"id\": \"scanner\", \"camera\": \"cam\", \"fan\": {\"point\": [300, 0, 1000], \"normal\": "
         "[0, 0, 1]},"
         " \"mirror\": {\"axis_point\": [300, 0, 1000], \"axis_direction\": [0, 1, 0],"
         " \"normal_at_zero\": [0.5969, 0, -0.8023], \"offset_mm\": 0.5}}],"
         " \"tofs\": [{\"id\": \"tof0\", \"camera\": \"range\", \"modulation_hz\": [20e6],"
         " \"tap_phase_rad\": [0, 1.5707963267948966, 3.141592653589793, 4.71238898038469], \"electrons_per_count\": "
         "2}]}";
}

// A repeatable number in [0, 1).
double chance(std::uint32_t& state) {
  state = state * 1664525U + 1013904223U;
  return (state >> 8) / 16777216.0;
}

double lattice(int i, int j) {
  std::uint32_t h = static_cast<std::uint32_t>(i) * 73856093U ^ static_cast<std::uint32_t>(j) * 19349663U;
  return chance(h = h * 0x5bd1e995U ^ h >> 13);
}

// Speckle of 12 mm, which is 3 pixels.
double speckle(double x, double y) {
  const double u = x / 12, v = y / 12, i = std::floor(u), j = std::floor(v), a = u - i, b = v - j;
  const int m = static_cast<int>(i), n = static_cast<int>(j);
  return (lattice(m, n) * (1 - a) + lattice(m + 1, n) * a) * (1 - b) +
         (lattice(m, n + 1) * (1 - a) + lattice(m + 1, n + 1) * a) * b;
}

// The plane z = 20 + 0.1 x - 0.05 y as a camera at (x0, 0, 1000) sees it.
std::vector<std::uint8_t> speckles(double x0) {
  std::vector<std::uint8_t> image(kWidth * kHeight);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    double sum = 0;
    for (int k = 0; k < 9; ++k) {
      const double u = (i % kWidth - kWidth / 2. + 0.5 + (k % 3 - 1) / 3.) / 240;
      const double v = -(i / kWidth - kHeight / 2. + 0.5 + (k / 3 - 1) / 3.) / 240;
      const double s = (1000 - 20 - 0.1 * x0) / (1 + 0.1 * u - 0.05 * v);
      sum += speckle(x0 + s * u, s * v);
    }
    image[i] = static_cast<std::uint8_t>(20 + 200 * sum / 9);
  }
  return image;
}

double ray_length(int i) {
  const double x = (i % kTofWidth - kTofWidth / 2. + 0.5) / 30, y = (i / kTofWidth - kTofHeight / 2. + 0.5) / 30;
  return std::sqrt(x * x + y * y + 1);
}

// Counts of tap k, 20,000 +- 8,000.
double tap_of(double range, int k) {
  return 20000 + 8000 * std::cos(4 * kPi * 20e6 * 1.00027 * range / 299792458e3 - k * kPi / 2);
}

// Rodrigues' formula.
Vec turned(const Vec& w, const Vec& x) {
  const double a = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), c = std::cos(a), s = std::sin(a);
  Vec y{};
  double d = 0;
  for (int i = 0; i < 3; ++i) d += w[i] / a * x[i];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    y[i] = x[i] * c + (w[j] * x[l] - w[l] * x[j]) / a * s + w[i] / a * d * (1 - c);
  }
  return y;
}

// The cameras to be calibrated: 640 x 480, the right one 100 mm to the right, turned by -0.1 about y.
void see(Sights& sights, int camera, int placement, int point, Vec x) {
  constexpr double kLens[2][4] = {{800, 805, 322, 243}, {820, 818, 315, 238}};
  if (camera == 1) x = turned({0, -0.1, 0}, {x[0] - 100, x[1], x[2]});
  const double u = x[0] / x[2], v = x[1] / x[2], radial = 1 - 0.1 * (u * u + v * v);
  const double* lens = kLens[camera];
  const double pixel[2] = {lens[0] * u * radial + lens[2], lens[1] * v * radial + lens[3]};
  if (pixel[0] < 0 || pixel[1] < 0 || pixel[0] > 639 || pixel[1] > 479) return;
  sights.index.insert(sights.index.end(), {camera, placement, point});
  sights.pixels.insert(sights.pixels.end(), pixel, pixel + 2);
}

void place_boards(Scene& s) {
  std::uint32_t seed = 12345;
  for (int i = 0; i < kCorners; ++i) s.board.insert(s.board.end(), {30. * (i % kColumns), 30. * (i / kColumns), 0});
  for (int b = 0; b < kBoards; ++b) {
    Vec w{}, t{30 + (chance(seed) - 0.5) * 120, (chance(seed) - 0.5) * 100, 500 + chance(seed) * 250};
    for (double& angle : w) angle = (chance(seed) - 0.5) * 1.2;
    for (int c = 0; c < 2; ++c) {
      for (int i = 0; i < kCorners; ++i) {
        const Vec x = turned(w, {s.board[3 * i] - 60, s.board[3 * i + 1] - 45, 0});
        see(s.sights, c, b, i, {x[0] + t[0], x[1] + t[1], x[2] + t[2]});
      }
    }
  }
  s.phantom_points = {0, 0, 0, 50, 0, 0, 0, 50, 0, 0, 0, 50, -40, 30, 20, 30, -40, -20};
  for (int c = 0; c < 2; ++c) {
    for (int i = 0; i < 6; ++i) {
      const double* p = &s.phantom_points[3 * i];
      see(s.phantom, c, 0, i, {p[0] + 5, p[1] - 7, p[2] + 600});
    }
  }
}

// The pixel of a room point in the laser's camera.
std::array<double, 2> laser_pixel(const Vec& x) {
  return {180 * x[0] / (1000 - x[2]) + kLaserWidth / 2. - 0.5, -180 * x[1] / (1000 - x[2]) + kLaserHeight / 2. - 0.5};
}

// Three places of the board before the laser's camera, and where the light of each reading crosses it.
void laser_board(Scene& s, const sgrt_rig* rig) {
  const Vec kTurn[3] = {{0.3, 0.1, 0.05}, {-0.2, 0.35, 0}, {0.1, -0.3, 0.1}};
  const Vec kPlace[3] = {{0, 0, 20}, {10, -5, 60}, {-10, 8, -30}};
  for (int b = 0; b < 3; ++b) {
    const auto room = [&](double x, double y) {
      Vec p = turned(kTurn[b], {3 * (x - 60), 3 * (y - 45), 0});
      for (int k = 0; k < 3; ++k) p[k] += kPlace[b][k];
      return p;
    };
    for (int i = 0; i < kCorners; ++i) {
      const auto pixel = laser_pixel(room(s.board[3 * i], s.board[3 * i + 1]));
      s.laser_board.index.insert(s.laser_board.index.end(), {0, b, i});
      s.laser_board.pixels.insert(s.laser_board.pixels.end(), pixel.begin(), pixel.end());
    }
    for (double angle : s.angles) {
      double plane[4];
      if (sgrt_laser_plane(rig, "scanner", angle, plane) != SGRT_OK) std::abort();
      const auto off = [&](double x, double y) {
        const Vec p = room(x, y);
        return plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] - plane[3];
      };
      for (int i = 0; i < 12; ++i) {  // off is linear in x
        const double y = 7 * i + 5, x = -off(0, y) / (off(1, y) - off(0, y));
        if (x < 5 || x > 115) continue;
        const auto pixel = laser_pixel(room(x, y));
        s.stripe_placement.push_back(b);
        s.stripe_angle.push_back(angle);
        s.stripe_pixels.insert(s.stripe_pixels.end(), pixel.begin(), pixel.end());
        s.stripe_sigma.push_back(0.05);
      }
    }
  }
}

void draw_stripes(Scene& s, const sgrt_rig* rig) {
  for (double angle : s.angles) {
    double plane[4];
    if (sgrt_laser_plane(rig, "scanner", angle, plane) != SGRT_OK) std::abort();
    const auto off = [&](double column, double row) {
      const double u = (column - kLaserWidth / 2. + 0.5) / 180, v = -(row - kLaserHeight / 2. + 0.5) / 180;
      const double d = (1000 - 20) / (1 + 0.1 * u - 0.05 * v);
      return plane[0] * d * u + plane[1] * d * v + plane[2] * (1000 - d) - plane[3];
    };
    for (int i = 0; i < kLaserHeight; ++i) {
      double low = -20, high = kLaserWidth + 20;
      const bool rises = off(high, i) > 0;
      for (int k = 0; k < 50; ++k) {
        const double middle = (low + high) / 2;
        ((off(middle, i) > 0) == rises ? high : low) = middle;
      }
      for (int j = 0; j < kLaserWidth; ++j) {
        const double d = (j - low) / 1.6;
        s.stripes.push_back(static_cast<std::uint8_t>(15.5 + 180 * std::exp(-d * d / 2)));
      }
    }
  }
}

// Squares of 12 px, blurred: a chessboard of kColumns x kRows inner corners.
std::vector<std::uint8_t> chessboard() {
  std::vector<std::uint8_t> image;
  const auto edge = [](double x) {  // the sign of sin, softened
    return std::tanh(4 * std::sin(kPi * x / 12));
  };
  for (int i = 0; i < kBoardHeight; ++i) {
    for (int j = 0; j < kBoardWidth; ++j) {
      const double x = j - 12.3, y = i - 10.4;
      const bool inside = x > 0 && y > 0 && x < 12 * (kColumns + 1) && y < 12 * (kRows + 1);
      image.push_back(static_cast<std::uint8_t>(inside ? 120 - 80 * edge(x) * edge(y) : 200));
    }
  }
  return image;
}

void fill_bodies(Scene& s) {
  for (int i = 0; i < kVoxelSide * kVoxelSide * kVoxelSide; ++i) {
    const double x = i % kVoxelSide - 11.5, y = i / kVoxelSide % kVoxelSide - 11.5,
                 z = i / (kVoxelSide * kVoxelSide) - 11.5;
    const double r = std::sqrt(x * x + y * y + z * z);
    s.voxels.push_back(static_cast<std::int16_t>(-1000 + 1000 / (1 + std::exp((r - 7) / 0.4))));
  }
  for (int i = 0; i < kSlices * kRing; ++i) {
    const double a = 2 * kPi * i / kRing;
    s.contours.insert(s.contours.end(), {10 * std::cos(a), 8 * std::sin(a), 2.5 * (i / kRing)});
  }
}

}  // namespace

Scene make_scene() {
  Scene s;
  s.rig = rig_text();
  field(kLumpSide, 5, lump, s.lump, s.lump_normals);
  s.lump_sigma.assign(kLumpSide * kLumpSide, 0.1);
  field(kBumpSide, 2.6, bumps, s.bumps, s.bump_normals);
  s.left = speckles(-75);
  s.right = speckles(75);
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < kTofPixels; ++i) {
      s.taps.push_back(static_cast<std::uint16_t>(tap_of(1500 * ray_length(i), k)));
      for (int b = 0; b < 3; ++b)
        s.tof_frames[b].push_back(static_cast<float>(tap_of((800 + 400 * b) * ray_length(i) + 12, k)));
    }
  }
  place_boards(s);
  fill_bodies(s);
  s.chessboard = chessboard();
  for (int i = 0; i < kReadings; ++i) {
    s.angles.push_back(-0.02 + 0.01 * i);
    s.times.push_back(0.1 * i);
  }
  return s;
}

void light_scene(Scene& s, const sgrt_rig* rig) {
  draw_stripes(s, rig);
  laser_board(s, rig);
}

}  // namespace calls
