// Regions of interest.
#include "capi/capi.hpp"

using namespace sgrt;

sgrt_status sgrt_roi_from_polygon(const sgrt_view* vertices_xy_mm, sgrt_roi** roi) {
  return guard([&] {
    need(roi, "roi");
    check_view(vertices_xy_mm, "vertices_xy_mm", Kind::kReal, {kAny, 2});
    const std::int64_t n = vertices_xy_mm->shape[0];
    check_limit(n, kMaxVertices, "vertices_xy_mm");
    std::vector<Vec2> vertices(static_cast<std::size_t>(n));
    read_view(*vertices_xy_mm, n > 0 ? vertices[0].data() : nullptr);
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
