// NURBS fit of arbitrary floats: whatever the points and options are, a fit is finite everywhere, and its state comes
// back bit for bit.
#include "fuzz.hpp"

namespace {

void use(const sgrt_nurbs_fit* fit) {
  const double uv[] = {0, 0, 1, 1, 0.3, 0.8, 0.5, 0.5};
  const sgrt_view at = sgrt_view_of(uv, SGRT_F64, 4, 2, 0);
  auto samples = fuzz::defaults(sgrt_nurbs_fit_samples_init);
  double points[12], normals[12], sigma[4], support[4];
  samples.points = sgrt_mut_view_of(points, SGRT_F64, 4, 3, 0);
  samples.normals = sgrt_mut_view_of(normals, SGRT_F64, 4, 3, 0);
  samples.sigma_mm = sgrt_mut_view_of(sigma, SGRT_F64, 4, 0, 0);
  samples.support = sgrt_mut_view_of(support, SGRT_F64, 4, 0, 0);
  fuzz::require(fuzz::ok(sgrt_nurbs_fit_evaluate(nullptr, fit, &at, &samples)), "a fit can be evaluated");
  for (double x : points) fuzz::require(std::isfinite(x), "a fitted point is finite");
  for (int i = 0; i < 4; ++i) {
    const bool known = !std::isnan(normals[3 * i]);  // at a pole, and where a surface that runs away dwarfs the place
    fuzz::require(known ? sigma[i] >= 0 : std::isnan(sigma[i]), "a fitted point has its sigma");
  }
  for (double s : support) fuzz::require(s >= 0 && s <= 1, "support lies in [0, 1]");
  double found[2];
  const sgrt_view near = sgrt_view_of(points, SGRT_F64, 1, 3, 0);
  const sgrt_mut_view out = sgrt_mut_view_of(found, SGRT_F64, 1, 2, 0);
  fuzz::checked(sgrt_nurbs_fit_nearest(nullptr, fit, &near, &out));
  sgrt_nurbs_surface* surface = nullptr;
  fuzz::require(fuzz::ok(sgrt_nurbs_fit_surface(fit, &surface)), "a fit has its surface");
  sgrt_nurbs_surface_free(surface);
}

void round_trip(fuzz::Bytes& bytes, const sgrt_nurbs_fit* fit) {
  std::int64_t count = 0;
  fuzz::require(fuzz::ok(sgrt_nurbs_fit_state(fit, nullptr, &count)), "a fit has its state");
  std::vector<double> state(static_cast<std::size_t>(count)), again(state.size());
  sgrt_mut_view out = sgrt_mut_view_of(state.data(), SGRT_F64, count, 0, 0);
  fuzz::require(fuzz::ok(sgrt_nurbs_fit_state(fit, &out, nullptr)), "a state of that length");
  const bool damaged = bytes.below(2) == 1;
  if (damaged) state[bytes.raw<std::uint16_t>() % state.size()] = bytes.number();
  const sgrt_view in = sgrt_view_of(state.data(), SGRT_F64, count, 0, 0);
  sgrt_nurbs_fit* read = nullptr;
  const bool good = fuzz::ok(sgrt_nurbs_fit_from_state(&in, &read));
  fuzz::require(good == (read != nullptr) && (good || damaged), "a state can be read back");
  if (read == nullptr) return;
  if (!damaged) {
    out.data = again.data();
    fuzz::require(fuzz::ok(sgrt_nurbs_fit_state(read, &out, nullptr)), "the state of what was read");
    fuzz::require(std::memcmp(state.data(), again.data(), state.size() * sizeof(double)) == 0,
                  "the same state bit for bit");
  }
  sgrt_nurbs_fit_free(read);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes{data, size};
  const int rows = 1 + bytes.below(16), columns = 1 + bytes.below(16);
  auto options = fuzz::defaults(sgrt_nurbs_fit_options_init);
  options.chart = bytes.below(5);
  options.smoothing = bytes.below(3);
  options.robust = bytes.below(2);
  if (bytes.below(2) == 1) {
    for (std::int32_t& n : options.control_points) n = bytes.below(24);
  }
  if (bytes.below(4) == 3) options.lambda = bytes.number();
  if (bytes.below(4) == 3) {
    for (double& a : options.axis) a = bytes.number();
  }
  const int changes = bytes.below(3) * bytes.below(32);
  const std::vector<double> points = fuzz::patch(bytes, rows, columns, changes);
  sgrt_surface* surface = fuzz::surface(bytes, points, rows, columns);
  if (surface == nullptr) return 0;
  sgrt_nurbs_fit* fit = nullptr;
  const bool good = fuzz::ok(sgrt_nurbs_fit_create(nullptr, surface, &options, &fit));
  fuzz::require(good == (fit != nullptr), "a handle if and only if SGRT_OK");
  if (good) {
    use(fit);
    round_trip(bytes, fit);
  }
  sgrt_nurbs_fit_free(fit);
  sgrt_surface_free(surface);
  return 0;
}
