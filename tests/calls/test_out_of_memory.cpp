// Promise 4: out of memory is a status. Every base call is run again and again, each time with another of its
// allocations failing: number n alone, and n with all after it. It must give SGRT_E_OUT_OF_MEMORY with its outputs
// untouched (or do without, as the pool does with a thread that cannot start, and give the same bytes as ever); then
// the same arguments are used again with memory, and the answer must have the bytes that it always has; and at the end
// of each call no block may be left that was not there before it.
//
//   test_out_of_memory [calls a function that are starved at most, 1400 unless said; of slow ones a sixtieth
//   [FUNCTION]]
//
// malloc and its like are defined here and so stand before the C library's for the program and for libsgrt, whose
// operator new comes by malloc too. A sanitizer has a malloc of its own: there the test is skipped.
#include "../sanitizers.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "calls.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
int main() {
  std::puts("skipped: the sanitizer's malloc cannot be made to fail");
  return 77;
}
#else

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
}

namespace {

// Of the one thread that calls; the library is run without a pool here.
thread_local bool armed = false;
thread_local long allocations = 0, failing = 0, live = 0, refused = 0;
thread_local bool from_then_on = false;

bool refuse() {
  if (!armed) return false;
  const long n = ++allocations;
  if (failing == 0 || (from_then_on ? n < failing : n != failing)) return false;
  ++refused;
  errno = ENOMEM;
  return true;
}

void* counted(void* p) {
  if (p) ++live;
  return p;
}

}  // namespace

extern "C" {
void* malloc(std::size_t size) {
  return refuse() ? nullptr : counted(__libc_malloc(size));
}
void* calloc(std::size_t n, std::size_t size) {
  return refuse() ? nullptr : counted(__libc_calloc(n, size));
}
void* realloc(void* old, std::size_t size) {
  if (refuse()) return nullptr;
  if (!old) return counted(__libc_realloc(old, size));
  if (size == 0) --live;
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return refuse() ? nullptr : counted(__libc_memalign(alignment, size));
}
void* memalign(std::size_t alignment, std::size_t size) {
  return refuse() ? nullptr : counted(__libc_memalign(alignment, size));
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  if (refuse()) return ENOMEM;
  *p = counted(__libc_memalign(alignment, size));
  return *p ? 0 : ENOMEM;
}
void free(void* p) {
  if (p) --live;
  __libc_free(p);
}
}

using namespace calls;

namespace {

int failures = 0;

void failed(const Function& f, long n, const std::string& why) {
  if (++failures <= 60) std::fprintf(stderr, "%s, allocation %ld: %s\n", f.name, n, why.c_str());
}

Answer starved(Call& call, long n, bool onwards) {
  allocations = refused = 0;
  failing = n;
  from_then_on = onwards;
  armed = true;
  const Answer answer = call.run();
  armed = false;
  return answer;
}

// Calls that take so long that only some of their allocations fail here.
bool heavy(const Function& f) {
  for (const char* name :
       {"sgrt_roi_advise", "sgrt_volume_skin", "sgrt_deform_align", "sgrt_landmarks_find", "sgrt_landmark_model_learn",
        "sgrt_landmark_model_from_json", "sgrt_contours_close", "sgrt_board_detect", "sgrt_tracker_create",
        "sgrt_tracker_set_reference", "sgrt_icp_align", "sgrt_surface_estimate_normals", "sgrt_reference_create",
        "sgrt_surface_distance", "sgrt_calibration_solve", "sgrt_calibration_check", "sgrt_calibration_room",
        "sgrt_calibration_laser", "sgrt_calibration_tof"})
    if (!std::strcmp(name, f.name)) return true;
  return false;
}

// A frame that failed counts: its number and the beam's hysteresis go on (sgrt.h); nothing else may differ, which the
// tests of the tracker look at.
bool goes_on(const Function& f) {
  return !std::strcmp(f.name, "sgrt_tracker_push");
}

// The header names them: what they lent is gone, or the beam must hold.
bool writes_always(const Function& f) {
  return !std::strcmp(f.name, "sgrt_stereo_session_push") || !std::strcmp(f.name, "sgrt_tof_session_push") ||
         !std::strcmp(f.name, "sgrt_tracker_push");
}

// How many allocations the base call makes, and what it answers.
long measure(const Function& f, std::string& digest) {
  Call call(f);
  call.seal();
  starved(call, 0, false);
  call.open();
  digest = call.digest();
  return allocations;
}

void try_starved(const Function& f, long n, bool onwards, const std::string& digest) {
  Call call(f);
  call.seal();
  const Answer answer = starved(call, n, onwards);
  const bool hungry = refused > 0;
  call.open();
  const bool no_text = f.result == Function::kText && !answer.text;
  if (!hungry) return failed(f, n, "the call makes fewer allocations than at first");
  if (answer.status != SGRT_E_OUT_OF_MEMORY && !no_text) {
    if (answer.status != SGRT_OK || call.digest() != digest)
      failed(f, n, std::string("gives ") + sgrt_status_word(answer.status) + ": " + sgrt_last_error());
    return;
  }
  if (!no_text && !writes_always(f) && !call.outputs_untouched()) failed(f, n, "an output was written");
  if (!no_text && std::strcmp(sgrt_last_error(), "out of memory")) failed(f, n, sgrt_last_error());
  call.seal();
  call.run();
  call.open();
  if (!goes_on(f) && call.digest() != digest) failed(f, n, "the second try gives other bytes");
}

void check_starved(const Function& f, long n, bool onwards, const std::string& digest) {
  const long before = live;
  try_starved(f, n, onwards, digest);
  if (live != before) failed(f, n, std::to_string(live - before) + " blocks leak");
}

}  // namespace

int main(int count, char** arguments) {
  const long most = count > 1 && std::atol(arguments[1]) > 0 ? std::atol(arguments[1]) : 1400;  // else expected.txt
  build_world();
  long injected = 0;
  for (const Function& f : functions()) {
    if (count > 2 && std::strcmp(f.name, arguments[2])) continue;
    std::string digest;
    measure(f, digest);  // what is made at the first use is there now
    const long n = measure(f, digest);
    const long points = std::min(n, heavy(f) ? most / 60 : most);
    for (long i = 1; i <= points; ++i) {
      const long k = n == points ? i : 1 + (n - 1) * (i - 1) / std::max(1L, points - 1);  // the last one too
      check_starved(f, k, false, digest);
      check_starved(f, k, true, digest);
      injected += 2;
    }
  }
  free_world();
  std::printf("%ld allocations failed, %d findings\n", injected, failures);
  return failures != 0 || (count < 3 && injected < 20'000);
}

#endif
