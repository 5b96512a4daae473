// Advice on regions of interest.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

using AdviceHandle = Owned<sgrt_advice, sgrt_advice_free>;

struct Advice {
  sgrt_advice_info info{};
  std::optional<Doubles> forecast, polygon;  // forecast: rows of five, the last the proposal
  std::optional<py::array_t<int32_t>> order;
  std::vector<std::string> words;

  double at(int32_t row, int column) const { return forecast->at(row, column); }
  Doubles column(int k) const {  // of the candidates
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(info.candidate_count));
    for (int32_t i = 0; i < info.candidate_count; ++i) values.push_back(at(i, k));
    return fixed_array(values.data(), {info.candidate_count});
  }
};

Advice advise(const Surface& reference, const std::vector<const Roi*>& candidates, const ArrayLike& isocentre_mm,
              double live_sigma_mm, double limit_mm, double limit_deg, double max_share, Context* context) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  auto options = defaults(sgrt_advice_options_init);
  options.live_sigma_mm = live_sigma_mm;
  options.limit_mm = limit_mm;
  options.limit_deg = limit_deg;
  options.max_share = max_share;
  std::vector<const sgrt_roi*> rois;
  rois.reserve(candidates.size());
  for (const Roi* roi : candidates) {
    if (!roi) invalid("candidates: None, expected regions");
    rois.push_back(roi->handle.get());
  }
  AdviceHandle handle;
  run(context, [&](sgrt_context* c) {
    return sgrt_roi_advise(c, reference.handle.get(), isocentre.v, rois.data(), static_cast<int64_t>(rois.size()),
                           &options, out(handle));
  });
  const sgrt_advice* raw = handle.get();
  const py::capsule base(handle.release(), [](void* p) { sgrt_advice_free(static_cast<sgrt_advice*>(p)); });
  Advice advice;
  advice.info.struct_size = sizeof advice.info;
  run([&] { return sgrt_advice_summary(raw, &advice.info); });
  sgrt_view view{};
  run([&] { return sgrt_advice_array(raw, SGRT_ADVICE_FORECAST, &view); });
  advice.forecast = lend<double>(view, base);
  run([&] { return sgrt_advice_array(raw, SGRT_ADVICE_ORDER, &view); });
  advice.order = lend<int32_t>(view, base);
  run([&] { return sgrt_advice_array(raw, SGRT_ADVICE_POLYGON, &view); });
  advice.polygon = lend<double>(view, base);
  for (int32_t i = 0; i <= advice.info.candidate_count; ++i) advice.words.emplace_back(sgrt_advice_text(raw, i));
  return advice;
}

constexpr const char* kAdviseDoc =
    R"(Which region to track: an Advice, with a forecast of each candidate and a proposal.

reference: mm, room frame. candidates: regions, or none. isocentre_mm: where errors count. live_sigma_mm: of a live point along the normal; as
many are expected as the reference has. limit_mm, limit_deg: a region whose predicted error exceeds them is flagged. max_share: of the
reference's points that the proposal may take; 0: that of the largest candidate, or 0.4.

Raises InsufficientData: fewer than 6 usable points. InvalidArgument. Cancelled.
C: sgrt_roi_advise)";

}  // namespace

void register_advice(py::module_& m) {
  const auto d = defaults(sgrt_advice_options_init);
  const auto column = [](int k) { return [k](const Advice& a) { return a.column(k); }; };
  const auto proposal = [](int k) { return [k](const Advice& a) { return a.at(a.info.candidate_count, k); }; };
  py::class_<Advice>(m, "Advice", R"(Forecasts of regions of interest, and a proposal.

C: sgrt_advice_summary, sgrt_advice_array, sgrt_advice_text)")
      .def_property_readonly("error_mm", column(0), "K: one sigma of the length of the shift at the isocentre.")
      .def_property_readonly("error_deg", column(1), "K: one sigma of the angle.")
      .def_property_readonly("share", column(2), "K: of the reference's points.")
      .def_property_readonly("score", column(3), "K: the two over their limits, squared, added, rooted.")
      .def_property_readonly(
          "flagged",
          [](const Advice& a) {
            std::vector<bool> flags;
            for (int32_t i = 0; i < a.info.candidate_count; ++i) flags.push_back(a.at(i, 4) != 0);
            return flags;
          },
          "K: it cannot keep the limits, or leaves a motion free.")
      .def_property_readonly(
          "words", [](const Advice& a) { return std::vector<std::string>(a.words.begin(), a.words.end() - 1); },
          "K: what each sees worst: 'slides along LNG'.")
      .def_readonly("order", &Advice::order, "K: the candidates, the best first; None without any.")
      .def_property_readonly(
          "better", [](const Advice& a) { return a.info.better != 0; },
          "True where the proposal promises more than every candidate.")
      .def_readonly("proposal_polygon_xy_mm", &Advice::polygon, "V x 2: the proposal, for Roi.polygon.")
      .def_property_readonly("proposal_error_mm", proposal(0), "As error_mm.")
      .def_property_readonly("proposal_error_deg", proposal(1), "As error_deg.")
      .def_property_readonly("proposal_share", proposal(2), "As share.")
      .def_property_readonly("proposal_score", proposal(3), "As score.")
      .def_property_readonly(
          "proposal_flagged", [](const Advice& a) { return a.at(a.info.candidate_count, 4) != 0; }, "As flagged.")
      .def_property_readonly(
          "proposal_words", [](const Advice& a) { return a.words.back(); }, "As words.")
      .def("__repr__", [](const Advice& a) {
        return py::str("<sgrt.Advice on {} regions, better proposal {}>")
            .format(a.info.candidate_count, a.info.better != 0);
      });
  m.def("roi_advise", &advise, py::arg("reference"), py::arg("candidates"), py::kw_only(), py::arg("isocentre_mm"),
        py::arg("live_sigma_mm") = d.live_sigma_mm, py::arg("limit_mm") = d.limit_mm,
        py::arg("limit_deg") = d.limit_deg, py::arg("max_share") = d.max_share, py::arg("context") = py::none(),
        kAdviseDoc);
}

}  // namespace sgrt_py
