// Landmark-model JSON: what is read, what is refused and how the message names it, and that what is written reads back.
#include "expect.hpp"
#include "shape/landmark_model.hpp"

namespace sgrt {
namespace {

using test::expect_error;

std::string point(const std::string& name, const std::string& more = "") {
  return R"({"name": ")" + name + R"(", "position_mm": [1, 2, 3], "normal": [0, 0, 1], "k1_per_mm": 0.1,
             "k2_per_mm": 0.05, "sigma_mm": 2)" +
         more + "}";
}

std::string model() {
  return R"({"schema": "sgrt-landmark-model/1", "id": "head", "scale_mm": 6, "size_range": 0.1, "patch_spacing_mm": 2,
             "patch_sigma_mm": 0.3, "points": [)" +
         point("a", R"(, "patch_mm": [[0, 0, 0], [1, 0.5, -0.25]])") + "," + point("b") + "," + point("c") + "," +
         point("d") + R"(], "skin": [{"position_mm": [4, 5, 6], "normal": [0, 1, 0], "sigma_mm": 7}]})";
}

LandmarkModel read(const std::string& text) {
  return model_from_json(text.data(), text.size());
}

void expect_refused(const std::string& from, const std::string& to, const std::string& words) {
  SCOPED_TRACE(from + " -> " + to.substr(0, 100));
  std::string text = model();
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, from.size(), to);
  expect_error(Status::kFormat, words, [&] { read(text); });
}

TEST(LandmarkJson, ReadsAndWritesToTheLastBit) {
  const LandmarkModel m = read(model());
  EXPECT_EQ(m.id, "head");
  EXPECT_EQ(m.scale, 6);
  ASSERT_EQ(m.points.size(), 4U);
  EXPECT_EQ(m.points[0].name, "a");
  EXPECT_EQ(m.points[0].position, Vec3(1, 2, 3));
  ASSERT_EQ(m.points[0].patch.rows(), 2);
  EXPECT_EQ(m.points[0].patch(1, 2), -0.25);
  EXPECT_EQ(m.points[1].patch.rows(), 0);
  ASSERT_EQ(m.skin.size(), 1U);
  EXPECT_EQ(m.skin[0].position, Vec3(4, 5, 6));
  EXPECT_EQ(m.skin[0].sigma, 7);
  LandmarkModel odd = m;
  odd.points[2].k1 = 0.1 + 0.2;
  odd.points[3].sigma = 5e-324;
  const std::string text = model_to_json(odd);
  EXPECT_EQ(read(text).points[2].k1, odd.points[2].k1);
  EXPECT_EQ(read(text).points[3].sigma, odd.points[3].sigma);
  EXPECT_EQ(model_to_json(read(text)), text);
}

TEST(LandmarkJson, EachFieldIsNamed) {
  expect_refused("sgrt-landmark-model/1", "other", "schema: expected 'sgrt-landmark-model/1', got 'other'");
  expect_refused("\"id\": \"head\",", "", "id: missing");
  expect_refused("\"head\"", "7", "id: expected a text, got number");
  expect_refused("\"scale_mm\": 6", "\"scale_mm\": 51", "scale_mm: 51, expected up to 50");
  expect_refused("\"scale_mm\": 6", "\"scale_mm\": 0", "scale_mm: 0");
  expect_refused("\"scale_mm\": 6", "\"scale_mm\": null", "scale_mm");
  expect_refused("\"size_range\": 0.1", "\"size_range\": 0.6", "size_range: 0.6, expected 0 to 0.5");
  expect_refused("\"patch_spacing_mm\": 2", "\"patch_spacing_mm\": -1", "patch_spacing_mm: expected 0 to 50");
  expect_refused("\"patch_sigma_mm\": 0.3", "\"patch_sigma_mm\": 51", "patch_sigma_mm: expected 0 to 50");
  expect_refused("\"points\": [", "\"points\": 1, \"x\": [", "points: expected an array");
  expect_refused("\"points\": [", "\"points\": [3,", "points[0]: expected an object");
  expect_refused("\"name\": \"a\"", "\"name\": \"\"", "points[0].name: expected 1 to 64 bytes");
  expect_refused("\"name\": \"a\"", "\"name\": \"" + std::string(65, 'x') + "\"", "points[0].name: expected 1 to 64");
  expect_refused("\"name\": \"b\"", "\"name\": \"a\"", "points[1].name: 'a' stands twice");
  expect_refused("\"name\": \"a\"", "\"name\": \"a\\u0000b\"", "points[0].name: has a control character");
  expect_refused("[1, 2, 3]", "[1, 2]", "points[0].position_mm: expected three numbers");
  expect_refused("[1, 2, 3]", "[1, 2, 1e6]", "points[0].position_mm: expected within 1e5 mm");
  expect_refused("[0, 0, 1]", "[0, 0, 2]", "points[0].normal: expected a unit vector");
  expect_refused("\"k1_per_mm\": 0.1", "\"k1_per_mm\": 0.01", "points[0].k1_per_mm: expected at least k2_per_mm");
  expect_refused("\"k1_per_mm\": 0.1", "\"k1_per_mm\": -0.05", "points[0].k1_per_mm");
  expect_refused("\"sigma_mm\": 2", "\"sigma_mm\": 0", "points[0].sigma_mm: 0, expected above 0, up to 100");
  expect_refused("[[0, 0, 0],", "[[0, 0, 1e6],", "points[0].patch_mm: expected within 1e5 mm");
  expect_refused("[[0, 0, 0],", "[[0, 0],", "points[0].patch_mm[0]: expected three numbers");
  expect_refused("[[0, 0, 0], [1, 0.5, -0.25]]", "7", "points[0].patch_mm: expected up to 4096 points");
  expect_refused("\"skin\": [", "\"skin\": 1, \"x\": [", "skin: expected up to 64 places");
  expect_refused("\"skin\": [", "\"skin\": [3,", "skin[0]: expected an object");
  expect_refused("[4, 5, 6]", "[4, 5, 1e6]", "skin[0].position_mm: expected within 1e5 mm");
  expect_refused("[0, 1, 0]", "[0, 1, 1]", "skin[0].normal: expected a unit vector");
  expect_refused("\"sigma_mm\": 7", "\"sigma_mm\": 0", "skin[0].sigma_mm: 0, expected above 0, up to 100");
}

TEST(LandmarkJson, FewerThanFourPointsAndMoreThanSixtyFour) {
  std::string few = R"({"schema": "sgrt-landmark-model/1", "id": "x", "scale_mm": 6, "points": [)" + point("a");
  std::string many = few;
  for (int i = 0; i < 64; ++i) many += "," + point("p" + std::to_string(i));
  expect_error(Status::kFormat, "points: 1, expected 4 to 64", [&] { read(few + "]}"); });
  expect_error(Status::kFormat, "points: 65, expected 4 to 64", [&] { read(many + "]}"); });
  expect_error(Status::kFormat, "landmark model", [&] { read("[1]"); });
}

}  // namespace
}  // namespace sgrt
