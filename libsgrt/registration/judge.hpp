// From a pose found to an answer: what speaks for it, what against it, and why there is none. docs/theory/icp.md
// section 6.
#pragma once

#include "registration/certificate.hpp"
#include "registration/icp.hpp"
#include "registration/search.hpp"

namespace sgrt {

// All NaN: no number stands for "in place" unless it was found.
IcpResult blank_result(const Surface& live, const Vec3& isocentre);
void blank(const Surface& live, const Vec3& isocentre, Detail detail, IcpResult& result);  // keeps its memory

void give_up(IcpResult& result, Status status, const std::string& message);

std::string words_of(const std::vector<FreeMotion>& free);

// Fills the result from the search, which began at `start`, and its certificate.
void judge(const Reference& reference, const Search& s, const Certificate& c, const Pose& start,
           const IcpOptions& options, Workspace& work, IcpResult& result);

// Why the two could never lie on each other: units or too few points; "" if nothing speaks against trying.
std::string misfit_of_size(const Reference& reference, const LivePoints& live);

}  // namespace sgrt
