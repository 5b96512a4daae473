// A value that a const handle makes at the first wish for it: once, from any thread. Where making it fails it stays
// unmade, and the next wish tries again. By a mutex: std::call_once has the unwinder load code of its own, and ends the
// program where there is no memory for that.
#pragma once

#include <mutex>
#include <optional>

namespace sgrt {

template <class T>
class Lazy {
 public:
  template <class Make>
  const T& get(Make&& make) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!value_) value_.emplace(make());
    return *value_;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::optional<T> value_;
};

}  // namespace sgrt
