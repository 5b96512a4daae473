// ICP as it is told in textbooks, on the prepared reference: closest points, one residual, one kernel, step, repeat; on
// all live points. For comparison and for scenes that the fast search (search.hpp) was not made for; the certificate is
// the same. docs/theory/icp.md section 3.
#pragma once

#include "registration/search.hpp"

namespace sgrt {

// Whether the options ask for it.
bool is_classic(const IcpOptions& options);

// As search().
Search classic_search(const Run& run, const Reference& reference, const Surface& live, const Pose& initial,
                      const IcpOptions& options, Workspace& work);

}  // namespace sgrt
