// What the fuzz targets share: numbers and choices drawn from the bytes that the fuzzer gives, and the promises that
// hold for every call whatever they are (docs/how-it-is-tested.md). A promise that is broken aborts the program, which
// is what a fuzzer takes for a finding.
#pragma once

#include <sgrt.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace fuzz {

inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s; last message: %s\n", promise, sgrt_last_error());
  std::abort();
}

// A known status, never SGRT_E_INTERNAL, with one line of text for a failure. Gives it back.
inline sgrt_status checked(sgrt_status status) {
  require(std::strcmp(sgrt_status_word(status), "unknown") != 0, "a status of the list");
  require(status != SGRT_E_INTERNAL, "no internal error");
  if (status == SGRT_OK) return status;
  const char* message = sgrt_last_error();
  require(message[0] != '\0' && std::strchr(message, '\n') == nullptr, "one line of message");
  return status;
}

inline bool ok(sgrt_status status) {
  return checked(status) == SGRT_OK;
}

// The options of a call with their defaults.
template <class Options>
Options defaults(sgrt_status (*init)(Options*, std::size_t)) {
  Options options;
  require(init(&options, sizeof options) == SGRT_OK, "defaults");
  return options;
}

// Reads the fuzzer's bytes from the front; zeros when they are used up.
struct Bytes {
  const std::uint8_t* data;
  std::size_t size;

  std::uint8_t byte() {
    if (size == 0) return 0;
    --size;
    return *data++;
  }

  int below(int count) { return byte() % count; }

  template <class T>
  T raw() {
    T value{};
    const std::size_t n = size < sizeof value ? size : sizeof value;
    std::memcpy(&value, data, n);
    data += n;
    size -= n;
    return value;
  }

  // Any double: small ones of one byte mostly, then what arithmetic stumbles over, then any eight bytes.
  double number() {
    const int kind = byte();
    if (kind < 160) return (byte() - 128) * std::pow(2.0, kind % 16 - 10);
    static const double kOdd[] = {0.0,
                                  -0.0,
                                  1.0,
                                  1e-3,
                                  1e-12,
                                  1e5,
                                  -1e5,
                                  99999.0,
                                  1e300,
                                  -1e300,
                                  std::numeric_limits<double>::denorm_min(),
                                  std::numeric_limits<double>::max(),
                                  std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::quiet_NaN()};
    if (kind < 224) return kOdd[kind % 15];
    return raw<double>();
  }
};

inline sgrt_view view(const std::vector<double>& values, std::int64_t a, std::int64_t b = 0, std::int64_t c = 0) {
  return sgrt_view_of(values.data(), SGRT_F64, a, b, c);
}

// A rigid motion: orthonormal and right-handed to 1e-6, finite.
inline bool rigid(const double pose[16]) {
  for (int i = 0; i < 16; ++i) {
    if (!std::isfinite(pose[i])) return false;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double dot = 0;
      for (int k = 0; k < 3; ++k) dot += pose[4 * i + k] * pose[4 * j + k];
      if (std::abs(dot - (i == j)) > 1e-6) return false;
    }
  }
  return pose[12] == 0 && pose[13] == 0 && pose[14] == 0 && pose[15] == 1;
}

inline bool all_nan(const double* values, int count) {
  for (int i = 0; i < count; ++i) {
    if (!std::isnan(values[i])) return false;
  }
  return true;
}

// A height field with bumps, so that a registration has an answer, then `changes` coordinates replaced by any number:
// rows x columns x 3.
inline std::vector<double> patch(Bytes& bytes, int rows, int columns, int changes) {
  std::vector<double> points;
  points.reserve(static_cast<std::size_t>(rows) * columns * 3);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double x = 5.0 * (j - columns / 2), y = 5.0 * (i - rows / 2);
      points.insert(points.end(), {x, y, 12 * std::cos(x / 14) * std::sin(0.6 + y / 11) - x * y / 150});
    }
  }
  for (int k = 0; k < changes && !points.empty(); ++k)
    points[bytes.raw<std::uint16_t>() % points.size()] = bytes.number();
  return points;
}

// A surface of these points: a grid, a cloud or a mesh of a few faces. NULL where the library refuses it.
inline sgrt_surface* surface(Bytes& bytes, const std::vector<double>& points, int rows, int columns) {
  auto data = defaults(sgrt_surface_data_init);
  const int kind = bytes.below(4);
  data.points = kind < 2 ? view(points, rows, columns, 3) : view(points, std::int64_t{rows} * columns, 3);
  std::vector<std::int32_t> faces;
  if (kind == 3) {
    for (int i = 0; i + 1 < rows; ++i) {
      for (int j = 0; j + 1 < columns; ++j) {
        const int a = i * columns + j;
        faces.insert(faces.end(), {a, a + 1, a + columns, a + 1, a + columns + 1, a + columns});
      }
    }
    if (bytes.below(8) == 7 && !faces.empty()) faces[bytes.byte() % faces.size()] = bytes.raw<std::int32_t>();
    data.faces = sgrt_view_of(faces.data(), SGRT_I32, static_cast<std::int64_t>(faces.size() / 3), 3, 0);
  }
  std::vector<double> sigma;
  if (bytes.below(2) == 1) {
    sigma.assign(points.size() / 3, 0.2);
    if (!sigma.empty() && bytes.below(4) == 3) sigma[bytes.byte() % sigma.size()] = bytes.number();
    data.sigma_mm = kind < 2 ? view(sigma, rows, columns) : view(sigma, static_cast<std::int64_t>(sigma.size()));
  }
  if (bytes.below(8) == 7) data.correlation_points = bytes.number();
  sgrt_surface* made = nullptr;
  const bool good = ok(sgrt_surface_create(nullptr, &data, &made));
  require(good == (made != nullptr), "a handle if and only if SGRT_OK");
  if (!good || kind == 3 || bytes.below(8) == 7) return made;
  sgrt_surface* with_normals = nullptr;
  const bool fitted = ok(sgrt_surface_estimate_normals(nullptr, made, nullptr, &with_normals));
  require(fitted == (with_normals != nullptr), "a handle if and only if SGRT_OK");
  if (!fitted) return made;
  sgrt_surface_free(made);
  return with_normals;
}

}  // namespace fuzz
