// rig.json, schema sgrt-rig/1 (formats of the project, docs/formats/rig.md): text to Rig and back. Strict: nothing that
// is required is guessed, and each error names its field by its path. Keys that are not understood are kept for
// writing.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.hpp"
#include "core/note_json.inl"
#include "rig/rig.hpp"
#include "rig/tof_unit.hpp"

namespace sgrt {
namespace {

constexpr std::size_t kMaxCameras = 64;
constexpr const char* kSchema = "sgrt-rig/1";

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kFormat, message);
}

// --------------------------------------------------------------------------------------------------- a tree to a rig

const Json& member(const Json& object, const std::string& path, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) refuse(path + key + ": missing");
  return *found;
}

std::string text_at(const Json& object, const std::string& path, const char* key) {
  constexpr std::size_t kLongest = 1000;
  const Json& value = member(object, path, key);
  if (!value.is_string()) refuse(path + key + ": expected a text, got " + value.type_name());
  const auto& text = value.get_ref<const std::string&>();
  if (text.empty()) refuse(path + key + ": expected a text, got an empty one");
  if (text.size() > kLongest) refuse(path + key + ": expected at most 1000 bytes, got " + std::to_string(text.size()));
  for (char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) refuse(path + key + ": has a control character");
  }
  return text;
}

// Objects of an array.
const Json& list_at(const Json& object, const char* key) {
  const Json& list = member(object, "", key);
  if (!list.is_array()) refuse(std::string(key) + ": expected an array, got " + list.type_name());
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].is_object()) continue;
    refuse(std::string(key) + "[" + std::to_string(i) + "]: expected an object, got " + list[i].type_name());
  }
  return list;
}

std::vector<double> numbers(const Json& value, const std::string& path, std::size_t count) {
  const std::string expected = path + ": expected " + std::to_string(count) + " finite numbers, got ";
  if (!value.is_array()) refuse(expected + value.type_name());
  if (value.size() != count) refuse(expected + std::to_string(value.size()));
  std::vector<double> out;
  for (const Json& number : value) {
    if (!number.is_number()) refuse(expected + "a " + number.type_name());
    out.push_back(number.get<double>());
  }
  return out;
}

int side(double value, const std::string& path) {
  if (value > 32768) fail(Status::kLimit, path + ": expected at most 32768, got " + text_of(value));
  if (!(value >= 1 && value == std::floor(value)))
    refuse(path + ": expected 2 positive integers, got " + text_of(value));
  return static_cast<int>(value);
}

int distortion_count(const std::string& model, const std::string& path) {
  if (model == "pinhole") return 0;
  if (model == "brown5") return 5;
  if (model == "rational8") return 8;
  refuse(path + "model: expected pinhole, brown5 or rational8, got " + in_quotes(model));
}

const char* model_of(const Camera& camera) {
  return camera.distortion_count == 0 ? "pinhole" : camera.distortion_count == 5 ? "brown5" : "rational8";
}

Camera camera_of(const Json& json, const std::string& path) {
  Camera camera;
  camera.id = text_at(json, path, "id");
  const std::vector<double> size = numbers(member(json, path, "image_size"), path + "image_size", 2);
  camera.width = side(size[0], path + "image_size");
  camera.height = side(size[1], path + "image_size");
  const std::vector<double> k = numbers(member(json, path, "intrinsics"), path + "intrinsics", 4);
  camera.fx = k[0];
  camera.fy = k[1];
  camera.cx = k[2];
  camera.cy = k[3];
  camera.distortion_count = distortion_count(text_at(json, path, "model"), path);
  if (camera.distortion_count > 0 || json.contains("distortion")) {
    const auto count = static_cast<std::size_t>(camera.distortion_count);
    const std::vector<double> d = numbers(member(json, path, "distortion"), path + "distortion", count);
    std::copy(d.begin(), d.end(), camera.distortion.begin());
  }
  const Json& pose = member(json, path, "camera_from_room");
  if (!pose.is_array() || pose.size() != 4) refuse(path + "camera_from_room: expected 4 rows of 4 numbers");
  std::vector<double> rows;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<double> row = numbers(pose[i], path + "camera_from_room[" + std::to_string(i) + "]", 4);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  try {
    camera.camera_from_room = pose_from_rows(rows.data(), "camera_from_room");
    return make_camera(camera);
  } catch (const Error& error) {
    fail(error.status() == Status::kLimit ? Status::kLimit : Status::kFormat, path + error.what());
  }
}

void read_cameras(const Json& json, Rig& rig) {
  const Json& list = list_at(json, "cameras");
  if (list.empty()) refuse("cameras: expected at least one");
  if (list.size() > kMaxCameras)
    fail(Status::kLimit, "cameras: expected at most 64, got " + std::to_string(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string path = "cameras[" + std::to_string(i) + "].";
    Camera camera = camera_of(list[i], path);
    for (const Camera& other : rig.cameras) {
      if (other.id == camera.id) refuse(path + "id: " + in_quotes(camera.id) + " stands twice");
    }
    rig.cameras.push_back(std::move(camera));
  }
}

int camera_at(const Json& json, const Rig& rig, const std::string& path, const char* key) {
  try {
    return camera_index(rig, text_at(json, path, key));
  } catch (const Error& error) {
    if (error.status() == Status::kFormat) throw;
    refuse(path + key + ": " + error.what());
  }
}

void read_pairs(const Json& json, Rig& rig) {
  if (!json.contains("pairs")) return;
  const Json& list = list_at(json, "pairs");
  std::set<std::string> seen;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string path = "pairs[" + std::to_string(i) + "].";
    StereoPair pair{text_at(list[i], path, "id"), camera_at(list[i], rig, path, "left"),
                    camera_at(list[i], rig, path, "right")};
    if (pair.left == pair.right)
      refuse(path + "right: the same camera as left, " +
             in_quotes(rig.cameras[static_cast<std::size_t>(pair.left)].id));
    if (!seen.insert(pair.id).second) refuse(path + "id: " + in_quotes(pair.id) + " stands twice");
    rig.pairs.push_back(std::move(pair));
  }
}

#include "rig/tof_json.inl"

// "uncertainty" is optional; what is there must be whole.
void read_uncertainty(const Json& json, Rig& rig) {
  const auto found = json.find("uncertainty");
  if (found == json.end()) return;
  const std::string path = "uncertainty.";
  if (!found->is_object()) refuse(std::string("uncertainty: expected an object, got ") + found->type_name());
  const Json& names = member(*found, path, "parameters");
  const Json& modes = member(*found, path, "modes");
  if (!names.is_array() || !modes.is_array()) refuse(path + "parameters, modes: expected arrays");
  std::set<std::string> seen;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string here = path + "parameters[" + std::to_string(i) + "]: ";
    if (!names[i].is_string()) refuse(here + "expected a text");
    rig.uncertainty.parameters.push_back(names[i].get<std::string>());
    if (!seen.insert(rig.uncertainty.parameters.back()).second)
      refuse(here + in_quotes(rig.uncertainty.parameters.back()) + " stands twice");
  }
  std::vector<std::vector<double>> columns;  // all read before there is a matrix: a text promises no more than it holds
  columns.reserve(modes.size());
  for (std::size_t i = 0; i < modes.size(); ++i)
    columns.push_back(numbers(modes[i], path + "modes[" + std::to_string(i) + "]", names.size()));
  rig.uncertainty.modes.resize(static_cast<Eigen::Index>(names.size()), static_cast<Eigen::Index>(modes.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    rig.uncertainty.modes.col(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::VectorXd>(columns[i].data(), static_cast<Eigen::Index>(columns[i].size()));
  }
  const auto residual = found->find("residual_px");
  if (residual == found->end()) return;
  if (!residual->is_number() || !(residual->get<double>() >= 0)) refuse(path + "residual_px: expected a number >= 0");
  rig.uncertainty.residual_px = residual->get<double>();
}

Rig rig_of(const Json& json) {
  if (!json.is_object()) refuse(std::string("rig: expected an object, got ") + json.type_name());
  const std::string schema = text_at(json, "", "schema");
  if (schema != kSchema) refuse("schema: expected 'sgrt-rig/1', got " + in_quotes(schema));
  Rig rig;
  rig.id = text_at(json, "", "id");
  rig.room = text_at(json, "", "room");
  read_cameras(json, rig);
  read_pairs(json, rig);
  read_tofs(json, rig);
  read_uncertainty(json, rig);
  return rig;
}

// --------------------------------------------------------------------------------------------------- a rig to a tree

bool same(const Camera& a, const Camera& b) {
  return a.id == b.id && a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.distortion_count == b.distortion_count && a.distortion == b.distortion &&
         a.camera_from_room.R == b.camera_from_room.R && a.camera_from_room.t == b.camera_from_room.t;
}

bool same(const StereoPair& a, const StereoPair& b) {
  return a.id == b.id && a.left == b.left && a.right == b.right;
}

bool same(const RigUncertainty& a, const RigUncertainty& b) {
  return a.parameters == b.parameters && a.residual_px == b.residual_px && a.modes.rows() == b.modes.rows() &&
         a.modes.cols() == b.modes.cols() && a.modes == b.modes;
}

bool same(const Rig& a, const Rig& b) {
  const auto equal = [](const auto& x, const auto& y) { return same(x, y); };
  return a.id == b.id && a.room == b.room && same(a.uncertainty, b.uncertainty) &&
         std::equal(a.cameras.begin(), a.cameras.end(), b.cameras.begin(), b.cameras.end(), equal) &&
         std::equal(a.pairs.begin(), a.pairs.end(), b.pairs.begin(), b.pairs.end(), equal) &&
         std::equal(a.tofs.begin(), a.tofs.end(), b.tofs.begin(), b.tofs.end(), equal);
}

// The object of the list with this id, so that its unknown keys stay; else a new one.
Note with_id(const Note& document, const char* list, const std::string& id) {
  const Note* all = document.find(list);
  for (std::size_t i = 0; all && i < all->size(); ++i) {
    const Note* own = all->item(i).find("id");
    if (own && own->is_text(id)) return all->item(i);
  }
  Note item;
  item["id"] = id;
  return item;
}

const std::string& id_of(const Rig& rig, int camera) {
  if (camera < 0 || camera >= static_cast<int>(rig.cameras.size()))
    refuse("pairs: no camera " + std::to_string(camera));
  return rig.cameras[static_cast<std::size_t>(camera)].id;
}

void write_camera(const Camera& camera, Note& json) {
  json["image_size"] = Note::list(camera.width, camera.height);
  json["model"] = model_of(camera);
  json["intrinsics"] = Note::list(camera.fx, camera.fy, camera.cx, camera.cy);
  json.erase("distortion");
  if (camera.distortion_count > 0) {
    json["distortion"] =
        std::vector<double>(camera.distortion.begin(), camera.distortion.begin() + camera.distortion_count);
  }
  json["camera_from_room"] = rows_of(camera.camera_from_room.matrix());
}

void write_uncertainty(const RigUncertainty& u, Note& json) {
  if (u.parameters.empty()) {
    json.erase("uncertainty");
    return;
  }
  Note& uncertainty = json["uncertainty"];
  uncertainty["parameters"] = u.parameters;
  uncertainty["modes"] = rows_of(u.modes.transpose());
  if (u.residual_px > 0) uncertainty["residual_px"] = u.residual_px;
}

}  // namespace

Rig rig_from_json(const char* text, std::size_t size) {
  Rig rig = rig_of(parse_json(text, size, "rig").root);
  rig.document.assign(text, size);
  return rig;
}

// Unchanged since it was read: the text as it was. Else the known fields are written over it.
std::string rig_to_json(const Rig& rig) {
  Note json;
  Rig before;
  if (!rig.document.empty()) {
    const JsonTree read = parse_json(rig.document.data(), rig.document.size(), "rig");
    before = rig_of(read.root);
    if (same(rig, before)) return rig.document;
    json = note_of(read.root);
  }
  const Note old = json;
  json["schema"] = kSchema;
  json["id"] = rig.id;
  json["room"] = rig.room;
  Note cameras = Note::list(), pairs = Note::list(), tofs = Note::list();
  for (const Camera& camera : rig.cameras) {
    Note item = with_id(old, "cameras", camera.id);
    const auto was =
        std::find_if(before.cameras.begin(), before.cameras.end(), [&](const Camera& c) { return same(c, camera); });
    if (was == before.cameras.end()) write_camera(camera, item);  // else its own digits stay
    cameras.add(std::move(item));
  }
  for (const StereoPair& pair : rig.pairs) {
    Note item = with_id(old, "pairs", pair.id);
    item["left"] = id_of(rig, pair.left);
    item["right"] = id_of(rig, pair.right);
    pairs.add(std::move(item));
  }
  json["cameras"] = std::move(cameras);
  json["pairs"] = std::move(pairs);
  for (const TofUnit& unit : rig.tofs) {
    Note item = with_id(old, "tofs", unit.id);
    const bool changed =
        std::none_of(before.tofs.begin(), before.tofs.end(), [&](const TofUnit& u) { return same(u, unit); });
    if (changed) write_tof(unit, id_of(rig, unit.camera), item);
    tofs.add(std::move(item));
  }
  json.erase("tofs");
  if (tofs.size() > 0) json["tofs"] = std::move(tofs);
  if (!same(rig.uncertainty, before.uncertainty)) write_uncertainty(rig.uncertainty, json);
  const std::string text = note_text(json, "rig");
  rig_of(parse_json(text.data(), text.size(), "rig").root);  // it can be read: a rig made in memory is checked here
  return text;
}

}  // namespace sgrt
