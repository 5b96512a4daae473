// Every function of sgrt.h as data: what its arguments are, how to call it, and one base call that is answered. The
// tests beside this file break base calls (bad arguments), starve them (out of memory) and run them from many threads.
// What is known of a function comes from the header (generate.py); what the header cannot tell is in base_*.cpp.
#pragma once

#include <sgrt.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace calls {

struct Struct;
struct Field {
  enum Kind { kInt32, kInt64, kDouble, kPointer, kStruct };
  const char* name;
  Kind kind;
  std::size_t offset;
  int count;
  std::size_t size;
  const Struct* of;
};

using Init = sgrt_status (*)(void*, std::size_t);
struct Struct {
  const char* name;
  std::size_t size;
  bool sized;
  Init init;
  std::vector<Field> fields;
};

struct Param {
  enum Kind {
    kContext,    // may be NULL
    kHandle,     // const
    kSession,    // mutable
    kHandles,    // an array of handles
    kHandleOut,  // a new handle
    kLentOut,    // a lent one
    kView,
    kMutView,
    kStructIn,
    kStructOut,  // struct_size set
    kInitOut,    // ..._init(struct, size)
    kNumbers,    // const double[]
    kIntegers,   // const int32_t[]
    kOut,        // numbers, a count of bytes
    kText,
    kDouble,
    kInt32,
    kInt64,
    kSize
  };
  const char* name;
  Kind kind;
  std::size_t offset;
  std::size_t bytes;
  const char* type;
  const Struct* of;
};

struct Answer {
  sgrt_status status;
  const char* text;
};

struct Function {
  enum Result { kStatus, kText, kNothing };
  const char* name;
  Result result;
  std::size_t args_size;
  std::vector<Param> params;
  Answer (*call)(void* args);
  void (*by_hand)(void* args);  // NULL: the rules of fill() are enough
};

// Memory of a call, one page run an argument, its last byte flush with a page that nobody may touch.
void* in(const void* data, std::size_t bytes);  // a copy; read-only while the call runs
void* out(std::size_t bytes);                   // filled with a pattern
template <class T>
T* in(const T& value) {
  return static_cast<T*>(in(&value, sizeof value));
}
template <class T>
T* in(const std::vector<T>& values) {
  return static_cast<T*>(in(values.data(), values.size() * sizeof(T)));
}
sgrt_view* view(const void* data, std::int32_t dtype, std::vector<std::int64_t> shape);
sgrt_mut_view* out_view(std::int32_t dtype, std::vector<std::int64_t> shape);
// One with so many threads; the caller destroys it.
sgrt_context* context_with(int threads, sgrt_progress_fn progress = nullptr, void* user = nullptr);
// Standard output and standard error go into the file that is given, but for a sanitizer's own report.
int quiet_streams();
const double* numbers(std::vector<double> values);
template <class T>
T* options(sgrt_status (*init)(T*, std::size_t)) {
  T o{};
  init(&o, sizeof o);
  return in(o);
}

// The arguments of a base call, in memory of their own.
class Call {
 public:
  explicit Call(const Function& function);
  ~Call();  // frees the handles that the call gave
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  void seal();  // before the call: inputs become read-only
  Answer run();
  void open();                      // after it
  const char* outputs_off() const;  // "" or what was written beside the outputs
  bool outputs_untouched() const;   // every byte of every output is as seal() found it
  std::string digest() const;       // all that the call answered: status, outputs, and all that its handles show
  char* args() { return args_.data(); }
  const Function& function() const { return function_; }

 private:
  const Function& function_;
  std::vector<char> args_;
  Answer answer_{0, nullptr};
};

// What the base calls are about.
void build_world();
void free_world();
void* example(const std::string& type);                 // the world's handle of this type
void* lasting(const std::string& type, void* session);  // freed with the Call that is being made
extern thread_local sgrt_context* context_of_calls;     // of the next Call on this thread; NULL at first

// Every byte that a handle, or a view, shows.
std::string show(const std::string& type, const void* handle);
std::string show_view(const sgrt_view& v);

const std::vector<Function>& functions();
void free_handle(const std::string& type, void* handle);

}  // namespace calls
