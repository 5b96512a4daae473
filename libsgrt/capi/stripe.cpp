// The centre of a laser stripe in each line of an image.
#include <algorithm>

#include "capi/laser.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(StripeMethod::kCentroid) == SGRT_STRIPE_CENTROID &&
              static_cast<int>(StripeMethod::kGaussian) == SGRT_STRIPE_GAUSSIAN &&
              static_cast<int>(StripeMethod::kRidge) == SGRT_STRIPE_RIDGE);
static_assert(static_cast<int>(LineReason::kNone) == SGRT_REASON_NONE &&
              static_cast<int>(LineReason::kOutOfView) == SGRT_REASON_OUT_OF_VIEW &&
              static_cast<int>(LineReason::kNoStripe) == SGRT_REASON_NO_TEXTURE &&
              static_cast<int>(LineReason::kSaturated) == SGRT_REASON_SATURATED &&
              static_cast<int>(LineReason::kNoMatch) == SGRT_REASON_NO_MATCH &&
              static_cast<int>(LineReason::kAmbiguous) == SGRT_REASON_AMBIGUOUS &&
              static_cast<int>(LineReason::kEdge) == SGRT_REASON_EDGE);

sgrt_stripe_options to_c(const StripeOptions& o) {
  sgrt_stripe_options c{};
  c.struct_size = sizeof c;
  c.method = static_cast<std::int32_t>(o.method);
  c.columns = o.columns ? 1 : 0;
  c.min_length = o.min_length;
  c.half_width_px = o.half_width;
  c.min_signal = o.min_signal;
  c.noise = o.noise;
  c.gain = o.gain;
  c.saturation = o.saturation;
  c.max_asymmetry = o.max_asymmetry;
  return c;
}

sgrt_view array_of(const Stripe& s, std::int32_t field) {
  const auto n = static_cast<std::int64_t>(s.centre.size());
  switch (field) {
    case SGRT_STRIPE_CENTRE:
      return lend(s.centre.data(), SGRT_F64, {n});
    case SGRT_STRIPE_SIGMA:
      return lend(s.sigma.data(), SGRT_F32, {n});
    case SGRT_STRIPE_SIGNAL:
      return lend(s.signal.data(), SGRT_F32, {n});
    case SGRT_STRIPE_WIDTH:
      return lend(s.width.data(), SGRT_F32, {n});
    case SGRT_STRIPE_ASYMMETRY:
      return lend(s.asymmetry.data(), SGRT_F32, {n});
    case SGRT_STRIPE_REASON:
      return lend(s.reason.data(), SGRT_U8, {n});
    default:
      refuse("field", std::to_string(field), "SGRT_STRIPE_CENTRE (1) to SGRT_STRIPE_REASON (6)");
  }
}

}  // namespace

// The core checks the values.
StripeOptions stripe_options_from_c(const sgrt_stripe_options* given) {
  const sgrt_stripe_options c = read_struct(given, to_c(StripeOptions{}), "options.struct_size");
  check_range(c.method, SGRT_STRIPE_CENTROID, SGRT_STRIPE_RIDGE, "method");
  check_range(c.columns, 0, 1, "columns");
  StripeOptions o;
  o.method = static_cast<StripeMethod>(c.method);
  o.columns = c.columns != 0;
  o.min_length = c.min_length;
  o.half_width = c.half_width_px;
  o.min_signal = c.min_signal;
  o.noise = c.noise;
  o.gain = c.gain;
  o.saturation = c.saturation;
  o.max_asymmetry = c.max_asymmetry;
  check_options(o);
  return o;
}

}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_stripe_options_init(sgrt_stripe_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(StripeOptions{}), "options"); });
}

sgrt_status sgrt_stripe_extract(sgrt_context* context, const sgrt_view* image, const sgrt_view* dark,
                                const sgrt_stripe_options* options, sgrt_stripe** result) {
  return guard([&] {
    need(result, "result");
    const ImageView view = image_of(image, "image");
    const DarkFrame below(dark);
    const StripeOptions o = stripe_options_from_c(options);
    auto handle = std::make_unique<sgrt_stripe>();
    handle->stripe = extract_stripe(run_of(context), view, below.get(), o);
    *result = handle.release();
    return answer((*result)->stripe.status, (*result)->stripe.message.c_str());
  });
}

void sgrt_stripe_free(sgrt_stripe* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_stripe_summary(const sgrt_stripe* result, sgrt_stripe_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    const Stripe& s = result->stripe;
    sgrt_stripe_info c{};
    c.line_count = static_cast<std::int32_t>(s.centre.size());
    c.found_count = s.found;
    std::copy(s.reason_count.begin(), s.reason_count.end(), c.reason_count);
    c.noise = s.noise;
    c.fit_scale = s.fit_scale;
    c.median_sigma_px = s.median_sigma;
    write_struct(info, c);
  });
}

sgrt_status sgrt_stripe_array(const sgrt_stripe* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(result->stripe, field);
  });
}
