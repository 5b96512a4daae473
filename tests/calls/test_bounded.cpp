// Promise 11: a long call can be stopped. Every base call that takes a context is cancelled at its first, its middle
// and its last poll, and must then give SGRT_E_CANCELLED with its outputs untouched, and its usual bytes when it is
// called again. Those that do not poll are listed here; they are short. A callback that throws is SGRT_E_INTERNAL. Then
// shapes that a search tree does not like: all points in one place, on a line, each a hundred times; every call must
// end, and polls on its way.
//
//   test_bounded [expected.txt] [--points N]   of the bad shapes, 20,000 unless said; SGRT_SHOW=1 prints each
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <set>
#include <stdexcept>

#include "args.hpp"
#include "calls.hpp"

using namespace calls;

namespace {

int failures = 0;

void failed(const std::string& where, const std::string& why) {
  ++failures;
  std::fprintf(stderr, "%s: %s\n", where.c_str(), why.c_str());
}

struct Polls {
  long seen = 0, stop_at = 0;  // 0: never
  double longest_s = 0;        // between two polls
  std::chrono::steady_clock::time_point last;
};

std::int32_t poll(void* user, double fraction, const char* stage) {
  auto& p = *static_cast<Polls*>(user);
  const auto now = std::chrono::steady_clock::now();
  p.longest_s = std::max(p.longest_s, std::chrono::duration<double>(now - p.last).count());
  p.last = now;
  if (!(fraction >= 0 && fraction <= 1) || !stage || !*stage) failed("progress", "a fraction out of range or no stage");
  return ++p.seen == p.stop_at;
}

// Single steps and short loops: nothing to stop.
const std::set<std::string> kNoPolls = {
    "sgrt_surface_create",       "sgrt_surface_from_height_field", "sgrt_surface_move",
    "sgrt_laser_session_create", "sgrt_nurbs_curve_evaluate",      "sgrt_nurbs_surface_evaluate",
    "sgrt_nurbs_surface_grid",   "sgrt_nurbs_surface_normals",     "sgrt_reference_predict",
};

void check_cancel(const Function& f) {
  Polls polls;
  sgrt_context* context = context_with(1, poll, &polls);
  context_of_calls = context;
  std::string digest;
  {
    Call whole(f);  // what a session does in its making polls too
    polls = Polls{};
    whole.run();
    digest = whole.digest();
  }
  const long n = polls.seen;
  {
    if ((n == 0) != (kNoPolls.count(f.name) > 0)) failed(f.name, "polls " + std::to_string(n) + " times");
    for (const long stop : std::set<long>{std::min(1L, n), n / 2, n}) {
      if (stop == 0) continue;
      polls = Polls{};
      Call call(f);
      call.seal();
      polls = Polls{0, stop, 0, {}};
      const Answer answer = call.run();
      call.open();
      const bool lends = std::strstr(f.name, "session_push") || !std::strcmp(f.name, "sgrt_tracker_push");
      if (answer.status != SGRT_E_CANCELLED)
        failed(f.name, "stopped at poll " + std::to_string(stop) + " of " + std::to_string(n) + " it gives " +
                           sgrt_status_word(answer.status));
      if (!lends && !call.outputs_untouched()) failed(f.name, "an output was written");
      if (polls.seen != stop) failed(f.name, "polls on after it was stopped");
      polls = Polls{};
      call.run();
      if (std::strcmp(f.name, "sgrt_tracker_push") && call.digest() != digest)
        failed(f.name, "other bytes after it was stopped");
    }
  }
  context_of_calls = nullptr;
  sgrt_context_free(context);
}

// A callback in C++ that throws: the exception stops at the library, as SGRT_E_INTERNAL, and the context works on.
std::int32_t throws(void* user, double, const char*) {
  if (*static_cast<int*>(user) == 1) throw std::runtime_error("thrown by a callback");
  if (*static_cast<int*>(user) == 2) throw 42;
  return 0;
}

void check_throw(const Function& f) {
  int how = 0;
  sgrt_context* context = context_with(2, throws, &how);
  context_of_calls = context;
  for (const int kind : {1, 2}) {
    how = 0;  // not in the making of a session
    Call call(f);
    how = kind;
    const Answer answer = call.run();
    const char* words = kind == 1 ? "thrown by a callback" : "an exception of an unknown type";
    if (answer.status != SGRT_E_INTERNAL || std::strcmp(sgrt_last_error(), words))
      failed(f.name, std::string("a callback that throws gives ") + sgrt_status_word(answer.status));
    how = 0;
    const Answer again = call.run();
    if (again.status == SGRT_E_INTERNAL) failed(f.name, std::string("after a throw: ") + sgrt_last_error());
  }
  context_of_calls = nullptr;
  sgrt_context_free(context);
}

struct Shape {
  const char* name;
  std::vector<double> points;
};

std::vector<Shape> bad_shapes(int n) {
  std::vector<Shape> shapes = {{"one place", {}}, {"a line", {}}, {"a hundred times each", {}}, {"a comb", {}}};
  for (int i = 0; i < n; ++i) {
    shapes[0].points.insert(shapes[0].points.end(), {1, 2, 3});
    shapes[1].points.insert(shapes[1].points.end(), {0.001 * i, 0.002 * i, 1});
    const int k = i / 100, side = n < 10'000 ? 10 : 100;
    shapes[2].points.insert(shapes[2].points.end(), {1. * (k % side), 1. * (k / side), 3 * std::sin(0.3 * k)});
    shapes[3].points.insert(shapes[3].points.end(), {std::ldexp(1., -(i % 40)), 1e-3 * (i / 40), 0});
  }
  return shapes;
}

// What is done with a surface, whatever it is made of; the statuses are its own business but for an internal error.
void check_shape(const Shape& shape, sgrt_context* context, Polls& polls) {
  const auto n = static_cast<std::int64_t>(shape.points.size() / 3);
  sgrt_surface_data d;
  sgrt_surface_data_init(&d, sizeof d);
  d.points = sgrt_view_of(shape.points.data(), SGRT_F64, n, 3, 0);
  sgrt_surface *cloud = nullptr, *skin = nullptr, *filtered = nullptr;
  sgrt_reference* reference = nullptr;
  sgrt_curvature* curvature = nullptr;
  sgrt_nurbs_fit* fit = nullptr;
  sgrt_icp* icp = nullptr;
  const double centre[3] = {0, 0, 0};
  const auto note = [&](const char* what, sgrt_status status) {
    if (status == SGRT_E_INTERNAL) failed(std::string(shape.name) + ", " + what, sgrt_last_error());
    if (std::getenv("SGRT_SHOW"))
      std::printf("%s, %s: %s, %ld polls, %.0f ms between two at most\n", shape.name, what, sgrt_status_word(status),
                  polls.seen, 1e3 * polls.longest_s);
    polls = Polls{};
    polls.last = std::chrono::steady_clock::now();
  };
  note("-", 0);
  note("surface", sgrt_surface_create(context, &d, &cloud));
  note("normals", sgrt_surface_estimate_normals(context, cloud, nullptr, &skin));
  note("filter", sgrt_surface_filter(context, skin, nullptr, &filtered, nullptr, nullptr));
  note("reference", sgrt_reference_create(context, cloud, nullptr, &reference));
  note("icp", sgrt_icp_align(context, cloud, cloud, centre, nullptr, nullptr, nullptr, &icp));
  note("curvature", sgrt_curvature_compute(context, skin, nullptr, &curvature));
  note("fit", sgrt_nurbs_fit_create(context, cloud, nullptr, &fit));
  sgrt_surface_free(cloud), sgrt_surface_free(skin), sgrt_surface_free(filtered);
  sgrt_reference_free(reference), sgrt_icp_free(icp), sgrt_curvature_free(curvature), sgrt_nurbs_fit_free(fit);
}

}  // namespace

int main(int count, char** arguments) {
  int points = 20'000;
  for (int i = 1; i + 1 < count; ++i) {
    if (!std::strcmp(arguments[i], "--points")) points = std::atoi(arguments[i + 1]);
  }
  build_world();
  for (const Function& f : functions()) {
    if (f.params.empty() || f.params[0].kind != Param::kContext) continue;
    check_cancel(f);
    if (!kNoPolls.count(f.name)) check_throw(f);
  }
  free_world();
  Polls polls;
  sgrt_context* context = context_with(2, poll, &polls);
  for (const Shape& shape : bad_shapes(points)) check_shape(shape, context, polls);
  sgrt_context_free(context);
  std::printf("%d failures\n", failures);
  return failures != 0;
}
