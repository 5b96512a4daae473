// Bits that look drawn by chance and are the same every time: Knuth's linear congruential generator (MMIX). The upper
// ones are good.
#pragma once

#include <cstdint>

namespace sgrt {

class Sequence {
 public:
  std::uint64_t next() { return state_ = state_ * 6364136223846793005U + 1442695040888963407U; }

 private:
  std::uint64_t state_ = 1;
};

}  // namespace sgrt
