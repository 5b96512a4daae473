// Version and statuses. The exception classes stand in sgrt/errors.py; a status finds its class there.
#include "bindings.hpp"

namespace sgrt_py {

void raise(sgrt_status status, const std::string& message, const py::object& result) {
  const py::object type = py::module_::import("sgrt.errors").attr("class_of")(status);
  const py::object error = type(message, py::arg("result") = result);
  PyErr_SetObject(type.ptr(), error.ptr());
  throw py::error_already_set();
}

const char* c_text(const std::string& text, const char* name) {
  if (text.find('\0') != std::string::npos) invalid(std::string(name) + ": a NUL character in the text");
  return text.c_str();
}

void register_library(py::module_& m) {
  m.def(
      "version", [] { return sgrt_version(); }, "The library's version, \"major.minor.patch\".\n\nC: sgrt_version");
  m.def(
      "status_word", [](int32_t status) { return sgrt_status_word(status); }, py::arg("status"),
      "The word of a status as it stands in JSON: \"ok\", \"degenerate\", ...; \"unknown\" for any other number.\n\n"
      "C: sgrt_status_word");
}

}  // namespace sgrt_py
