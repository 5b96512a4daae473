// See registration/reference.hpp.
#include "registration/reference.hpp"

#include <algorithm>

#include "core/error.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMinPoints = 6;

bool usable(const Surface& s, std::int64_t i) {
  return s.present(i) && (!s.has_normals() || s.normals(i, 0) == s.normals(i, 0));
}

// The mean of the samples' modes at each surfel; a coarser level has the mean of its children.
std::vector<std::vector<float>> spread_mode(const SurfelField& field, const Surface& surface, const Points& mode) {
  std::vector<std::vector<float>> out;
  std::vector<double> sum(3 * field.levels[0].surfels.size(), 0), count(field.levels[0].surfels.size(), 0);
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!usable(surface, i) || !mode.row(i).allFinite()) continue;
    const std::int32_t code = find_surfel(field, surface.point(i) - field.centre, 0, 1);
    if (code < 0) continue;
    for (int k = 0; k < 3; ++k) sum[3 * index_of(code) + static_cast<std::size_t>(k)] += mode(i, k);
    count[index_of(code)] += 1;
  }
  for (std::size_t level = 0; level < field.levels.size(); ++level) {
    std::vector<float>& mean = out.emplace_back(sum.size(), 0.0F);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      mean[i] = count[i / 3] > 0 ? static_cast<float>(sum[i] / count[i / 3]) : 0.0F;
    }
    if (level + 1 == field.levels.size()) break;
    const std::size_t n = field.levels[level + 1].surfels.size();
    std::vector<double> upper(3 * n, 0), of(n, 0);
    for (std::size_t i = 1; i < count.size(); ++i) {
      const auto parent = static_cast<std::size_t>(field.levels[level].parent[i]);
      for (std::size_t k = 0; k < 3; ++k) upper[3 * parent + k] += sum[3 * i + k];
      of[parent] += count[i];
    }
    sum = upper;
    count = of;
  }
  return out;
}

}  // namespace

std::shared_ptr<const Reference> prepare_reference(const Run& run, const Surface& surface, const Roi* roi) {
  auto out = std::make_shared<Reference>();
  out->has_normals = surface.has_normals();
  out->has_roi = roi != nullptr;
  out->correlation_points = surface.correlation_points;
  out->mode_names = surface.mode_names;
  std::vector<std::uint8_t> counts;
  if (roi != nullptr) counts.assign(static_cast<std::size_t>(surface.size()), 0);
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!usable(surface, i) || (roi != nullptr && !contains(*roi, surface, i))) continue;
    if (roi != nullptr) counts[static_cast<std::size_t>(i)] = 1;
    ++out->point_count;
  }
  const auto refuse = [&](std::int64_t count) {
    fail(Status::kInsufficientData, std::string("the reference") + (roi != nullptr ? " within the roi" : "") + " has " +
                                        std::to_string(count) +
                                        " usable points (present, with a normal), at least 6 are needed");
  };
  if (out->point_count < kMinPoints) refuse(out->point_count);
  out->field = make_surfels(run, surface, counts);
  if (out->field.count == 0) refuse(0);
  std::vector<float> height;
  for (const kernels::Surfel& s : out->field.levels[0].surfels) {
    if (s.counts > 0) height.push_back(s.height);
  }
  out->typical_height = median(height);
  for (const Points& mode : surface.modes) out->modes.push_back(spread_mode(out->field, surface, mode));
  return out;
}

}  // namespace sgrt
