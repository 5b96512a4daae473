/* Landmarks through C: a model learnt from a bumpy skin is found again after a motion; flat skin has none. */
#include "check.h"

enum { kSide = 61, kCount = kSide * kSide };
static double points[kSide][kSide][3], normals[kSide][kSide][3];
static const double kBumps[6][4] = {{-30, -25, 7, 6}, {25, -30, 6, 7}, {30, 20, -7, 7},
                                    {-20, 30, 7, 7},  {0, 0, -6, 6},   {-38, 5, -6, 7}};

static sgrt_surface* skin(double height) {
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  int i, j, k;
  for (i = 0; i < kSide; ++i) {
    for (j = 0; j < kSide; ++j) {
      const double x = 1.8 * (j - kSide / 2), y = 1.8 * (i - kSide / 2);
      double z = 0, zx = 0, zy = 0, length;
      for (k = 0; k < 6; ++k) {
        const double dx = x - kBumps[k][0], dy = y - kBumps[k][1], s2 = kBumps[k][3] * kBumps[k][3];
        const double e = height * kBumps[k][2] * exp(-(dx * dx + dy * dy) / (2 * s2));
        z += e, zx -= e * dx / s2, zy -= e * dy / s2;
      }
      length = sqrt(1 + zx * zx + zy * zy);
      points[i][j][0] = x, points[i][j][1] = y, points[i][j][2] = z;
      normals[i][j][0] = -zx / length, normals[i][j][1] = -zy / length, normals[i][j][2] = 1 / length;
    }
  }
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, kSide, kSide, 3);
  data.normals = sgrt_view_of(normals, SGRT_F64, kSide, kSide, 3);
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  return surface;
}

/* REQ-LMK-001 */
static void test_learns_and_finds(void) {
  static const double kPose[16] = {0, -1, 0, 10, 1, 0, 0, -20, 0, 0, 1, 30, 0, 0, 0, 1};
  sgrt_surface *reference = skin(1), *live = NULL, *flat = skin(0);
  sgrt_landmark_model *model = NULL, *again = NULL, *none = NULL;
  sgrt_landmark_learn_options learning;
  sgrt_landmarks* result = NULL;
  sgrt_landmarks_info info;
  sgrt_view from, to, whole, repeat, view;
  const char* json;
  int i;
  CHECK_OK(sgrt_surface_move(NULL, reference, kPose, &live));
  CHECK_OK(sgrt_landmark_learn_options_init(&learning, sizeof learning));
  learning.count = 6;
  CHECK_OK(sgrt_landmark_model_learn(NULL, reference, NULL, &learning, &model));
  json = sgrt_landmark_model_text(model, SGRT_LANDMARK_MODEL_JSON, 0);
  CHECK(json && sgrt_landmark_model_text(model, SGRT_LANDMARK_MODEL_ID, 0));
  CHECK_OK(sgrt_landmark_model_from_json(json, strlen(json), &again));
  CHECK_OK(sgrt_landmarks_find(NULL, live, again, NULL, &result));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_landmarks_summary(result, &info));
  CHECK(info.status == SGRT_OK && info.found_count >= 4 && info.score > 0.8);
  CHECK_NEAR(info.live_from_model[1], -1, 1e-3);
  CHECK_OK(sgrt_landmark_model_array(model, SGRT_LANDMARK_MODEL_POSITIONS, &from));
  CHECK_OK(sgrt_landmarks_array(result, SGRT_LANDMARKS_COVARIANCE, &whole));
  CHECK_OK(sgrt_landmarks_array(result, SGRT_LANDMARKS_REPEAT_COVARIANCE, &repeat));
  CHECK_OK(sgrt_landmarks_array(result, SGRT_LANDMARKS_POSITIONS, &to));
  for (i = 0; i < info.point_count; ++i) {
    const double *p = (const double*)from.data + 3 * i, *q = (const double*)to.data + 3 * i;
    if (q[0] != q[0]) continue;
    CHECK(((const double*)repeat.data)[9 * i] > 0);
    CHECK(((const double*)whole.data)[9 * i] > ((const double*)repeat.data)[9 * i]);
    CHECK_NEAR(q[0], -p[1] + 10, 0.1);
    CHECK_NEAR(q[1], p[0] - 20, 0.1);
    CHECK_NEAR(q[2], p[2] + 30, 0.1);
  }
  CHECK_OK(sgrt_landmarks_array(result, SGRT_LANDMARKS_COVARIANCE, &view));
  CHECK(view.ndim == 3 && view.shape[2] == 3);
  CHECK_OK(sgrt_landmarks_array(result, SGRT_LANDMARKS_SCORES, &view));
  CHECK_INVALID(sgrt_landmarks_array(result, 9, &view), "field");
  CHECK(!strcmp(sgrt_landmarks_text(result, SGRT_LANDMARKS_NAME, 0), "p01"));
  CHECK(!strcmp(sgrt_landmarks_text(result, SGRT_LANDMARKS_MESSAGE, 0), ""));
  CHECK(!sgrt_landmarks_text(result, SGRT_LANDMARKS_NAME, 99) && !sgrt_landmarks_text(NULL, SGRT_LANDMARKS_NAME, 0));
  sgrt_landmarks_free(result);
  /* Flat skin: not found, never invented. */
  result = NULL;
  CHECK_STATUS(sgrt_landmarks_find(NULL, flat, model, NULL, &result), SGRT_E_NOT_FOUND, "not on the surface");
  CHECK_OK(sgrt_landmarks_summary(result, &info));
  CHECK(info.status == SGRT_E_NOT_FOUND && info.found_count == 0 && info.live_from_model[0] != info.live_from_model[0]);
  CHECK_OK(sgrt_landmarks_array(result, SGRT_LANDMARKS_POSITIONS, &to));
  CHECK(((const double*)to.data)[0] != ((const double*)to.data)[0]);
  sgrt_landmarks_free(result);
  CHECK_STATUS(sgrt_landmark_model_learn(NULL, flat, NULL, NULL, &none), SGRT_E_NOT_FOUND, "stand out");
  sgrt_landmarks_free(NULL);
  sgrt_landmark_model_free(model);
  sgrt_landmark_model_free(again);
  sgrt_landmark_model_free(NULL);
  sgrt_surface_free(reference);
  sgrt_surface_free(live);
  sgrt_surface_free(flat);
}

static void test_refuses(void) {
  static const char kOther[] = "{\"schema\": \"sgrt-landmark-model/2\"}";
  static const char kFew[] =
      "{\"schema\": \"sgrt-landmark-model/1\", \"id\": \"x\", \"scale_mm\": 6, \"points\": [{\"name\": \"a\"}]}";
  static const char kCut[] =
      "{\"schema\": \"sgrt-landmark-model/1\", \"id\": \"x\", \"scale_mm\": 6, \"points\": [{\"name\": "
      "\"a\\u0000b\"}]}";
  sgrt_landmark_model *head = NULL, *model = NULL;
  sgrt_landmarks_options options;
  sgrt_landmarks* result = NULL;
  sgrt_view view;
  CHECK_OK(sgrt_landmark_model_head(&head));
  CHECK_OK(sgrt_landmark_model_array(head, SGRT_LANDMARK_MODEL_SIGMA, &view));
  CHECK(view.shape[0] == 11);
  CHECK(!strcmp(sgrt_landmark_model_text(head, SGRT_LANDMARK_MODEL_NAME, 0), "nose_apex"));
  CHECK(!sgrt_landmark_model_text(head, SGRT_LANDMARK_MODEL_NAME, 11));
  CHECK_STATUS(sgrt_landmark_model_from_json(kOther, sizeof kOther - 1, &model), SGRT_E_FORMAT, "schema");
  CHECK_STATUS(sgrt_landmark_model_from_json(kFew, sizeof kFew - 1, &model), SGRT_E_FORMAT, "position_mm");
  CHECK_STATUS(sgrt_landmark_model_from_json(kCut, sizeof kCut - 1, &model), SGRT_E_FORMAT, "points[0].name");
  CHECK_INVALID(sgrt_landmark_model_from_json(NULL, 0, &model), "text");
  CHECK_OK(sgrt_landmarks_options_init(&options, sizeof options));
  options.min_score = 2;
  {
    sgrt_surface* flat = skin(0);
    CHECK_INVALID(sgrt_landmarks_find(NULL, flat, head, &options, &result), "options.min_score");
    CHECK_INVALID(sgrt_landmarks_find(NULL, flat, NULL, NULL, &result), "model");
    sgrt_surface_free(flat);
  }
  sgrt_landmark_model_free(head);
}

int main(void) {
  test_learns_and_finds();
  test_refuses();
  return check_result();
}
