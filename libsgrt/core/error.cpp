// The few functions behind core/error.hpp and core/eigen.hpp.
#include "core/error.hpp"

#include <charconv>

#include "core/eigen.hpp"

namespace sgrt {

std::string text_of(double value) {
  char text[32];  // the longest shortest form is 24 characters: -1.7976931348623157e+308
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  return std::string(text, end.ptr);
}

std::string in_quotes(const std::string& text) {
  constexpr std::size_t kLength = 80;
  std::string out = "'";
  for (char c : text.substr(0, kLength)) {
    const auto byte = static_cast<unsigned char>(c);
    out += byte >= 0x20 && byte < 0x7f ? c : '?';
  }
  return out + (text.size() > kLength ? "...'" : "'");
}

void fail_eigen(const char* condition) {
  fail(Status::kInternal, std::string("Eigen precondition broken: ") + condition);
}

}  // namespace sgrt
