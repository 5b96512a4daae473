// What all pixels of a time-of-flight result say together: counts, status and message, the median sigma.
#pragma once

#include "tof/tof.hpp"

namespace sgrt {

// Sets them from the flags and sigmas; `scratch` is reused.
void summarise(TofResult& result, std::vector<double>& scratch);

}  // namespace sgrt
