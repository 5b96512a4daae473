// See registration/robust.hpp.
#include "registration/robust.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace sgrt {
namespace {

constexpr double kTukeyEnd = 4.685, kWelschWidth = 2.985;
constexpr double kWide = 3, kShrink = 0.7;
constexpr int kDropped = 20;  // bits of a float that do not choose its bin: 16 bins an octave

std::uint32_t bin_of(float v) {
  std::uint32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  return bits >> kDropped;
}

// The value of this rank among values >= 0: bits of such floats are ordered as they are, so counting the leading ones
// finds its bin, and only that bin is sorted.
float ranked(const std::vector<float>& values, std::size_t rank, std::vector<float>& scratch) {
  std::array<std::uint32_t, std::size_t{1} << (31 - kDropped)> count{};
  for (const float v : values) ++count[bin_of(v)];
  std::size_t before = 0;
  std::uint32_t bin = 0;
  while (before + count[bin] <= rank) before += count[bin++];
  scratch.resize(count[bin]);
  auto to = scratch.begin();
  for (const float v : values) {
    if (bin_of(v) == bin) *to++ = v;
  }
  const auto at = scratch.begin() + static_cast<std::ptrdiff_t>(rank - before);
  std::nth_element(scratch.begin(), at, scratch.end());
  return *at;
}

}  // namespace

double weight_of(Kernel kernel, double u) {
  switch (kernel) {
    case Kernel::kTukey: {
      const double fall = 1 - u * u / (kTukeyEnd * kTukeyEnd);
      return fall > 0 ? fall * fall : 0;
    }
    case Kernel::kWelsch:
      return std::exp(-u * u / (kWelschWidth * kWelschWidth));
    default:
      return 1;
  }
}

double GraduatedScale::next(double least) {
  const double wanted = scale_ > 0 ? kShrink * scale_ : kWide * least;
  settled_ = wanted <= least;
  scale_ = std::max(wanted, least);
  return scale_;
}

float trim_limit(const std::vector<float>& values, double share, std::vector<float>& scratch) {
  if (!(share < 1) || values.empty()) return std::numeric_limits<float>::infinity();
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  return ranked(values, rank, scratch);
}

double median_of(const std::vector<float>& values, std::vector<float>& scratch) {
  return values.empty() ? 0 : static_cast<double>(ranked(values, values.size() / 2, scratch));
}

}  // namespace sgrt
