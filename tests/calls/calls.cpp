// The memory of a call and the rules that fill its arguments; see calls.hpp.
#include "calls.hpp"

#include "../sanitizers.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace calls {
namespace {

constexpr std::size_t kPage = 4096, kSlot = 64 * kPage, kSlots = 160;
constexpr unsigned char kPattern = 0xA5;

struct Slot {
  char* data = nullptr;
  std::size_t bytes = 0;
  bool input = false;
  std::vector<char> before;  // an output when it was sealed
};

// Slots of kSlot bytes, a page between two that nobody may touch.
struct Arena {
  char* base = nullptr;
  std::vector<Slot> used;
  std::vector<std::pair<std::string, void*>> sessions;

  Arena() {
    base = static_cast<char*>(
        mmap(nullptr, kSlots * (kSlot + kPage), PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
    if (base == MAP_FAILED) std::abort();
    for (std::size_t i = 0; i < kSlots; ++i) mprotect(base + i * (kSlot + kPage), kSlot, PROT_READ | PROT_WRITE);
  }
  ~Arena() { munmap(base, kSlots * (kSlot + kPage)); }

  static char* page_of(char* p) { return p - reinterpret_cast<std::uintptr_t>(p) % kPage; }
  // The pages that hold the data, and one byte before it at least.
  static char* begin_of(const Slot& slot) { return page_of(slot.data - 1); }
  static std::size_t pages_of(const Slot& slot) {
    return static_cast<std::size_t>(slot.data + slot.bytes - begin_of(slot) + kPage - 1) / kPage * kPage;
  }

  char* take(std::size_t bytes, bool input) {
    if (used.size() == kSlots || bytes + kPage > kSlot) {
      std::fprintf(stderr, "calls: an argument of %zu bytes, argument %zu\n", bytes, used.size());
      std::abort();
    }
    Slot slot;
    slot.data = base + used.size() * (kSlot + kPage) + kSlot - bytes;
    slot.bytes = bytes;
    slot.input = input;
    std::memset(begin_of(slot), kPattern, static_cast<std::size_t>(slot.data + bytes - begin_of(slot)));
    used.push_back(slot);
    return slot.data;
  }
  void protect(int how) {
    for (const Slot& slot : used) {
      if (slot.input) mprotect(begin_of(slot), pages_of(slot), how);
    }
  }
};

Arena& arena() {
  thread_local Arena mine;
  return mine;
}

template <class T>
void put(char* args, const Param& p, T value) {
  std::memcpy(args + p.offset, &value, sizeof value);
}
template <class T>
T get(const char* args, const Param& p) {
  T value;
  std::memcpy(&value, args + p.offset, sizeof value);
  return value;
}

void* struct_in(const Struct& s) {
  std::vector<char> bytes(s.size, 0);
  if (s.sized) {
    const auto size = static_cast<std::uint32_t>(s.size);
    std::memcpy(bytes.data(), &size, sizeof size);
  }
  if (s.init) s.init(bytes.data(), s.size);
  return in(bytes.data(), s.size);
}

void* struct_out(const Struct& s) {
  void* p = out(s.size);
  const auto size = static_cast<std::uint32_t>(s.size);
  if (s.sized) std::memcpy(p, &size, sizeof size);
  return p;
}

// What an output pointer holds before the call.
void* pattern() {
  void* p;
  std::memset(&p, kPattern, sizeof p);
  return p;
}

// What follows from the kind of an argument alone.
void fill(char* args, const Param& p) {
  switch (p.kind) {
    case Param::kContext:
      return put(args, p, context_of_calls);
    case Param::kHandle:
      return put(args, p, example(p.type));
    case Param::kSession:
      return put(args, p, static_cast<void*>(nullptr));  // what ..._free takes; else by hand
    case Param::kHandleOut:
    case Param::kLentOut:
      return put(args, p, out(sizeof(void*)));
    case Param::kStructIn:
      return put(args, p, struct_in(*p.of));
    case Param::kStructOut:
      return put(args, p, struct_out(*p.of));
    case Param::kInitOut:
      put(args, p, out(p.of->size));
      return put(args + sizeof(void*), p, p.of->size);  // the size follows
    case Param::kNumbers:
      if (p.bytes == 24) put(args, p, numbers({0, 0, 0}));
      if (p.bytes == 128) put(args, p, numbers({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
      return;
    case Param::kOut:
      return put(args, p, out(p.bytes));
    case Param::kInt32:
      if (!std::strcmp(p.name, "field")) put(args, p, std::int32_t{1});
      return;
    default:
      return;  // zero, or by hand
  }
}

}  // namespace

thread_local sgrt_context* context_of_calls = nullptr;

void* in(const void* data, std::size_t bytes) {
  char* p = arena().take(bytes, true);
  std::memcpy(p, data, bytes);
  return p;
}

void* out(std::size_t bytes) {
  return arena().take(bytes, false);
}

sgrt_context* context_with(int threads, sgrt_progress_fn progress, void* user) {
  sgrt_context_options o;
  sgrt_context* context = nullptr;
  sgrt_context_options_init(&o, sizeof o);
  o.threads = threads;
  o.progress = progress;
  o.progress_user = user;
  if (sgrt_context_create(&o, &context) != SGRT_OK) std::abort();
  return context;
}

int quiet_streams() {
  const int quiet = memfd_create("quiet", 0);
  dup2(quiet, 1);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  dup2(quiet, 2);
#endif
  return quiet;
}

// Packed, row by row; `bytes` is what it spans.
template <class View>
static View packed(std::int32_t dtype, const std::vector<std::int64_t>& shape, std::size_t& bytes) {
  View v{};
  v.dtype = dtype;
  v.ndim = static_cast<std::int32_t>(shape.size());
  std::int64_t stride = sgrt_dtype_size(dtype);
  for (std::size_t i = shape.size(); i-- > 0;) {
    v.shape[i] = shape[i];
    v.strides[i] = stride;
    stride *= shape[i];
  }
  bytes = static_cast<std::size_t>(stride);
  return v;
}

sgrt_view* view(const void* data, std::int32_t dtype, std::vector<std::int64_t> shape) {
  std::size_t bytes = 0;
  auto v = packed<sgrt_view>(dtype, shape, bytes);
  v.data = in(data, bytes);
  return in(v);
}

sgrt_mut_view* out_view(std::int32_t dtype, std::vector<std::int64_t> shape) {
  std::size_t bytes = 0;
  auto v = packed<sgrt_mut_view>(dtype, shape, bytes);
  v.data = out(bytes);
  return in(v);
}

const double* numbers(std::vector<double> values) {
  return in(values);
}

void* lasting(const std::string& type, void* session) {
  arena().sessions.emplace_back(type, session);
  return session;
}

Call::Call(const Function& function) : function_(function), args_(function.args_size + sizeof(void*), 0) {
  arena().used.clear();
  for (const Param& p : function.params) {
    if (p.kind != Param::kSize) fill(args_.data(), p);
  }
  if (function.by_hand) function.by_hand(args_.data());
}

Call::~Call() {
  for (const Param& p : function_.params) {
    auto** slot = p.kind == Param::kHandleOut ? get<void**>(args_.data(), p) : nullptr;
    if (slot && *slot && *slot != pattern()) free_handle(p.type, *slot);
  }
  for (auto& [type, session] : arena().sessions) free_handle(type, session);
  arena().sessions.clear();
}

void Call::seal() {
  for (Slot& slot : arena().used) {
    if (!slot.input) slot.before.assign(slot.data, slot.data + slot.bytes);
  }
  arena().protect(PROT_READ);
}

Answer Call::run() {
  return answer_ = function_.call(args_.data());
}

void Call::open() {
  arena().protect(PROT_READ | PROT_WRITE);
}

const char* Call::outputs_off() const {
  for (const Slot& slot : arena().used) {
    for (char* p = Arena::begin_of(slot); !slot.input && p < slot.data; ++p) {
      if (static_cast<unsigned char>(*p) != kPattern) return "memory before an output was written";
    }
  }
  return "";
}

bool Call::outputs_untouched() const {
  for (const Slot& slot : arena().used) {
    if (!slot.input && std::memcmp(slot.data, slot.before.data(), slot.bytes) != 0) return false;
  }
  return true;
}

std::string Call::digest() const {
  std::string all = std::to_string(answer_.status) + (answer_.text ? answer_.text : "");
  std::vector<const char*> addresses;  // outputs that hold pointers, which differ from run to run
  for (const Param& p : function_.params) {
    const bool lends = p.kind == Param::kStructOut && !std::strcmp(p.type, "sgrt_view");
    const auto* slot =
        p.kind == Param::kHandleOut || p.kind == Param::kLentOut || lends ? get<char*>(args_.data(), p) : nullptr;
    if (!slot) continue;
    addresses.push_back(slot);
    if (answer_.status != 0 && (answer_.status < 10 || answer_.status > 19)) continue;
    void* first;
    std::memcpy(&first, slot, sizeof first);
    if (lends) all += show_view(*reinterpret_cast<const sgrt_view*>(slot));
    if (!lends && first && first != pattern()) all += show(p.type, first);
  }
  for (const Slot& slot : arena().used) {
    if (!slot.input && std::find(addresses.begin(), addresses.end(), slot.data) == addresses.end())
      all.append(slot.data, slot.bytes);
  }
  return all;
}

std::string show_view(const sgrt_view& v) {
  std::string all(reinterpret_cast<const char*>(v.shape), sizeof v.shape);
  if (!v.data) return all + "absent";
  std::int64_t index[6] = {};
  const auto size = static_cast<std::size_t>(sgrt_dtype_size(v.dtype));
  for (int i = 0; i < v.ndim; ++i) {
    if (v.shape[i] == 0) return all;
  }
  for (;;) {
    const char* at = static_cast<const char*>(v.data);
    for (int i = 0; i < v.ndim; ++i) at += index[i] * v.strides[i];
    all.append(at, size);
    int i = v.ndim - 1;
    while (i >= 0 && ++index[i] == v.shape[i]) index[i--] = 0;
    if (i < 0) return all;
  }
}

namespace {

// `type`_summary(handle, info), _array(handle, field, view), _text(handle, field, index), whatever the header has of
// them.
std::string ask(const Function& f, const void* handle) {
  std::string all;
  const bool counted = f.params.size() > 1 && f.params[1].kind == Param::kInt32;
  const bool indexed = f.params.size() > 2 && f.params[2].kind == Param::kInt32;
  for (std::int32_t field = 1; field <= (counted ? 20 : 1); ++field) {
    for (std::int32_t index = 0; index < (indexed ? 3 : 1); ++index) {
      std::vector<char> args(f.args_size), room;
      put(args.data(), f.params[0], handle);
      if (counted) put(args.data(), f.params[1], field);
      if (indexed) put(args.data(), f.params[2], index);
      const Param& last = f.params.back();
      if (last.of) {
        room.assign(last.of->size, 0);
        const auto size = static_cast<std::uint32_t>(room.size());
        if (last.of->sized) std::memcpy(room.data(), &size, sizeof size);
        put(args.data(), last, room.data());
      }
      const Answer answer = f.call(args.data());
      if (answer.text) all += answer.text;
      if (answer.status != 0 || !last.of) continue;
      all += std::strcmp(last.type, "sgrt_view") ? std::string(room.begin(), room.end())
                                                 : show_view(*reinterpret_cast<const sgrt_view*>(room.data()));
    }
  }
  return all;
}

}  // namespace

std::string show(const std::string& type, const void* handle) {
  std::string all;
  for (const Function& f : functions()) {
    if (f.name == type + "_summary" || f.name == type + "_array" || f.name == type + "_text") all += ask(f, handle);
  }
  return all;
}

}  // namespace calls
