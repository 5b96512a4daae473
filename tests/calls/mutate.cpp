// See mutate.hpp. An argument is reached from the arguments' struct through offsets and pointers, so that a mutation
// made from one call can be applied to the next.
#include "mutate.hpp"

#include <cmath>
#include <cstring>
#include <limits>

namespace calls {
namespace {

using Way = std::function<char*(char* args)>;  // to the place of a value

constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
constexpr double kInf = std::numeric_limits<double>::infinity();

template <class T>
T load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

Way member(const Way& of, std::size_t offset) {
  return [of, offset](char* args) { return of(args) + offset; };
}
Way target(const Way& of) {
  return [of](char* args) { return load<char*>(of(args)); };
}

class Writer {
 public:
  Writer(std::vector<Mutation>& all, char* args) : all_(all), args_(args) {}

  template <class T>
  T now(const Way& way) const {
    return load<T>(way(args_));
  }

  // Unless that is what stands there.
  template <class T>
  void set(const std::string& where, const std::string& what, const Way& way, T value) {
    const T before = now<T>(way);
    if (std::memcmp(&before, &value, sizeof value) == 0) return;
    all_.push_back({where, what, [way, value](char* args) { std::memcpy(way(args), &value, sizeof value); }});
  }

  void null(const std::string& where, const Way& way) { set(where, "NULL", way, static_cast<char*>(nullptr)); }

  void real(const std::string& where, const Way& way) {
    set(where, "NaN", way, std::nan(""));
    set(where, "Inf", way, kInf);
    set(where, "-Inf", way, -kInf);
    set(where, "1e300", way, 1e300);
    set(where, "-1e300", way, -1e300);
    set(where, "5e-324", way, 5e-324);
    set(where, "-1", way, -1.0);
    set(where, "0", way, 0.0);
  }

  void single(const std::string& where, const Way& way) {
    set(where, "NaN", way, std::nanf(""));
    set(where, "Inf", way, static_cast<float>(kInf));
    set(where, "-3e38", way, -3e38F);
    set(where, "1e-45", way, 1e-45F);
  }

  void integer(const std::string& where, const Way& way) {
    set(where, "-2^31", way, std::numeric_limits<std::int32_t>::min());
    set(where, "-1", way, std::int32_t{-1});
    set(where, "0", way, std::int32_t{0});
    set(where, "77777777", way, std::int32_t{77777777});
    set(where, "2^31-1", way, std::numeric_limits<std::int32_t>::max());
  }

  void length(const std::string& where, const Way& way) {
    const std::int64_t sizes[] = {kLeast, -1, 0, 1, std::int64_t{1} << 31, std::int64_t{1} << 61, kMost};
    const char* const words[] = {"-2^63", "-1", "0", "1", "2^31", "2^61", "2^63-1"};
    for (int i = 0; i < 7; ++i) set(where, words[i], way, sizes[i]);
  }

  void count(const std::string& where, const Way& way) {  // of int64_t: items in an array
    set(where, "-2^63", way, kLeast);
    set(where, "-1", way, std::int64_t{-1});
    set(where, "0", way, std::int64_t{0});
    set(where, "2^63-1", way, kMost);
  }

  void elements(const std::string& where, const Way& data, std::int32_t dtype, std::int64_t n) {
    for (const std::int64_t i : {std::int64_t{0}, n - 1}) {
      const std::string at = where + (i == 0 ? "[first]" : "[last]");
      const Way way = member(data, static_cast<std::size_t>(i * sgrt_dtype_size(dtype)));
      if (dtype == SGRT_F64) real(at, way);
      if (dtype == SGRT_F32) single(at, way);
      if (dtype == SGRT_I32) integer(at, way);
      if (n == 1) return;
    }
  }

  template <class View>
  void view(const std::string& where, const Way& way, bool output) {
    const auto v = load<View>(way(args_));
    if (!v.data) return;
    const Way data = member(way, offsetof(View, data)), dtype = member(way, offsetof(View, dtype));
    null(where + ".data", data);
    for (std::int32_t type : {-1, 0, 1, 2, 3, 4, 5, 6, 7, 99, 1 << 30}) {
      // One that fits into no more memory than there is.
      if (sgrt_dtype_size(type) <= sgrt_dtype_size(v.dtype)) set(where + ".dtype", std::to_string(type), dtype, type);
    }
    for (std::int32_t n : {-2147483647, -1, 0, 1, 2, 3, 4, 6, 7, 2147483647})
      set(where + ".ndim", std::to_string(n), member(way, offsetof(View, ndim)), n);
    std::int64_t n = 1;
    for (int i = 0; i < v.ndim; ++i) {
      n *= v.shape[i];
      length(where + ".shape[" + std::to_string(i) + "]", member(way, offsetof(View, shape) + 8 * i));
      const Way stride = member(way, offsetof(View, strides) + 8 * i);
      const std::string name = where + ".strides[" + std::to_string(i) + "]";
      set(name, "0", stride, std::int64_t{0});
      if (sgrt_dtype_size(v.dtype) > 1) set(name, "1", stride, std::int64_t{1});
      set(name, "2^62", stride, std::int64_t{1} << 62);
      set(name, "2^63-1", stride, kMost);
      set(name, "-2^63", stride, kLeast);
      reversed<View>(name, way, i, v);
    }
    if (sgrt_dtype_size(v.dtype) > 1)
      set(where + ".data", "misaligned", data, reinterpret_cast<std::uintptr_t>(v.data) - 1);
    set(where + ".data", "end of memory", data, ~std::uintptr_t{0} - 15);
    if (!output) elements(where, target(data), v.dtype, n);
  }

  // The same memory, backwards along one side.
  template <class View>
  void reversed(const std::string& where, const Way& way, int i, const View& v) {
    if (v.shape[i] < 2) return;
    all_.push_back({where, "reversed", [way, i](char* args) {
                      auto now = load<View>(way(args));
                      char* data = const_cast<char*>(static_cast<const char*>(now.data));
                      now.data = data + now.strides[i] * (now.shape[i] - 1);
                      now.strides[i] = -now.strides[i];
                      std::memcpy(way(args), &now, sizeof now);
                    }});
  }

  void fields(const std::string& where, const Way& way, const Struct& s, bool output) {
    for (const Field& f : s.fields) {
      const Way at = member(way, f.offset);
      const std::string name = where + "." + f.name;
      if (s.sized && f.offset == 0) {
        struct_size(name, at, s.size);
        continue;
      }
      if (output) continue;
      for (int i = 0; i < f.count; ++i) {
        const Way item = member(at, static_cast<std::size_t>(i) * f.size);
        const std::string item_name = f.count > 1 ? name + "[" + std::to_string(i) + "]" : name;
        if (f.kind == Field::kInt32) integer(item_name, item);
        if (f.kind == Field::kInt64) count(item_name, item);
        if (f.kind == Field::kDouble) real(item_name, item);
        if (f.kind == Field::kPointer) null(item_name, item);
        if (f.kind != Field::kStruct) continue;
        const std::string type = f.of->name;
        if (type == "sgrt_view") {
          view<sgrt_view>(item_name, item, false);
        } else if (type == "sgrt_mut_view") {
          view<sgrt_mut_view>(item_name, item, true);
        } else {
          fields(item_name, item, *f.of, output);
        }
      }
    }
  }

  void struct_size(const std::string& where, const Way& way, std::size_t size) {
    const auto now = static_cast<std::uint32_t>(size);
    set(where, "0", way, std::uint32_t{0});
    set(where, "1", way, std::uint32_t{1});
    set(where, "less", way, now - 4);
    set(where, "more", way, now + 8);
    set(where, "2^31", way, std::uint32_t{1} << 31);
    set(where, "2^32-1", way, ~std::uint32_t{0});
  }

  void size(const std::string& where, const Way& way, std::size_t size, bool of_text) {
    set(where, "0", way, std::size_t{0});
    set(where, "1", way, std::size_t{1});
    set(where, "less", way, size - (of_text ? 1 : 4));
    if (of_text) set(where, "half", way, size / 2);
    if (!of_text) set(where, "more", way, size + 8);
    set(where, "2^31", way, std::size_t{1} << 31);
    set(where, "2^63", way, std::size_t{1} << 63);
    set(where, "2^64-1", way, ~std::size_t{0});
  }

  void text(const std::string& where, const Way& way) {
    null(where, way);
    const Way first = target(way);
    set(where, "empty", first, '\0');
    set(where, "not UTF-8", first, '\xff');
    set(where, "a newline", first, '\n');
  }

  void param(const Param& p) {
    const std::size_t offset = p.offset;
    const Way way = [offset](char* args) { return args + offset; };
    const bool pointer = p.kind < Param::kDouble;
    if (p.kind == Param::kText) return text(p.name, way);
    if (pointer) null(p.name, way);
    if (pointer && !now<char*>(way)) return;
    switch (p.kind) {
      case Param::kView:
        return view<sgrt_view>(p.name, target(way), false);
      case Param::kMutView:
        return view<sgrt_mut_view>(p.name, target(way), true);
      case Param::kStructIn:
        return fields(p.name, target(way), *p.of, false);
      case Param::kStructOut:
        return fields(p.name, target(way), *p.of, true);
      case Param::kNumbers:
        return elements_of(p.name, target(way), p.bytes / 8);
      case Param::kIntegers:
        return elements(p.name, target(way), SGRT_I32, static_cast<std::int64_t>(p.bytes / 4));
      case Param::kHandles:
        return null(std::string(p.name) + "[0]", target(way));
      case Param::kDouble:
        return real(p.name, way);
      case Param::kInt32:
        return integer(p.name, way);
      case Param::kInt64:
        return count(p.name, way);
      default:
        return;
    }
  }

  void elements_of(const std::string& where, const Way& way, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) real(where + "[" + std::to_string(i) + "]", member(way, 8 * i));
  }

 private:
  std::vector<Mutation>& all_;
  char* args_;
};

}  // namespace

std::vector<Mutation> mutations(const Function& function, const char* args) {
  std::vector<Mutation> all;
  Writer writer(all, const_cast<char*>(args));
  for (const Param& p : function.params) {
    if (p.kind != Param::kSize) {
      writer.param(p);
      continue;
    }
    const std::size_t offset = p.offset;
    const Way way = [offset](char* a) { return a + offset; };
    writer.size(p.name, way, writer.now<std::size_t>(way), function.params[0].kind == Param::kText);
  }
  return all;
}

}  // namespace calls
