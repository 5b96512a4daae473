// Time of flight: taps to phase, amplitude, offset, range along the ray (eq. 10.2), sigma by shot noise, flags, and
// points in the room; an organised surface on demand. docs/theory/tof.md.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "core/error.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "rig/rig.hpp"

namespace sgrt {

constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();

struct TofOptions {
  bool chapter_c = false;                                      // eq. 10.2 as printed: c = 3e8 m/s, no air
  double range_min = 0;                                        // mm, the window of ranges
  double range_max = kUnset;                                   // mm; NaN: range_min and one unambiguous range
  double saturation = kUnset;                                  // counts; NaN: the end of the taps' integer type
  double min_amplitude = 0;                                    // counts
  double max_phase_sigma = 0.5;                                // rad
  double max_sigma = std::numeric_limits<double>::infinity();  // mm along the ray
  double moved_tolerance = 0.004;  // of the amplitude: how far taps of a still scene may disagree beside their noise
  double max_incidence_deg = 75;   // steeper jumps to both sides are no skin
  double min_unwrap_score = 2;     // of the log-likelihood between the best two ranges
  double unwrap_tolerance = 30;    // mm, systematic, between frequencies
  int normal_window = 7;           // px, odd
};

// Taps of frames as the caller has them: frames x frequencies x taps x height x width, strides in bytes.
struct TapsView {
  enum class Type { kU16, kI16, kF32 };
  const void* data = nullptr;
  Type type = Type::kU16;
  std::array<std::int64_t, 5> shape{}, strides{};

  // The values at which a tap is clipped, below and above.
  double low() const;
  double high() const;
};

// Planes of height x width floats (frequencies of them where said), with room for eight lanes around each.
class Planes {
 public:
  void resize(std::int64_t count, std::int64_t size);
  float* plane(std::int64_t i) { return values_.data() + kMargin + i * stride_; }
  const float* plane(std::int64_t i) const { return values_.data() + kMargin + i * stride_; }
  std::int64_t count() const { return count_; }
  std::int64_t stride() const { return stride_; }

 private:
  static constexpr std::int64_t kMargin = 8;
  std::int64_t count_ = 0, stride_ = 0;
  std::vector<float> values_;
};

struct TofResult {
  Status status = Status::kOk;  // kOk or kNotFound
  std::string message;
  int width = 0, height = 0, frequencies = 0;
  Planes phase, amplitude, offset;  // a plane a frequency: rad in [0, 2 pi), counts, counts
  Planes range, sigma;              // mm along the ray, corrected; one sigma
  Planes score;                     // log-likelihood of the range over that of the next best; one frequency: none
  Planes points;                    // x, y, z in the room, mm; NaN where absent
  Planes frames;                    // how many were averaged; one frame: none
  std::vector<std::uint8_t> flags;  // bits kSaturated ... of tof/kernels.hpp; eight more than pixels
  std::array<std::int64_t, 8> flag_count{};  // pixels by bit
  std::int64_t point_count = 0;
  double range_min = 0, range_max = 0, ambiguity = 0;  // mm: the window, and one unambiguous range
  double median_sigma = 0;                             // mm, of the points
};

// Everything of a unit that does not change from frame to frame, and the buffers that do.
class TofSensor {
 public:
  // pixel_offset: mm, a number a pixel, subtracted from the range; empty: none.
  TofSensor(const Run& run, const Rig& rig, int unit, const TofOptions& options, std::vector<float> pixel_offset);
  ~TofSensor();
  TofSensor(TofSensor&&) noexcept;
  // Several frames are averaged backwards from the last as far as nothing moved. The result is reused by the next call
  // unless somebody else still holds it.
  const std::shared_ptr<TofResult>& measure(const Run& run, const TapsView& taps);
  // The organised surface of a result, with normals, sigma and covariance.
  Surface surface(const Run& run, const TofResult& result) const;
  const TofUnit& unit() const;
  const Camera& camera() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sgrt
