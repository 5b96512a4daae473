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

sgrt_status sgrt_roi_move(const sgrt_roi* roi, const double pose[16], sgrt_roi** result) {
  return guard([&] {
    need(roi, "roi");
    need(result, "result");
    *result = new sgrt_roi{moved(roi->roi, rigid(pose, "pose"))};
  });
}

sgrt_status sgrt_roi_array(const sgrt_roi* roi, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(roi, "roi");
    need(view, "view");
    if (field != SGRT_ROI_POLYGON && field != SGRT_ROI_BOX)
      refuse("field", std::to_string(field), "SGRT_ROI_POLYGON (1) or SGRT_ROI_BOX (2)");
    const auto vertices = static_cast<std::int64_t>(roi->roi.polygon.size());
    const bool box = vertices == 0;
    if ((field == SGRT_ROI_BOX) != box) {
      *view = sgrt_view{};
    } else {
      static_assert(offsetof(Roi, box_max) == offsetof(Roi, box_min) + sizeof(Vec3));
      *view = box ? lend(roi->roi.box_min.data(), SGRT_F64, {2, 3})
                  : lend(roi->roi.polygon[0].data(), SGRT_F64, {vertices, 2});
    }
  });
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
