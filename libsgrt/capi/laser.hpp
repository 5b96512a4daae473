// The handles of stripes and sweeps, and what their calls share.
#pragma once

#include "capi/capi.hpp"
#include "laser/sweep.hpp"

struct sgrt_stripe {
  sgrt::Stripe stripe;
};

struct sgrt_laser {
  sgrt::LaserResult result;
};

struct sgrt_laser_session {
  sgrt::Sweep sweep;
  double reference_time;
};

namespace sgrt {

StripeOptions stripe_options_from_c(const sgrt_stripe_options* given);

// A dark frame that may be absent.
struct DarkFrame {
  explicit DarkFrame(const sgrt_view* view) : there(!absent(view)) {
    if (there) image = image_of(view, "dark");
  }
  const ImageView* get() const { return there ? &image : nullptr; }
  bool there;
  ImageView image;
};

}  // namespace sgrt
