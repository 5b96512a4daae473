/* A scene whose every point is known: two 320 x 240 cameras, 150 mm apart, 1 m above a tilted plane with speckle on it,
 * rendered by cutting each pixel's ray with the plane. Nothing of the library is used. */
#ifndef SGRT_TESTS_SCENE_H
#define SGRT_TESTS_SCENE_H

#include "check.h"

enum { kWidth = 320, kHeight = 240, kPixels = kWidth * kHeight };

/* The cameras look down: x right along room X, y along -Y, z along -Z; both at (x, 0, 1000). */
static const char kSceneRig[] =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"test\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": ["
    "{\"id\": \"l\", \"image_size\": [320, 240], \"model\": \"pinhole\", \"intrinsics\": [600, 600, 159.5, 119.5],"
    " \"camera_from_room\": [[1, 0, 0, 75], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]},"
    "{\"id\": \"r\", \"image_size\": [320, 240], \"model\": \"pinhole\", \"intrinsics\": [600, 600, 159.5, 119.5],"
    " \"camera_from_room\": [[1, 0, 0, -75], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]},"
    "{\"id\": \"above l\", \"image_size\": [320, 240], \"model\": \"pinhole\", \"intrinsics\": [600, 600, 159.5, "
    "119.5],"
    " \"camera_from_room\": [[1, 0, 0, 75], [0, -1, 0, 0], [0, 0, -1, 1200], [0, 0, 0, 1]]}],"
    "\"pairs\": [{\"id\": \"pod\", \"left\": \"l\", \"right\": \"r\"},"
    "{\"id\": \"in line\", \"left\": \"l\", \"right\": \"above l\"}]}";

/* The plane z = height + 0.1 x - 0.05 y. */
static inline double plane_z(double height, double x, double y) {
  return height + 0.1 * x - 0.05 * y;
}

/* A number in [0, 1) of a lattice point. */
static inline double lattice(int i, int j) {
  uint32_t h = (uint32_t)i * 73856093u ^ (uint32_t)j * 19349663u;
  h ^= h >> 13, h *= 0x5bd1e995u, h ^= h >> 15, h *= 0x27d4eb2du;
  return (h ^ h >> 13) / 4294967296.0;
}

static inline double fade(double t) {
  return t * t * t * (t * (6 * t - 15) + 10);
}

/* Speckle of about 5 mm, which is 3 pixels. */
static inline double speckle(double x, double y) {
  const double u = x / 5, v = y / 5, i = floor(u), j = floor(v), a = fade(u - i), b = fade(v - j);
  const int m = (int)i, n = (int)j;
  return (lattice(m, n) * (1 - a) + lattice(m + 1, n) * a) * (1 - b) +
         (lattice(m, n + 1) * (1 - a) + lattice(m + 1, n + 1) * a) * b;
}

/* The grey levels, 20 to 220, that the camera at (x0, 0, 1000) sees, each the mean of 3 x 3 rays. */
static inline void render(double x0, double height, double grey[kPixels]) {
  int i, j, k;
  for (i = 0; i < kHeight; ++i) {
    for (j = 0; j < kWidth; ++j) {
      double sum = 0;
      for (k = 0; k < 9; ++k) {
        const double u = (j - 159.5 + (k % 3 - 1) / 3.0) / 600, v = -(i - 119.5 + (k / 3 - 1) / 3.0) / 600;
        /* 1000 - s = height + 0.1 (x0 + s u) - 0.05 s v */
        const double s = (1000 - height - 0.1 * x0) / (1 + 0.1 * u - 0.05 * v);
        sum += speckle(x0 + s * u, s * v);
      }
      grey[i * kWidth + j] = 20 + 200 * sum / 9;
    }
  }
}

static inline void render_u8(double x0, double height, uint8_t image[kPixels]) {
  static double grey[kPixels];
  int i;
  render(x0, height, grey);
  for (i = 0; i < kPixels; ++i) image[i] = (uint8_t)(grey[i] + 0.5);
}

static inline sgrt_view view_u8(const uint8_t image[kPixels]) {
  return sgrt_view_of(image, SGRT_U8, kHeight, kWidth, 0);
}

static inline sgrt_rig* scene_rig(void) {
  sgrt_rig* rig = NULL;
  CHECK_OK(sgrt_rig_from_json(kSceneRig, strlen(kSceneRig), &rig));
  if (!rig) exit(2);
  return rig;
}

#endif
