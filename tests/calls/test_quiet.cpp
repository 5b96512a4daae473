// Promises 7 and 12: the library leaves the process as it found it. Around every base call: signal handlers, the signal
// mask, locale, rounding mode, flush-to-zero, environment, working directory, open files, stdout and stderr. Then the
// answers in a locale with a decimal comma, after a fork in the middle of a context's life, and 50 loads and unloads of
// the library.
#include "../comma_locale.h"
#include "../sanitizers.h"

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <fenv.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "calls.hpp"

extern char** environ;
using namespace calls;

namespace {

int failures = 0;
FILE* report = nullptr;

void failed(const char* where, const std::string& why) {
  if (++failures <= 40) std::fprintf(report, "%s: %s\n", where, why.c_str());
}

int entries_of(const char* folder) {
  int n = 0;
  if (DIR* dir = opendir(folder)) {
    while (readdir(dir)) ++n;
    closedir(dir);
  }
  return n;
}

// All that a library could leave changed, as text.
std::string state() {
  std::string all = std::string(setlocale(LC_ALL, nullptr)) + "|" + std::to_string(fegetround());
#if defined(__SSE__)
  all += "|" + std::to_string(_mm_getcsr() & ~0x3FU);  // but the flags of what has happened
#endif
  char folder[4096];
  all += std::string("|") + (getcwd(folder, sizeof folder) ? folder : "?");
  for (char** e = environ; *e; ++e) all += std::string("|") + *e;
  for (int number = 1; number < 32; ++number) {
    struct sigaction now;
    if (number == SIGKILL || number == SIGSTOP || sigaction(number, nullptr, &now) != 0) continue;
    all += "|" + std::to_string(reinterpret_cast<std::uintptr_t>(now.sa_handler));
  }
  sigset_t mask;
  pthread_sigmask(SIG_SETMASK, nullptr, &mask);
  for (int number = 1; number < 32; ++number) all += sigismember(&mask, number) ? '1' : '0';
  return all + "|" + std::to_string(entries_of("/proc/self/fd"));
}

std::string answer_of(const Function& f) {
  if (!std::strcmp(f.name, "sgrt_last_error")) return "";  // the thread's own history
  Call call(f);
  call.run();
  return call.digest();
}

void check_all(const char* how, const std::vector<std::string>& answers) {
  for (std::size_t i = 0; i < functions().size(); ++i) {
    const Function& f = functions()[i];
    const std::string before = state();
    const std::string answer = answer_of(f);
    if (state() != before) failed(f.name, std::string("changed the process ") + how);
    if (!answers.empty() && answer != answers[i]) failed(f.name, std::string("other bytes ") + how);
  }
}

// A context with workers is used before the fork, by the child, and by the parent again.
void check_fork(const std::vector<std::string>& answers) {
  context_of_calls = context_with(4);
  const auto some = [&] {
    int wrong = 0;
    for (std::size_t i = 0; i < functions().size(); ++i) {
      const std::string name = functions()[i].name;
      if (name.find("_align") == std::string::npos && name != "sgrt_stereo_match" && name != "sgrt_tof_measure")
        continue;
      wrong += answer_of(functions()[i]) != answers[i];
    }
    return wrong;
  };
  if (some() != 0) failed("fork", "other bytes before it");
  const pid_t child = fork();
  if (child == 0) {
    const int wrong = some();
    sgrt_context_free(context_of_calls);  // in the child too
    _exit(wrong);
  }
  int status = -1;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) failed("fork", "the child ends with " + std::to_string(status));
  if (some() != 0) failed("fork", "other bytes after it");
  sgrt_context_free(context_of_calls);
  context_of_calls = nullptr;
}

long resident_kib() {
  long pages = 0, resident = 0;
  if (FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return resident * 4;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kUnloads = false;
#else
constexpr bool kUnloads = true;
#endif

// In a process of its own that is not linked to the library: loads it, works with four threads, unloads it.
int load_and_unload(const char* library) {
  long first = 0;
  int fds = 0;
  for (int i = 0; i < 50; ++i) {
    void* handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (!handle) return 2;
    const auto init =
        reinterpret_cast<decltype(&sgrt_context_options_init)>(dlsym(handle, "sgrt_context_options_init"));
    const auto create = reinterpret_cast<decltype(&sgrt_context_create)>(dlsym(handle, "sgrt_context_create"));
    const auto release = reinterpret_cast<decltype(&sgrt_context_free)>(dlsym(handle, "sgrt_context_free"));
    const auto sphere =
        reinterpret_cast<decltype(&sgrt_nurbs_surface_sphere)>(dlsym(handle, "sgrt_nurbs_surface_sphere"));
    const auto mesh = reinterpret_cast<decltype(&sgrt_nurbs_surface_mesh)>(dlsym(handle, "sgrt_nurbs_surface_mesh"));
    const auto drop = reinterpret_cast<decltype(&sgrt_nurbs_surface_free)>(dlsym(handle, "sgrt_nurbs_surface_free"));
    const auto drop_mesh = reinterpret_cast<decltype(&sgrt_surface_free)>(dlsym(handle, "sgrt_surface_free"));
    sgrt_context_options o;
    sgrt_context* context = nullptr;
    sgrt_nurbs_surface* ball = nullptr;
    sgrt_surface* skin = nullptr;
    const double centre[3] = {0, 0, 0};
    if (init(&o, sizeof o) != SGRT_OK) return 3;
    o.threads = 4;
    if (create(&o, &context) != SGRT_OK || sphere(centre, 10, &ball) != SGRT_OK ||
        mesh(context, ball, 0.01, &skin) != SGRT_OK)
      return 3;
    drop_mesh(skin);
    drop(ball);
    release(context);
    if (dlclose(handle) != 0) return 4;
    if (entries_of("/proc/self/task") != 3) return 5;  // ".", ".." and this one thread
    if (i == 9) first = resident_kib(), fds = entries_of("/proc/self/fd");
  }
  if (entries_of("/proc/self/fd") != fds) return 6;
  return resident_kib() - first > 2048 ? 7 : 0;
}

}  // namespace

int main(int count, char** arguments) {
  report = fdopen(dup(2), "w");
  setvbuf(report, nullptr, _IOLBF, 0);
  Dl_info info;  // where the library lies
  if (kUnloads && dladdr(reinterpret_cast<void*>(sgrt_version), &info)) {
    const int code = load_and_unload(info.dli_fname);
    if (code != 0) failed("dlopen", "step " + std::to_string(code));
  }
  (void)count, (void)arguments;
  build_world();
  const int quiet = quiet_streams();
  std::vector<std::string> answers;
  answers.reserve(functions().size());
  for (const Function& f : functions()) answers.push_back(answer_of(f));
  check_all("as it is", answers);
  const bool comma = enter_comma_locale();
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", 0.5);  // of this process: the library's numbers keep their points
  if (comma != !std::strcmp(text, "0,5")) failed("the locale", text);
  if (comma) check_all("with a decimal comma", answers);
  setlocale(LC_ALL, "C");
#if defined(__SSE__)
  // Modes that are not the library's: they stay, and the bits may differ (docs/how-it-is-tested.md).
  fesetround(FE_UPWARD);
  _mm_setcsr(_mm_getcsr() | 0x8040);  // flush to zero, denormals are zero
  check_all("rounding upward, without denormals", {});
  _mm_setcsr(_mm_getcsr() & ~0x8040U);
  fesetround(FE_TONEAREST);
#endif
#if !defined(__SANITIZE_THREAD__)
  check_fork(answers);
#endif
  std::fflush(nullptr);
  if (lseek(quiet, 0, SEEK_END) != 0) failed("stdout and stderr", "something was written");
  free_world();
  std::fprintf(report, "%zu functions, decimal comma %s, %d failures\n", functions().size(),
               comma ? "tried" : "not installed", failures);
  return failures != 0;
}
