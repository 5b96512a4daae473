// Filters of surfaces: in space, and over time.
#include "surface/filter.hpp"

#include <algorithm>
#include <iterator>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(FilterReason::kFiltered) == SGRT_FILTER_FILTERED &&
              static_cast<int>(FilterReason::kAbsent) == SGRT_FILTER_ABSENT &&
              static_cast<int>(FilterReason::kKept) == SGRT_FILTER_KEPT &&
              static_cast<int>(FilterReason::kOutlier) == SGRT_FILTER_OUTLIER &&
              static_cast<int>(FilterReason::kCount) == SGRT_FILTER_COUNT);
static_assert(static_cast<int>(TemporalState::kAveraged) == SGRT_TEMPORAL_AVERAGED &&
              static_cast<int>(TemporalState::kAbsent) == SGRT_TEMPORAL_ABSENT &&
              static_cast<int>(TemporalState::kStarted) == SGRT_TEMPORAL_STARTED &&
              static_cast<int>(TemporalState::kMoved) == SGRT_TEMPORAL_MOVED &&
              static_cast<int>(TemporalState::kCount) == SGRT_TEMPORAL_COUNT);
static_assert(sizeof(FilterReason) == 1 && sizeof(TemporalState) == 1);

sgrt_surface_filter_options to_c(const FilterOptions& o) {
  sgrt_surface_filter_options c{};
  c.struct_size = sizeof c;
  c.radius_mm = o.radius;
  c.max_sigmas = o.max_sigmas;
  c.min_support = o.min_support;
  return c;
}

// The core checks the values.
FilterOptions from_c(const sgrt_surface_filter_options& c) {
  check_reserved(c.reserved, "options.reserved");
  FilterOptions o;
  o.radius = c.radius_mm;
  o.max_sigmas = c.max_sigmas;
  o.min_support = c.min_support;
  return o;
}

sgrt_filter_session_options to_c(const TemporalOptions& o) {
  sgrt_filter_session_options c{};
  c.struct_size = sizeof c;
  c.motion_sigmas = o.motion_sigmas;
  c.drift_mm = o.drift;
  return c;
}

TemporalOptions from_c(const sgrt_filter_session_options& c) {
  check_reserved(c.reserved, "options.reserved");
  TemporalOptions o;
  o.motion_sigmas = c.motion_sigmas;
  o.drift = c.drift_mm;
  return o;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_surface_filter_options_init(sgrt_surface_filter_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(FilterOptions{}), "options"); });
}

sgrt_status sgrt_surface_filter(sgrt_context* context, const sgrt_surface* surface,
                                const sgrt_surface_filter_options* options, sgrt_surface** result,
                                const sgrt_mut_view* reason, sgrt_surface_filter_info* info) {
  return guard([&] {
    need(surface, "surface");
    need(result, "result");
    check_result(info, "info.struct_size");
    const Surface& s = *surface->surface;
    if (!absent(reason)) check_output_beside(reason, "reason", SGRT_U8, s.size(), s.height);
    const FilterOptions o = from_c(read_struct(options, to_c(FilterOptions{}), "options.struct_size"));
    Filtered filtered = filter(run_of(context), s, o);
    sgrt_surface_filter_info i{};
    std::copy(filtered.count.begin(), filtered.count.end(), i.count);
    i.radius_mm = filtered.radius;
    i.sigma_before_mm = filtered.sigma_before;
    i.sigma_after_mm = filtered.sigma_after;
    i.correlation_points = filtered.surface.correlation_points;
    auto handle = handle_of(std::move(filtered.surface));
    if (!absent(reason)) write_view(*reason, reinterpret_cast<const std::uint8_t*>(filtered.reason.data()));
    write_struct(info, i);
    *result = handle.release();
  });
}

sgrt_status sgrt_filter_session_options_init(sgrt_filter_session_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(TemporalOptions{}), "options"); });
}

sgrt_status sgrt_filter_session_create(const sgrt_filter_session_options* options, sgrt_filter_session** session) {
  return guard([&] {
    need(session, "session");
    const TemporalOptions o = from_c(read_struct(options, to_c(TemporalOptions{}), "options.struct_size"));
    *session = new sgrt_filter_session{TemporalFilter(o)};
  });
}

sgrt_status sgrt_filter_session_push(sgrt_context* context, sgrt_filter_session* session, const sgrt_surface* frame,
                                     double time_s, sgrt_filter_session_info* info) {
  return guard([&] {
    need(session, "session");
    need(frame, "frame");
    check_result(info, "info.struct_size");
    session->filter.push(run_of(context), *frame->surface, time_s);
    sgrt_filter_session_info i{};
    std::copy(session->filter.counts().begin(), session->filter.counts().end(), i.count);
    write_struct(info, i);
  });
}

sgrt_status sgrt_filter_session_surface(const sgrt_filter_session* session, sgrt_surface** surface) {
  return guard([&] {
    need(session, "session");
    need(surface, "surface");
    if (!session->filter.result()) fail(Status::kNotFound, "session: nothing has been pushed yet");
    *surface = handle_of(session->filter.result()).release();
  });
}

sgrt_status sgrt_filter_session_states(const sgrt_filter_session* session, sgrt_view* view) {
  return guard([&] {
    need(session, "session");
    need(view, "view");
    const TemporalFilter& f = session->filter;
    *view = f.result() ? lend(f.states().data(), SGRT_U8, {f.result()->height, f.result()->width}) : sgrt_view{};
  });
}

void sgrt_filter_session_free(sgrt_filter_session* session) {
  guard([&] { delete session; });
}
