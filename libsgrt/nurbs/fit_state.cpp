// One list of what a fit is made of, walked by a writer and by a reader that trusts nothing.
#include "nurbs/fit_state.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "nurbs/fit_result.hpp"

namespace sgrt {
namespace {

constexpr double kVersion = 1;
constexpr int kMostCells = 10'000;

[[noreturn]] void refuse(const std::string& what) {
  fail(Status::kInvalidArgument, "numbers: " + what + ", expected the state of a fit");
}

struct Writer {
  std::vector<double> numbers;

  void operator()(double& x) { numbers.push_back(x); }
  template <class Integer>
  void whole(Integer& x, std::int64_t) {
    numbers.push_back(static_cast<double>(x));
  }
  void array(double* x, std::int64_t n, bool) { numbers.insert(numbers.end(), x, x + n); }
  template <class Container>
  void resize(Container&, std::int64_t, std::int64_t) {}
};

struct Reader {
  const double* next;
  std::int64_t left;

  double take() {
    if (left-- < 1) refuse("too few");
    return *next++;
  }
  void operator()(double& x) {
    x = take();
    if (!std::isfinite(x)) refuse("not finite");
  }
  template <class Integer>
  void whole(Integer& x, std::int64_t most) {
    const double value = take();
    if (!(value >= 0 && value <= static_cast<double>(most)) || value != std::floor(value)) refuse(text_of(value));
    x = static_cast<Integer>(value);
  }
  void array(double* x, std::int64_t n, bool finite) {
    for (std::int64_t i = 0; i < n; ++i) {
      x[i] = take();
      if (finite && !std::isfinite(x[i])) refuse("not finite");
    }
  }
  void room(std::int64_t n) const {
    if (n > left) refuse("too few");
  }
  void resize(std::vector<double>& v, std::int64_t rows, std::int64_t columns) {
    room(rows * columns);
    v.resize(static_cast<std::size_t>(rows * columns));
  }
  template <class Derived>
  void resize(Eigen::PlainObjectBase<Derived>& m, std::int64_t rows, std::int64_t columns) {
    room(rows * columns);
    m.resize(rows, columns);
  }
};

template <class Walk>
void header(Walk& walk, NurbsFit& f) {
  Chart& c = f.chart;
  FitGrid& g = f.grid;
  walk.whole(c.kind, static_cast<std::int64_t>(FitChart::kGrid));
  walk.whole(c.periodic, 1), walk.whole(c.swapped, 1);
  walk.array(c.origin.data(), 3, true), walk.array(c.axes.data(), 9, true), walk.array(c.step, 2, true);
  for (double* x : {&c.radius, &c.u0, &c.v0, &c.length_u, &c.length_v, &g.hu, &g.hv}) walk(*x);
  walk.whole(g.cells_u, kMostCells), walk.whole(g.cells_v, kMostCells), walk.whole(g.periodic, 1);
  walk.whole(f.point_count, kMaxPoints), walk.whole(f.inlier_count, kMaxPoints), walk.whole(f.iterations, 1 << 20);
  walk.whole(f.has_sigma, 1), walk.whole(f.height, kMaxPoints), walk.whole(f.width, kMaxPoints);
  for (double* x : {&f.lambda, &f.effective_parameters, &f.noise}) walk(*x);
  walk.array(&f.rms, 1, false);
}

template <class Walk>
void arrays(Walk& walk, NurbsFit& f, std::int64_t points) {
  const std::int64_t n = f.grid.size(), columns = f.chart.columns();
  walk.resize(f.coefficients, n, columns), walk.array(f.coefficients.data(), n * columns, true);
  walk.resize(f.covariance, n, kNeighbourSlots), walk.array(f.covariance.data(), n * kNeighbourSlots, true);
  walk.resize(f.occupied, n, 1), walk.array(f.occupied.data(), n, true);
  walk.resize(f.residual, points, 1), walk.array(f.residual.data(), points, false);
  walk.resize(f.weight, points, 1), walk.array(f.weight.data(), points, false);
  walk.resize(f.parameters, points, 2), walk.array(f.parameters.data(), 2 * points, false);
}

void check(const NurbsFit& f, std::int64_t points) {
  const Chart& c = f.chart;
  const FitGrid& g = f.grid;
  if (c.kind == FitChart::kAuto) refuse("no chart");
  if (g.cells_u < (g.periodic ? 8 : 1) || g.cells_v < 1 || g.periodic != c.periodic) refuse("no cells");
  for (const double x : {c.radius, c.length_u, c.length_v, g.hu, g.hv})
    if (!(x > 0)) refuse(text_of(x));
  if (f.height * f.width != (f.height > 0 ? points : 0)) refuse("a grid of another size");
}

}  // namespace

std::vector<double> state_of(const NurbsFit& fit) {
  NurbsFit f = fit;
  Writer writer;
  std::int64_t points = f.residual.size();
  writer.numbers = {kVersion};
  header(writer, f);
  writer.whole(points, kMaxPoints);
  arrays(writer, f, points);
  return writer.numbers;
}

NurbsFit fit_from_state(const double* numbers, std::int64_t count) {
  Reader reader{numbers, count};
  if (const double version = reader.take(); version != kVersion) refuse("version " + text_of(version));
  NurbsFit f;
  std::int64_t points = 0;
  header(reader, f);
  reader.whole(points, kMaxPoints);
  check(f, points);
  arrays(reader, f, points);
  if (reader.left != 0) refuse(std::to_string(reader.left) + " too many");
  make_surface_of(f);
  return f;
}

}  // namespace sgrt
