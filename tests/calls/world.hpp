// One handle of each type that the base calls take, made once from the scene.
#pragma once

#include "calls.hpp"
#include "scene.hpp"

namespace calls {

const Scene& scene();

template <class T>
T* one(const char* type) {
  return static_cast<T*>(example(type));
}

// Ends the program where the status is not SGRT_OK: the world could not be built.
void must(sgrt_status status, const char* what);

}  // namespace calls
