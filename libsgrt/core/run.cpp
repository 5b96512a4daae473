// Progress and the choice of an instruction set.
#include "core/run.hpp"

#include <string>

#include "core/error.hpp"
#include "core/parallel.hpp"

namespace sgrt {

Isa detect_isa() {
#if defined(__x86_64__) || defined(__i386__)
  return __builtin_cpu_supports("avx2") ? Isa::kAvx2 : Isa::kBaseline;
#else
  return Isa::kBaseline;
#endif
}

void Run::poll(double fraction, const char* stage) const {
  if (!progress || on_worker_thread()) return;
  if (progress(fraction, stage)) fail(Status::kCancelled, std::string("cancelled by the progress callback: ") + stage);
}

}  // namespace sgrt
