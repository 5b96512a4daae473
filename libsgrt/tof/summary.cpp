#include "tof/summary.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>

#include "core/median.hpp"
#include "tof/kernels.hpp"

namespace sgrt {
namespace {

std::size_t pixels_of(const TofResult& r) {
  return static_cast<std::size_t>(r.width) * static_cast<std::size_t>(r.height);
}

void count_flags(TofResult& r) {
  const std::size_t n = pixels_of(r);
  std::array<std::int64_t, 256> by_flags{};
  std::size_t at = 0;
  for (; at + 8 <= n; at += 8) {  // most pixels have no flag
    std::uint64_t eight;
    std::memcpy(&eight, &r.flags[at], sizeof eight);
    if (eight == 0) {
      by_flags[0] += 8;
      continue;
    }
    for (std::size_t i = at; i < at + 8; ++i) ++by_flags[r.flags[i]];
  }
  for (; at < n; ++at) ++by_flags[r.flags[at]];
  r.flag_count.fill(0), r.point_count = 0;
  for (std::size_t value = 0; value < by_flags.size(); ++value) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      if (value >> bit & 1) r.flag_count[bit] += by_flags[value];
    }
    if ((value & kernels::kTofRejected) == 0) r.point_count += by_flags[value];
  }
}

// Of some thousand pixels, evenly.
double median_sigma(const TofResult& r, std::vector<double>& sigmas) {
  constexpr std::size_t kSamples = 4096;
  const std::size_t n = pixels_of(r), step = std::max<std::size_t>(1, n / kSamples);
  sigmas.clear();
  for (std::size_t i = 0; i < n; i += step) {
    const float sigma = r.sigma.plane(0)[i];
    if ((r.flags[i] & kernels::kTofRejected) == 0 && sigma == sigma) sigmas.push_back(sigma);
  }
  return median(sigmas);
}

std::string why_nothing(const TofResult& r) {
  constexpr const char* kWords[] = {"saturated", "of low amplitude", "moved", "flying", "wrapped", "out of range"};
  std::size_t most = 0;
  for (std::size_t bit = 1; bit < std::size(kWords); ++bit) {
    if (r.flag_count[bit] > r.flag_count[most]) most = bit;
  }
  return "no pixel has a range: " + std::to_string(r.flag_count[most]) + " of " + std::to_string(pixels_of(r)) +
         " are " + kWords[most];
}

}  // namespace

void summarise(TofResult& r, std::vector<double>& scratch) {
  count_flags(r);
  r.median_sigma = median_sigma(r, scratch);
  r.status = r.point_count > 0 ? Status::kOk : Status::kNotFound;
  r.message = r.point_count > 0 ? "" : why_nothing(r);
}

}  // namespace sgrt
