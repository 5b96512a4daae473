// See registration/reference.hpp.
#include "registration/reference.hpp"

namespace sgrt {

std::shared_ptr<const Reference> prepare_reference(const Run&, const Surface& surface, const Roi* roi) {
  auto reference = std::make_shared<Reference>();
  reference->surface = surface;
  if (roi != nullptr) reference->roi = *roi;
  return reference;
}

}  // namespace sgrt
