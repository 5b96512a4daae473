// Context and the calls on it. Python always installs a progress callback: it looks for signals (Ctrl-C), asks the
// user's callable, and keeps what either raised until the C call has come back.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

thread_local Call* current = nullptr;

int32_t isa_of(const std::string& name) {
  if (name == "auto") return SGRT_ISA_AUTO;
  if (name == "baseline") return SGRT_ISA_BASELINE;
  if (name == "avx2") return SGRT_ISA_AVX2;
  invalid("max_isa: '" + name + "' is unknown; expected 'auto', 'baseline' or 'avx2'");
}

// A callback may close over its context; without this the pair would never be collected.
void collect_cycles(PyHeapTypeObject* heap_type) {
  PyTypeObject* type = &heap_type->ht_type;
  type->tp_flags |= Py_TPFLAGS_HAVE_GC;
  type->tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    if (py::detail::is_holder_constructed(self)) {
      auto& context = py::cast<Context&>(py::handle(self));
      Py_VISIT(context.progress.ptr());
      Py_VISIT(context.log.ptr());
    }
    return 0;
  };
  type->tp_clear = [](PyObject* self) {
    if (py::detail::is_holder_constructed(self)) {
      auto& context = py::cast<Context&>(py::handle(self));
      context.progress = py::none();
      context.log = py::none();
    }
    return 0;
  };
}

constexpr const char* kContextDoc =
    R"(Thread budget, instruction set, progress and log of the calls that it is given to.

threads: threads in all, the calling one included; 0: one a core; at most 256.
max_isa: 'auto', 'baseline' or 'avx2', the highest instruction set to use.
progress: called as progress(fraction, stage) on the calling thread, about every 10 ms; fraction runs 0 to 1 within a
    stage. A true result cancels the call, which raises sgrt.Cancelled. What it raises comes out of the call unchanged.
log: called as log(level, message); level 0 is information, 1 a warning. What it raises comes out of the call unchanged.
A callback may call the library, but not with this context.

A context may be shared by threads; concurrent calls queue. Results do not depend on the number of threads. A call without
a context makes one of its own: one thread, silent, cancelled by Ctrl-C.

Raises InvalidArgument: threads or max_isa out of range.
C: sgrt_context_create)";

}  // namespace

Context::Context(int32_t threads_, const std::string& max_isa, py::object progress_, py::object log_)
    : progress(std::move(progress_)), log(std::move(log_)), threads(threads_) {
  auto options = defaults(sgrt_context_options_init);
  options.threads = threads;
  options.max_isa = isa_of(max_isa);
  options.progress = &Call::on_progress;
  if (!log.is_none()) options.log = &Call::on_log;
  run([&] { return sgrt_context_create(&options, out(handle)); });
}

Call::Call(Context* context) : context_(context), outer_(current) {
  if (!context_) {
    own_.emplace(defaults(sgrt_context_options_init).threads, "auto", py::none(), py::none());
    context_ = &*own_;
  }
  current = this;
}

Call::~Call() {
  current = outer_;
}

void Call::rethrow() {
  if (pending_) std::rethrow_exception(std::exchange(pending_, nullptr));
}

// No exception may travel through the C library: it is kept here, and the call is asked to stop.
template <class F>
int32_t Call::guarded(F&& callback) {
  if (pending_) return 1;
  try {
    return callback();
  } catch (...) {
    pending_ = std::current_exception();
    return 1;
  }
}

int32_t Call::on_progress(void*, double fraction, const char* stage) {
  py::gil_scoped_acquire gil;
  Call* call = current;
  return call->guarded([&]() -> int32_t {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const py::object progress = call->context_->progress;
    if (progress.is_none()) return 0;
    const py::object answer = progress(fraction, stage);
    const int truth = PyObject_IsTrue(answer.ptr());
    if (truth < 0) throw py::error_already_set();
    return truth;
  });
}

void Call::on_log(void*, int32_t level, const char* message) {
  py::gil_scoped_acquire gil;
  Call* call = current;
  call->guarded([&] {
    const py::object log = call->context_->log;
    if (!log.is_none()) log(level, message);
    return 0;
  });
}

void register_context(py::module_& m) {
  const auto d = defaults(sgrt_context_options_init);
  using Progress = std::optional<py::typing::Callable<py::object(double, py::str)>>;
  using Log = std::optional<py::typing::Callable<py::object(int, py::str)>>;
  const auto object_of = [](const auto& callable) { return callable ? py::object(*callable) : py::object(py::none()); };

  py::class_<Context>(m, "Context", py::custom_type_setup(collect_cycles), kContextDoc)
      .def(py::init([object_of](int32_t threads, const std::string& max_isa, const Progress& progress, const Log& log) {
             return std::make_unique<Context>(threads, max_isa, object_of(progress), object_of(log));
           }),
           py::kw_only(), py::arg("threads") = d.threads, py::arg("max_isa") = "auto", py::arg("progress") = py::none(),
           py::arg("log") = py::none())
      .def_readonly("threads", &Context::threads, "The thread budget as given; 0: one a core.")
      .def("__repr__", [](const Context& c) { return "<sgrt.Context threads=" + std::to_string(c.threads) + ">"; });
}

}  // namespace sgrt_py
