// The context: threads, instruction set, log and progress of a call.
#include <algorithm>
#include <thread>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

constexpr int kMaxThreads = 256;

sgrt_context_options defaults() {
  sgrt_context_options o{};
  o.struct_size = sizeof o;
  o.threads = 1;
  o.max_isa = SGRT_ISA_AUTO;
  return o;
}

static_assert(static_cast<int>(Isa::kAuto) == SGRT_ISA_AUTO && static_cast<int>(Isa::kBaseline) == SGRT_ISA_BASELINE &&
              static_cast<int>(Isa::kAvx2) == SGRT_ISA_AVX2);

// The callbacks that are running on this thread, innermost first. A callback that called the library with the context
// it was called by would be called by that call again, without end.
struct Callback {
  const sgrt_context* context;
  const Callback* outer;
};
thread_local const Callback* running = nullptr;

template <class Call>
auto call_back(const sgrt_context* context, Call&& call) {
  struct Scope {
    Callback here;
    explicit Scope(const sgrt_context* c) : here{c, running} { running = &here; }
    ~Scope() { running = here.outer; }
  } scope(context);
  return call(context->options);
}

}  // namespace

Run run_of(sgrt_context* context) {
  Run run;
  run.isa = detect_isa();
  if (!context) return run;
  for (const Callback* c = running; c; c = c->outer) {
    if (c->context == context)
      refuse("context", "in use by the call that runs this callback", "another context or NULL");
  }
  run.pool = &context->pool;
  run.isa = context->isa;
  if (context->options.progress) {
    run.progress = [context](double fraction, const char* stage) {
      return call_back(context, [&](const sgrt_context_options& o) {
               return o.progress(o.progress_user, fraction, stage);
             }) != 0;
    };
  }
  if (context->options.log) {
    run.log = [context](int level, const char* message) {
      call_back(context, [&](const sgrt_context_options& o) { o.log(o.log_user, level, message); });
    };
  }
  return run;
}

}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_context_options_init(sgrt_context_options* options, size_t size) {
  return guard([&] { init_struct(options, size, defaults(), "options"); });
}

sgrt_status sgrt_context_create(const sgrt_context_options* options, sgrt_context** context) {
  return guard([&] {
    need(context, "context");
    const sgrt_context_options o = read_struct(options, defaults(), "options.struct_size");
    check_range(o.threads, 0, kMaxThreads, "options.threads");
    check_range(o.max_isa, SGRT_ISA_AUTO, SGRT_ISA_AVX2, "options.max_isa");
    check_reserved(o.reserved, "options.reserved");
    const int cores = static_cast<int>(std::min(std::thread::hardware_concurrency(), unsigned{kMaxThreads}));
    const int threads = o.threads > 0 ? o.threads : std::max(1, cores);
    const Isa isa = o.max_isa == SGRT_ISA_AUTO ? detect_isa() : std::min(detect_isa(), static_cast<Isa>(o.max_isa));
    *context = new sgrt_context{ThreadPool(threads), isa, o};
  });
}

void sgrt_context_free(sgrt_context* context) {
  guard([&] { delete context; });
}
