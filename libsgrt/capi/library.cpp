// The library itself: version, status words, the message of the last failure and the guard's exceptions.
#include <cstring>
#include <new>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

constexpr std::size_t kMessageSize = 512;
// A fixed buffer: keeping a message cannot fail, not even without memory.
thread_local char message_of_thread[kMessageSize] = "";

void keep(const char* message) noexcept {
  std::size_t n = std::strlen(message);
  if (n >= kMessageSize) {
    n = kMessageSize - 1;
    while (n > 0 && (message[n] & 0xC0) == 0x80) --n;  // not in the middle of a UTF-8 character
  }
  std::memcpy(message_of_thread, message, n);
  message_of_thread[n] = '\0';
}

constexpr bool same(Status status, sgrt_status number) {
  return static_cast<sgrt_status>(status) == number;
}
static_assert(same(Status::kOk, SGRT_OK) && same(Status::kInvalidArgument, SGRT_E_INVALID_ARGUMENT) &&
              same(Status::kFormat, SGRT_E_FORMAT) && same(Status::kInsufficientData, SGRT_E_INSUFFICIENT_DATA) &&
              same(Status::kDegenerate, SGRT_E_DEGENERATE) && same(Status::kNotConverged, SGRT_E_NOT_CONVERGED) &&
              same(Status::kNotFound, SGRT_E_NOT_FOUND) && same(Status::kCancelled, SGRT_E_CANCELLED) &&
              same(Status::kOutOfMemory, SGRT_E_OUT_OF_MEMORY) && same(Status::kLimit, SGRT_E_LIMIT) &&
              same(Status::kInternal, SGRT_E_INTERNAL));

}  // namespace

sgrt_status answer(Status status, const char* message) noexcept {
  if (status != Status::kOk) keep(message);
  return static_cast<sgrt_status>(status);
}

sgrt_status answer_exception() noexcept {
  try {
    throw;
  } catch (const Error& error) {
    return answer(error.status(), error.what());
  } catch (const std::bad_alloc&) {
    return answer(Status::kOutOfMemory, "out of memory");
  } catch (const std::exception& error) {
    return answer(Status::kInternal, error.what());
  } catch (...) {
    return answer(Status::kInternal, "an exception of an unknown type");
  }
}

}  // namespace sgrt

#define TEXT_OF(number) TEXT_OF_TOKEN(number)
#define TEXT_OF_TOKEN(token) #token

const char* sgrt_version(void) {
  return TEXT_OF(SGRT_VERSION_MAJOR) "." TEXT_OF(SGRT_VERSION_MINOR) "." TEXT_OF(SGRT_VERSION_PATCH);
}

const char* sgrt_last_error(void) {
  return sgrt::message_of_thread;
}

const char* sgrt_status_word(sgrt_status status) {
  switch (status) {
    case SGRT_OK:
      return "ok";
    case SGRT_E_INVALID_ARGUMENT:
      return "invalid_argument";
    case SGRT_E_FORMAT:
      return "format";
    case SGRT_E_INSUFFICIENT_DATA:
      return "insufficient_data";
    case SGRT_E_DEGENERATE:
      return "degenerate";
    case SGRT_E_NOT_CONVERGED:
      return "not_converged";
    case SGRT_E_NOT_FOUND:
      return "not_found";
    case SGRT_E_CANCELLED:
      return "cancelled";
    case SGRT_E_OUT_OF_MEMORY:
      return "out_of_memory";
    case SGRT_E_LIMIT:
      return "limit";
    case SGRT_E_INTERNAL:
      return "internal";
    default:
      return "unknown";
  }
}
