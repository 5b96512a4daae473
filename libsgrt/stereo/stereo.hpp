// Speckle stereo: one pair of images to an organised surface. Rectify exactly from the rig, match coarsely with ZNCC
// over the whole search range, refine with IC-GN along the row, grow from seeds, check left-right, triangulate.
// docs/theory/stereo.md.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "core/error.hpp"
#include "core/image.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "rig/rig.hpp"

namespace sgrt {

struct StereoOptions {
  int window = 21;                                                             // px, odd
  int stride = 3;                                                              // px of the rectified left image
  int min_component = 30;                                                      // points
  Vec3 volume_min = Vec3::Constant(-std::numeric_limits<double>::infinity());  // room, mm
  Vec3 volume_max = Vec3::Constant(std::numeric_limits<double>::infinity());
  double min_correlation = 0.6;
  double max_left_right = 0.5;  // px
  double max_epipolar = 0.1;    // px
  double max_sigma = 0.1;       // px
};

// The same numbers as SGRT_REASON_...
enum class Reason : std::uint8_t {
  kNone,
  kOutOfView,
  kOutOfVolume,
  kNoTexture,
  kSaturated,
  kNoMatch,
  kLeftRight,
  kAmbiguous,
  kEdge,
  kMoved,
  kOccluded,
  kCount
};

struct StereoResult {
  Status status = Status::kOk;  // kOk or kNotFound
  std::string message;
  int height = 0, width = 0;         // of the grid
  std::shared_ptr<Surface> surface;  // organised, height x width
  std::vector<std::uint8_t> reason;
  std::vector<float> correlation, sigma_px;
  std::vector<double> left_px, right_px;  // height x width x 2, in the images as taken
  std::array<std::int64_t, static_cast<std::size_t>(Reason::kCount)> reason_count{};
  std::int64_t point_count = 0;
  double noise_left, median_sigma_px, median_sigma_mm;
  double epipolar_px, epipolar_sigma_px, epipolar_rms_px;  // off the epipolar line: median, its sigma, RMS
  std::int64_t epipolar_count = 0;
  bool out_of_calibration = false;
};

struct PriorOptions;
struct Roi;

// Everything of a pair that does not change from frame to frame, and the buffers that do.
class StereoMatcher {
 public:
  StereoMatcher(const Run& run, const Rig& rig, const StereoPair& pair, const StereoOptions& options);
  ~StereoMatcher();
  StereoMatcher(StereoMatcher&&) noexcept;
  // Live mode: from now on only near `prior`, and only where it lies in `roi` (NULL: all of it). NULL: as before.
  void set_prior(const Run& run, const Surface* prior, const Roi* roi, const PriorOptions& options);
  // The result is reused by the next call unless somebody else still holds it.
  const std::shared_ptr<StereoResult>& match(const Run& run, const ImageView& left, const ImageView& right);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sgrt
