// Advice on regions of interest.
#include "registration/advisor.hpp"

#include <algorithm>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMostCandidates = 1000;

sgrt_advice_options advice_defaults() {
  const AdviceOptions o;
  sgrt_advice_options c{};
  c.struct_size = sizeof c;
  c.live_sigma_mm = o.live_sigma;
  c.limit_mm = o.limit_mm;
  c.limit_deg = o.limit_deg;
  c.max_share = o.max_share;
  return c;
}

AdviceOptions from_c(const sgrt_advice_options& c) {
  check_reserved(c.reserved, "options.reserved");
  check_positive(c.live_sigma_mm, kMaxCoordinate, "options.live_sigma_mm");
  check_positive(c.limit_mm, kMaxCoordinate, "options.limit_mm");
  check_positive(c.limit_deg, 180, "options.limit_deg");
  check_range(c.max_share, 0, 1, "options.max_share");
  return {c.live_sigma_mm, c.limit_mm, c.limit_deg, c.max_share};
}

void add_row(const Forecast& f, std::vector<double>& rows) {
  const double row[] = {f.mm, f.deg, f.share, f.score, f.flagged ? 1.0 : 0.0};
  rows.insert(rows.end(), std::begin(row), std::end(row));
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_advice_options_init(sgrt_advice_options* options, size_t size) {
  return guard([&] { init_struct(options, size, advice_defaults(), "options"); });
}

sgrt_status sgrt_roi_advise(sgrt_context* context, const sgrt_surface* reference, const double isocentre_mm[3],
                            const sgrt_roi* const* candidates, int64_t count, const sgrt_advice_options* options,
                            sgrt_advice** result) {
  return guard([&] {
    need(reference, "reference");
    need(result, "result");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    check_range(static_cast<double>(count), 0, kMostCandidates, "count");
    if (count > 0) need(candidates, "candidates");
    std::vector<const Roi*> rois;
    rois.reserve(static_cast<std::size_t>(count));
    for (std::int64_t i = 0; i < count; ++i) {
      need(candidates[i], ("candidates[" + std::to_string(i) + "]").c_str());
      rois.push_back(&candidates[i]->roi);
    }
    const AdviceOptions o = from_c(read_struct(options, advice_defaults(), "options.struct_size"));
    auto handle = std::make_unique<sgrt_advice>();
    handle->advice = advise(run_of(context), *reference->surface, rois, isocentre, o);
    handle->forecast.reserve(5 * (rois.size() + 1));
    for (const Forecast& f : handle->advice.candidates) add_row(f, handle->forecast);
    add_row(handle->advice.proposal, handle->forecast);
    *result = handle.release();
  });
}

void sgrt_advice_free(sgrt_advice* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_advice_summary(const sgrt_advice* result, sgrt_advice_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    const Advice& a = result->advice;
    sgrt_advice_info out{};
    out.candidate_count = static_cast<std::int32_t>(a.candidates.size());
    out.best = a.order.empty() ? -1 : a.order[0];
    out.better = a.better ? 1 : 0;
    write_struct(info, out);
  });
}

sgrt_status sgrt_advice_array(const sgrt_advice* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    const Advice& a = result->advice;
    const auto n = static_cast<std::int64_t>(a.candidates.size());
    switch (field) {
      case SGRT_ADVICE_FORECAST:
        *view = lend(result->forecast.data(), SGRT_F64, {n + 1, 5});
        break;
      case SGRT_ADVICE_ORDER:
        *view = n > 0 ? lend(a.order.data(), SGRT_I32, {n}) : sgrt_view{};
        break;
      case SGRT_ADVICE_POLYGON:
        *view = lend(a.polygon.data(), SGRT_F64, {a.polygon.rows(), 2});
        break;
      default:
        refuse("field", std::to_string(field), "SGRT_ADVICE_FORECAST (1) to SGRT_ADVICE_POLYGON (3)");
    }
  });
}

const char* sgrt_advice_text(const sgrt_advice* result, int32_t index) {
  return guard_text([&]() -> const char* {
    if (!result || index < 0) return nullptr;
    const Advice& a = result->advice;
    const auto i = static_cast<std::size_t>(index);
    if (i > a.candidates.size()) return nullptr;
    return i == a.candidates.size() ? a.proposal.words.c_str() : a.candidates[i].words.c_str();
  });
}
