// Regions of interest.
#include "capi/capi.hpp"

using namespace sgrt;

namespace {
constexpr std::int64_t kMaxVertices = 100'000;
}

sgrt_status sgrt_roi_from_polygon(const sgrt_view* vertices_xy_mm, sgrt_roi** roi) {
  return guard([&] {
    need(roi, "roi");
    check_view(vertices_xy_mm, "vertices_xy_mm", Kind::kReal, {kAny, 2});
    check_limit(vertices_xy_mm->shape[0], kMaxVertices, "vertices_xy_mm");
    std::vector<double> numbers(static_cast<std::size_t>(vertices_xy_mm->shape[0]) * 2);
    read_view(*vertices_xy_mm, numbers.data());
    std::vector<Vec2> vertices;
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      const std::string name = "vertices_xy_mm[" + std::to_string(i / 2) + "]";
      check_place(numbers.data() + i, 2, name.c_str());
      vertices.emplace_back(numbers[i], numbers[i + 1]);
    }
    *roi = new sgrt_roi{roi_from_polygon(std::move(vertices))};
  });
}

sgrt_status sgrt_roi_from_box(const double min_mm[3], const double max_mm[3], sgrt_roi** roi) {
  return guard([&] {
    need(roi, "roi");
    *roi = new sgrt_roi{roi_from_box(place(min_mm, "min_mm"), place(max_mm, "max_mm"))};
  });
}

void sgrt_roi_free(sgrt_roi* roi) {
  guard([&] { delete roi; });
}

sgrt_status sgrt_roi_mask(const sgrt_roi* roi, const sgrt_surface* surface, const sgrt_mut_view* mask) {
  return guard([&] {
    need(roi, "roi");
    need(surface, "surface");
    const Surface& s = *surface->surface;
    check_output_beside(mask, "mask", SGRT_U8, s.size(), s.height);
    std::vector<std::uint8_t> inside(static_cast<std::size_t>(s.size()));
    for (std::int64_t i = 0; i < s.size(); ++i) inside[i] = s.present(i) && contains(roi->roi, s, i) ? 1 : 0;
    write_view(*mask, inside.data());
  });
}
