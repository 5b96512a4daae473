// The centre of a laser stripe in each line of an image: grey centroid, Gaussian fit, or Steger's ridge ("An unbiased
// detector of curvilinear structures", 1998). Of several candidates in a line the one that belongs to the strongest
// continuous stripe of the right width is taken. docs/theory/laser.md eq. 1-9.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/image.hpp"
#include "core/run.hpp"

namespace sgrt {

enum class StripeMethod { kCentroid = 0, kGaussian = 1, kRidge = 2 };

struct StripeOptions {
  StripeMethod method = StripeMethod::kGaussian;
  bool columns = false;        // a centre a column (a stripe that runs across) instead of one a row
  int min_length = 5;          // lines; shorter pieces are not trusted
  double half_width = 0;       // px, of the window of the centroid: 0: from the stripes' own width
  double min_signal = 0;       // grey levels of a peak over its background; 0: 6 times the noise, at least 2
  double noise = 0;            // grey levels, one sigma of a dark pixel; 0: from the image
  double gain = 0;             // grey levels an electron: shot noise adds gain times the signal to the variance
  double saturation = 0;       // grey level at which a pixel is clipped; 0: the type's largest
  double max_asymmetry = 0.3;  // of the profile's foot about its top, (right - left) / (right + left)
};

// The numbers of SGRT_REASON_...
enum class LineReason : std::uint8_t {
  kNone = 0,
  kOutOfView = 1,  // the stripe's flanks leave the image
  kNoStripe = 3,   // nothing above min_signal
  kSaturated = 4,  // so clipped that no flank is left
  kNoMatch = 5,    // the fit found no centre
  kAmbiguous = 7,  // two stripes of like strength, or a piece shorter than min_length
  kEdge = 8,       // the two half widths differ: an edge, or skin that scatters
};

struct Stripe {
  Status status = Status::kOk;  // kOk or kNotFound
  std::string message;
  std::vector<double> centre;  // px, one a line; NaN where absent
  std::vector<float> sigma;    // px, one sigma of the centre
  std::vector<float> signal;   // grey levels of the peak over its background
  std::vector<float> width;    // px, sigma of the profile along the line
  std::vector<float> asymmetry;
  std::vector<std::uint8_t> reason;
  std::array<std::int64_t, 16> reason_count{};
  std::int64_t found = 0;
  double noise = 0;         // grey levels
  double gain = 0;          // variance a grey level of signal: given, or as the fits' residuals show it
  double fit_scale = 1;     // how much larger than the noise the fits' residuals are; it is in sigma
  double median_sigma = 0;  // px
};

void check_options(const StripeOptions& options);

// dark: an image without laser, of the same size and type, or nullptr.
Stripe extract_stripe(const Run& run, const ImageView& image, const ImageView* dark, const StripeOptions& options);

}  // namespace sgrt
