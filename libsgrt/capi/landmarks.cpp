// Landmark models, and landmarks on a surface.
#include <algorithm>
#include <limits>
#include <string>

#include "capi/outward.hpp"

namespace sgrt {
namespace {

std::unique_ptr<sgrt_landmark_model> model_handle(LandmarkModel model) {
  auto handle = std::make_unique<sgrt_landmark_model>();
  const auto n = static_cast<Eigen::Index>(model.points.size());
  handle->positions.resize(n, 3);
  handle->normals.resize(n, 3);
  handle->curvature.reserve(2 * model.points.size());
  handle->sigma.reserve(model.points.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const LandmarkPoint& p = model.points[static_cast<std::size_t>(i)];
    handle->positions.row(i) = p.position.transpose();
    handle->normals.row(i) = p.normal.transpose();
    handle->curvature.insert(handle->curvature.end(), {p.k1, p.k2});
    handle->sigma.push_back(p.sigma);
  }
  handle->model = std::move(model);
  return handle;
}

sgrt_landmark_learn_options to_c(const LearnOptions& o) {
  sgrt_landmark_learn_options c{};
  c.struct_size = sizeof c;
  c.count = o.count;
  c.scale_mm = o.scale;
  c.patch_mm = o.patch;
  return c;
}

LearnOptions from_c(const sgrt_landmark_learn_options& c) {
  LearnOptions o;
  check_range(c.count, 4, kMaxLandmarks, "options.count");
  check_range(c.scale_mm, 0, 50, "options.scale_mm");
  check_range(c.patch_mm, 5, 50, "options.patch_mm");
  o.count = c.count;
  o.scale = c.scale_mm;
  o.patch = c.patch_mm;
  return o;
}

sgrt_landmarks_options to_c(const LocateOptions& o) {
  sgrt_landmarks_options c{};
  c.struct_size = sizeof c;
  c.min_points = o.min_points;
  c.min_score = o.min_score;
  c.noise_mm = o.noise;
  return c;
}

LocateOptions from_c(const sgrt_landmarks_options& c) {
  LocateOptions o;
  check_range(c.min_points, 3, kMaxLandmarks, "options.min_points");
  check_range(c.min_score, 0, 1, "options.min_score");
  check_range(c.noise_mm, 0, kMaxCoordinate, "options.noise_mm");
  o.min_points = c.min_points;
  o.min_score = c.min_score;
  o.noise = c.noise_mm;
  return o;
}

std::unique_ptr<sgrt_landmarks> result_handle(LocatedLandmarks landmarks) {
  auto handle = std::make_unique<sgrt_landmarks>();
  const std::size_t n = landmarks.points.size();
  handle->positions.reserve(3 * n);
  handle->covariance.reserve(9 * n);
  handle->repeat_covariance.reserve(9 * n);
  handle->scores.reserve(n);
  for (const Landmark& l : landmarks.points) {
    handle->positions.insert(handle->positions.end(), l.position.data(), l.position.data() + 3);
    handle->covariance.insert(handle->covariance.end(), l.covariance.data(), l.covariance.data() + 9);
    const double* repeat = l.repeat_covariance.data();
    handle->repeat_covariance.insert(handle->repeat_covariance.end(), repeat, repeat + 9);
    handle->scores.push_back(l.score);
  }
  handle->landmarks = std::move(landmarks);
  return handle;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_landmark_model_head(sgrt_landmark_model** model) {
  return guard([&] {
    need(model, "model");
    *model = model_handle(head_model()).release();
  });
}

sgrt_status sgrt_landmark_model_from_json(const char* text, size_t size, sgrt_landmark_model** model) {
  return guard([&] {
    need(text, "text");
    need(model, "model");
    *model = model_handle(model_from_json(text, size)).release();
  });
}

sgrt_status sgrt_landmark_learn_options_init(sgrt_landmark_learn_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(LearnOptions{}), "options"); });
}

sgrt_status sgrt_landmark_model_learn(sgrt_context* context, const sgrt_surface* reference,
                                      const sgrt_landmark_model* named, const sgrt_landmark_learn_options* options,
                                      sgrt_landmark_model** model) {
  return guard([&] {
    need(reference, "reference");
    need(model, "model");
    need_outward(*reference->surface, "reference");
    const LearnOptions o = from_c(read_struct(options, to_c(LearnOptions{}), "options.struct_size"));
    *model =
        model_handle(learn_model(run_of(context), *reference->surface, named ? &named->model : nullptr, o)).release();
  });
}

void sgrt_landmark_model_free(sgrt_landmark_model* model) {
  guard([&] { delete model; });
}

const char* sgrt_landmark_model_text(const sgrt_landmark_model* model, int32_t field, int32_t index) {
  return guard_text([&]() -> const char* {
    if (!model) return nullptr;
    const auto& points = model->model.points;
    switch (field) {
      case SGRT_LANDMARK_MODEL_JSON:
        if (index != 0) return nullptr;
        return model->json.get([&] { return model_to_json(model->model); }).c_str();
      case SGRT_LANDMARK_MODEL_ID:
        return index == 0 ? model->model.id.c_str() : nullptr;
      case SGRT_LANDMARK_MODEL_NAME:
        return index >= 0 && static_cast<std::size_t>(index) < points.size()
                   ? points[static_cast<std::size_t>(index)].name.c_str()
                   : nullptr;
      default:
        return nullptr;
    }
  });
}

sgrt_status sgrt_landmark_model_array(const sgrt_landmark_model* model, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(model, "model");
    need(view, "view");
    const auto n = static_cast<std::int64_t>(model->sigma.size());
    switch (field) {
      case SGRT_LANDMARK_MODEL_POSITIONS:
        *view = lend(model->positions.data(), SGRT_F64, {n, 3});
        break;
      case SGRT_LANDMARK_MODEL_NORMALS:
        *view = lend(model->normals.data(), SGRT_F64, {n, 3});
        break;
      case SGRT_LANDMARK_MODEL_CURVATURE:
        *view = lend(model->curvature.data(), SGRT_F64, {n, 2});
        break;
      case SGRT_LANDMARK_MODEL_SIGMA:
        *view = lend(model->sigma.data(), SGRT_F64, {n});
        break;
      default:
        refuse("field", std::to_string(field), "SGRT_LANDMARK_MODEL_POSITIONS (1) to SGRT_LANDMARK_MODEL_SIGMA (4)");
    }
  });
}

sgrt_status sgrt_landmarks_options_init(sgrt_landmarks_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(LocateOptions{}), "options"); });
}

sgrt_status sgrt_landmarks_find(sgrt_context* context, const sgrt_surface* surface, const sgrt_landmark_model* model,
                                const sgrt_landmarks_options* options, sgrt_landmarks** result) {
  return guard([&] {
    need(surface, "surface");
    need(model, "model");
    need(result, "result");
    need_outward(*surface->surface, "surface");
    const LocateOptions o = from_c(read_struct(options, to_c(LocateOptions{}), "options.struct_size"));
    *result = result_handle(locate(run_of(context), *surface->surface, model->model, o)).release();
    return answer((*result)->landmarks.status, (*result)->landmarks.message.c_str());
  });
}

void sgrt_landmarks_free(sgrt_landmarks* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_landmarks_summary(const sgrt_landmarks* result, sgrt_landmarks_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    const LocatedLandmarks& l = result->landmarks;
    sgrt_landmarks_info i{};
    i.status = static_cast<sgrt_status>(l.status);
    i.point_count = static_cast<std::int32_t>(l.points.size());
    i.found_count = static_cast<std::int32_t>(
        std::count_if(l.points.begin(), l.points.end(), [](const Landmark& p) { return p.found; }));
    i.matched_count = l.matched;
    i.seen_count = l.seen;
    i.candidate_count = l.candidates;
    i.score = l.score;
    i.runner_up_score = l.runner_up_score;
    pose_to_rows(l.live_from_model, i.live_from_model);
    if (l.status != Status::kOk) std::fill_n(i.live_from_model, 16, std::numeric_limits<double>::quiet_NaN());
    i.size = l.size;
    i.scale_mm = l.scale;
    i.noise_mm = l.noise;
    write_struct(info, i);
  });
}

sgrt_status sgrt_landmarks_array(const sgrt_landmarks* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    const auto n = static_cast<std::int64_t>(result->scores.size());
    switch (field) {
      case SGRT_LANDMARKS_POSITIONS:
        *view = lend(result->positions.data(), SGRT_F64, {n, 3});
        break;
      case SGRT_LANDMARKS_COVARIANCE:
        *view = lend(result->covariance.data(), SGRT_F64, {n, 3, 3});
        break;
      case SGRT_LANDMARKS_REPEAT_COVARIANCE:
        *view = lend(result->repeat_covariance.data(), SGRT_F64, {n, 3, 3});
        break;
      case SGRT_LANDMARKS_SCORES:
        *view = lend(result->scores.data(), SGRT_F64, {n});
        break;
      default:
        refuse("field", std::to_string(field), "SGRT_LANDMARKS_POSITIONS (1) to SGRT_LANDMARKS_REPEAT_COVARIANCE (4)");
    }
  });
}

const char* sgrt_landmarks_text(const sgrt_landmarks* result, int32_t field, int32_t index) {
  return guard_text([&]() -> const char* {
    if (!result) return nullptr;
    const LocatedLandmarks& l = result->landmarks;
    switch (field) {
      case SGRT_LANDMARKS_NAME:
        return index >= 0 && static_cast<std::size_t>(index) < l.names.size()
                   ? l.names[static_cast<std::size_t>(index)].c_str()
                   : nullptr;
      case SGRT_LANDMARKS_MESSAGE:
        return index == 0 ? l.message.c_str() : nullptr;
      default:
        return nullptr;
    }
  });
}
