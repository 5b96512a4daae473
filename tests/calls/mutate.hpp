// Everything that can be wrong with one argument of a base call: NULL, sizes of 0, 1, 2^31 and beyond, strides of 0 and
// of all of memory, misaligned data, unknown dtypes and enums, struct sizes, NaN, Inf, denormals, 1e300.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "calls.hpp"

namespace calls {

struct Mutation {
  std::string where;  // "data.points.shape[0]"
  std::string what;   // "2^31"
  std::function<void(char* args)> apply;
};

// Of a call as its base is; to be applied to another one of the same function.
std::vector<Mutation> mutations(const Function& function, const char* args);

}  // namespace calls
