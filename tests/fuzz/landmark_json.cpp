// Landmark-model JSON: any text is refused in one line or read; what was read comes back bit for bit, and is looked for
// on a small surface.
#include <string>

#include "fuzz.hpp"

namespace {

void find(const sgrt_landmark_model* model) {
  static sgrt_surface* const live = [] {
    fuzz::Bytes none{nullptr, 0};
    return fuzz::surface(none, fuzz::patch(none, 10, 10, 0), 10, 10);
  }();
  sgrt_landmarks* found = nullptr;
  const sgrt_status status = fuzz::checked(sgrt_landmarks_find(nullptr, live, model, nullptr, &found));
  fuzz::require((status == SGRT_OK || (status >= 10 && status < 20)) == (found != nullptr),
                "a result for SGRT_OK and 10-19");
  if (found == nullptr) return;
  sgrt_landmarks_info info;
  info.struct_size = sizeof info;
  fuzz::require(fuzz::ok(sgrt_landmarks_summary(found, &info)), "a summary");
  if (status != SGRT_OK) fuzz::require(fuzz::all_nan(info.live_from_model, 16), "not found is NaN");
  sgrt_view view;
  for (int field = SGRT_LANDMARKS_POSITIONS; field <= SGRT_LANDMARKS_SCORES; ++field) {
    fuzz::require(fuzz::ok(sgrt_landmarks_array(found, field, &view)), "arrays");
  }
  sgrt_landmarks_free(found);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sgrt_landmark_model* model = nullptr;
  const sgrt_status status =
      fuzz::checked(sgrt_landmark_model_from_json(reinterpret_cast<const char*>(data), size, &model));
  fuzz::require((status == SGRT_OK) == (model != nullptr), "a handle if and only if SGRT_OK");
  if (model == nullptr) {
    fuzz::require(status == SGRT_E_FORMAT || status == SGRT_E_LIMIT, "a text is refused as format or limit");
    return 0;
  }
  const std::string text = sgrt_landmark_model_text(model, SGRT_LANDMARK_MODEL_JSON, 0);
  sgrt_landmark_model* again = nullptr;
  fuzz::require(fuzz::ok(sgrt_landmark_model_from_json(text.data(), text.size(), &again)),
                "what was written can be read");
  fuzz::require(text == sgrt_landmark_model_text(again, SGRT_LANDMARK_MODEL_JSON, 0),
                "reading and writing changes nothing");
  sgrt_landmark_model_free(again);
  sgrt_view view;
  for (int field = SGRT_LANDMARK_MODEL_POSITIONS; field <= SGRT_LANDMARK_MODEL_SIGMA; ++field) {
    fuzz::require(fuzz::ok(sgrt_landmark_model_array(model, field, &view)), "arrays");
  }
  find(model);
  sgrt_landmark_model_free(model);
  return 0;
}
