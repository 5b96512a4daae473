// Landmark models as text, schema "sgrt-landmark-model/1": id, scale_mm, size_range, patch_spacing_mm, patch_sigma_mm,
// and points of name, position_mm, normal, k1_per_mm, k2_per_mm, sigma_mm and patch_mm, and skin of position_mm, normal
// and sigma_mm.
#include <cmath>

#include <nlohmann/json.hpp>

#include "core/note_json.inl"
#include "core/within.hpp"
#include "shape/landmark_model.hpp"

namespace sgrt {
namespace {

constexpr const char* kSchema = "sgrt-landmark-model/1";
constexpr std::size_t kMaxPatch = 4096;

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kFormat, message);
}

const Json& member(const Json& object, const char* key, const std::string& path) {
  const auto found = object.find(key);
  if (found == object.end()) refuse(path + key + ": missing");
  return *found;
}

double number(const Json& value, const std::string& path) {
  if (!value.is_number()) refuse(path + ": expected a number, got " + value.type_name());
  return value.get<double>();
}

std::string text(const Json& value, const std::string& path) {
  if (!value.is_string()) refuse(path + ": expected a text, got " + value.type_name());
  std::string words = value.get<std::string>();
  // A NUL would cut a name short where it is lent to C, so that two could become one.
  for (char c : words)
    if (static_cast<unsigned char>(c) < 0x20) refuse(path + ": has a control character");
  return words;
}

Vec3 vector(const Json& value, const std::string& path) {
  if (!value.is_array() || value.size() != 3) refuse(path + ": expected three numbers");
  return Vec3(number(value[0], path + "[0]"), number(value[1], path + "[1]"), number(value[2], path + "[2]"));
}

LandmarkPoint point_of(const Json& j, const std::string& path) {
  if (!j.is_object()) refuse(path.substr(0, path.size() - 1) + ": expected an object, got " + j.type_name());
  LandmarkPoint p;
  p.name = text(member(j, "name", path), path + "name");
  p.position = vector(member(j, "position_mm", path), path + "position_mm");
  p.normal = vector(member(j, "normal", path), path + "normal");
  p.k1 = number(member(j, "k1_per_mm", path), path + "k1_per_mm");
  p.k2 = number(member(j, "k2_per_mm", path), path + "k2_per_mm");
  p.sigma = number(member(j, "sigma_mm", path), path + "sigma_mm");
  if (const auto rows = j.find("place_covariance_mm2"); rows != j.end()) {
    if (!rows->is_array() || rows->size() != 3) refuse(path + "place_covariance_mm2: expected three rows");
    for (int k = 0; k < 3; ++k)
      p.place_covariance.row(k) =
          vector((*rows)[static_cast<std::size_t>(k)], path + "place_covariance_mm2[" + std::to_string(k) + "]")
              .transpose();
  }
  const auto patch = j.find("patch_mm");
  if (patch == j.end()) return p;
  if (!patch->is_array() || patch->size() > kMaxPatch) refuse(path + "patch_mm: expected up to 4096 points");
  p.patch.resize(static_cast<Eigen::Index>(patch->size()), 3);
  for (std::size_t i = 0; i < patch->size(); ++i)
    p.patch.row(static_cast<Eigen::Index>(i)) =
        vector((*patch)[i], path + "patch_mm[" + std::to_string(i) + "]").transpose();
  return p;
}

SkinPlace skin_of(const Json& j, const std::string& path) {
  if (!j.is_object()) refuse(path.substr(0, path.size() - 1) + ": expected an object, got " + j.type_name());
  return {vector(member(j, "position_mm", path), path + "position_mm"),
          vector(member(j, "normal", path), path + "normal"), number(member(j, "sigma_mm", path), path + "sigma_mm")};
}

double optional_number(const Json& j, const char* key, double otherwise) {
  const auto found = j.find(key);
  return found == j.end() ? otherwise : number(*found, key);
}

}  // namespace

void check_model(const LandmarkModel& m) {
  if (m.points.size() < 4 || m.points.size() > kMaxLandmarks)
    refuse("points: " + std::to_string(m.points.size()) + ", expected 4 to 64");
  if (!(m.scale > 0 && m.scale <= 50)) refuse("scale_mm: " + text_of(m.scale) + ", expected up to 50");
  if (!(m.size_range >= 0 && m.size_range <= 0.5))
    refuse("size_range: " + text_of(m.size_range) + ", expected 0 to 0.5");
  if (!(m.patch_spacing >= 0 && m.patch_spacing <= 50)) refuse("patch_spacing_mm: expected 0 to 50");
  if (!(m.patch_sigma >= 0 && m.patch_sigma <= 50)) refuse("patch_sigma_mm: expected 0 to 50");
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    const LandmarkPoint& p = m.points[i];
    const std::string path = "points[" + std::to_string(i) + "].";
    if (p.name.empty() || p.name.size() > 64) refuse(path + "name: expected 1 to 64 bytes");
    for (std::size_t k = 0; k < i; ++k)
      if (m.points[k].name == p.name) refuse(path + "name: " + in_quotes(p.name) + " stands twice");
    if (!within(p.position, kMaxCoordinate)) refuse(path + "position_mm: expected within 1e5 mm");
    if (!(std::abs(p.normal.norm() - 1) < 1e-3)) refuse(path + "normal: expected a unit vector");
    if (!(std::abs(p.k1) <= 100 && std::abs(p.k2) <= 100 && p.k1 >= p.k2 && p.k1 + p.k2 != 0))
      refuse(path + "k1_per_mm: expected at least k2_per_mm, their sum not 0");
    if (!(p.sigma > 0 && p.sigma <= 100))
      refuse(path + "sigma_mm: " + text_of(p.sigma) + ", expected above 0, up to 100");
    const Mat3& place = p.place_covariance;
    if (!place.allFinite() || !(place.cwiseAbs().maxCoeff() <= 1e4) ||
        !((place - place.transpose()).cwiseAbs().maxCoeff() <= 1e-9) ||
        !(Eigen::SelfAdjointEigenSolver<Mat3>(place).eigenvalues()[0] >= -1e-9))
      refuse(path + "place_covariance_mm2: expected a covariance of up to 1e4 mm2");
    if (!within(p.patch, kMaxCoordinate)) refuse(path + "patch_mm: expected within 1e5 mm");
  }
  for (std::size_t i = 0; i < m.skin.size(); ++i) {
    const SkinPlace& p = m.skin[i];
    const std::string path = "skin[" + std::to_string(i) + "].";
    if (!within(p.position, kMaxCoordinate)) refuse(path + "position_mm: expected within 1e5 mm");
    if (!(std::abs(p.normal.norm() - 1) < 1e-3)) refuse(path + "normal: expected a unit vector");
    if (!(p.sigma > 0 && p.sigma <= 100))
      refuse(path + "sigma_mm: " + text_of(p.sigma) + ", expected above 0, up to 100");
  }
}

std::string model_to_json(const LandmarkModel& m) {
  Note points = Note::list(), skin = Note::list();
  for (const LandmarkPoint& p : m.points) {
    Note q = Note::object();
    q.append("name", p.name);
    q.append("position_mm", list_of(p.position));
    q.append("normal", list_of(p.normal));
    q.append("k1_per_mm", p.k1);
    q.append("k2_per_mm", p.k2);
    q.append("sigma_mm", p.sigma);
    if (!p.place_covariance.isZero(0)) q.append("place_covariance_mm2", rows_of(p.place_covariance));
    if (p.patch.rows() > 0) q.append("patch_mm", rows_of(p.patch));
    points.add(std::move(q));
  }
  for (const SkinPlace& p : m.skin) {
    Note q = Note::object();
    q.append("position_mm", list_of(p.position));
    q.append("normal", list_of(p.normal));
    q.append("sigma_mm", p.sigma);
    skin.add(std::move(q));
  }
  Note note = Note::object();
  note.append("schema", kSchema);
  note.append("id", m.id);
  note.append("scale_mm", m.scale);
  note.append("size_range", m.size_range);
  note.append("patch_spacing_mm", m.patch_spacing);
  note.append("patch_sigma_mm", m.patch_sigma);
  note.append("points", std::move(points));
  if (!m.skin.empty()) note.append("skin", std::move(skin));
  return note_text(note, "landmark model", NoteForm::kCompact);
}

LandmarkModel model_from_json(const char* text_begin, std::size_t size) {
  const JsonTree tree = parse_json(text_begin, size, "landmark model");
  const Json& j = tree.root;
  if (!j.is_object()) refuse(std::string("landmark model: expected an object, got ") + j.type_name());
  const std::string schema = text(member(j, "schema", ""), "schema");
  if (schema != kSchema) refuse("schema: expected 'sgrt-landmark-model/1', got " + in_quotes(schema));
  LandmarkModel m;
  m.id = text(member(j, "id", ""), "id");
  m.scale = number(member(j, "scale_mm", ""), "scale_mm");
  m.size_range = optional_number(j, "size_range", 0);
  m.patch_spacing = optional_number(j, "patch_spacing_mm", 0);
  m.patch_sigma = optional_number(j, "patch_sigma_mm", 0);
  const Json& points = member(j, "points", "");
  if (!points.is_array()) refuse(std::string("points: expected an array, got ") + points.type_name());
  if (points.size() > kMaxLandmarks) refuse("points: " + std::to_string(points.size()) + ", expected 4 to 64");
  m.points.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    m.points.push_back(point_of(points[i], "points[" + std::to_string(i) + "]."));
  if (const auto skin = j.find("skin"); skin != j.end()) {
    if (!skin->is_array() || skin->size() > kMaxLandmarks) refuse("skin: expected up to 64 places");
    m.skin.reserve(skin->size());
    for (std::size_t i = 0; i < skin->size(); ++i)
      m.skin.push_back(skin_of((*skin)[i], "skin[" + std::to_string(i) + "]."));
  }
  check_model(m);
  return m;
}

}  // namespace sgrt
