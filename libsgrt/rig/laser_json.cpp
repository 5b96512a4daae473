// "lasers" of rig.json (docs/formats.md): text to LaserUnit and back. A rig keeps its document, in which they are
// looked up when a laser is asked for; what is written leaves every other key as it was.
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "core/note_json.inl"
#include "rig/laser.hpp"

namespace sgrt {
namespace {

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kFormat, message);
}

const Json& member(const Json& object, const std::string& path, const char* key) {
  if (!object.is_object()) refuse(path + ": expected an object, got " + object.type_name());
  const auto found = object.find(key);
  if (found == object.end()) refuse(path + "." + key + ": missing");
  return *found;
}

double number_of(const Json& value, const std::string& path) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(path + ": expected a finite number");
  return value.get<double>();
}

double number_at(const Json& object, const std::string& path, const char* key, double otherwise) {
  return object.contains(key) ? number_of(object.at(key), path + "." + key) : otherwise;
}

Vec3 vector_at(const Json& object, const std::string& path, const char* key) {
  const Json& value = member(object, path, key);
  const std::string name = path + "." + key;
  if (!value.is_array() || value.size() != 3) refuse(name + ": expected 3 numbers");
  Vec3 v;
  for (int i = 0; i < 3; ++i) v(i) = number_of(value[static_cast<std::size_t>(i)], name);
  return v;
}

Vec3 unit_at(const Json& object, const std::string& path, const char* key) {
  const Vec3 v = vector_at(object, path, key);
  if (std::abs(v.norm() - 1) > 1e-3) refuse(path + "." + key + ": length " + text_of(v.norm()) + ", expected 1");
  return v.normalized();
}

std::string text_at(const Json& object, const std::string& path, const char* key) {
  const Json& value = member(object, path, key);
  if (!value.is_string() || value.get_ref<const std::string&>().empty()) refuse(path + "." + key + ": expected a text");
  return value.get<std::string>();
}

LaserUnit unit_of(const Rig& rig, const Json& json, const std::string& path) {
  LaserUnit u;
  u.id = text_at(json, path, "id");
  const std::string camera = text_at(json, path, "camera");
  try {
    u.camera = camera_index(rig, camera);
  } catch (const Error& error) {
    refuse(path + ".camera: " + error.what());
  }
  const Json& fan = member(json, path, "fan");
  u.fan_point = vector_at(fan, path + ".fan", "point");
  u.fan_normal = unit_at(fan, path + ".fan", "normal");
  u.mirror = json.contains("mirror");
  if (!u.mirror) return u;
  const Json& mirror = json.at("mirror");
  const std::string inside = path + ".mirror";
  u.axis_point = vector_at(mirror, inside, "axis_point");
  u.axis_direction = unit_at(mirror, inside, "axis_direction");
  u.normal_at_zero = unit_at(mirror, inside, "normal_at_zero");
  u.offset = number_at(mirror, inside, "offset_mm", 0);
  u.angle_scale = number_at(mirror, inside, "angle_scale", 1);
  u.angle_zero = number_at(mirror, inside, "angle_zero_rad", 0);
  if (u.angle_scale == 0) refuse(inside + ".angle_scale: 0, expected another number");
  return u;
}

// The lasers that a rig's text lists; of a rig without any an empty array.
JsonTree lasers_of(const Rig& rig) {
  if (rig.document.empty()) return JsonTree(Json::array());
  JsonTree tree = parse_json(rig.document.data(), rig.document.size(), "rig");
  if (!tree.root.contains("lasers")) return JsonTree(Json::array());
  if (!tree.root.at("lasers").is_array()) refuse("lasers: expected an array");
  return JsonTree(std::move(tree.root.at("lasers")));
}

}  // namespace

std::vector<std::string> laser_ids(const Rig& rig) {
  std::vector<std::string> ids;
  const JsonTree tree = lasers_of(rig);
  const Json& lasers = tree.root;
  ids.reserve(lasers.size());
  for (std::size_t i = 0; i < lasers.size(); ++i)
    ids.push_back(text_at(lasers[i], "lasers[" + std::to_string(i) + "]", "id"));
  return ids;
}

LaserUnit laser_of(const Rig& rig, const std::string& id) {
  const JsonTree tree = lasers_of(rig);
  const Json& lasers = tree.root;
  const std::vector<std::string> ids = laser_ids(rig);
  std::string known;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] == id) return unit_of(rig, lasers[i], "lasers[" + std::to_string(i) + "]");
    known += (known.empty() ? "" : ", ") + in_quotes(ids[i]);
  }
  fail(Status::kInvalidArgument,
       "laser " + in_quotes(id) + " is not in the rig, which has " + (known.empty() ? "none" : known));
}

std::string rig_with_laser(const Rig& rig, const LaserUnit& u, const RigUncertainty& uncertainty) {
  Rig changed = rig;
  changed.uncertainty = uncertainty;
  const std::string text = rig_to_json(changed);
  Note json = note_of(parse_json(text.data(), text.size(), "rig").root);
  Note item = Note::object(), lasers = Note::list();
  const Note* all = json.find("lasers");
  for (std::size_t i = 0; all && i < all->size(); ++i) {
    const Note* id = all->item(i).find("id");
    if (id && id->is_text(u.id))
      item = all->item(i);
    else
      lasers.add(all->item(i));
  }
  item["id"] = u.id;
  item["camera"] = rig.cameras[static_cast<std::size_t>(u.camera)].id;
  Note& fan = item["fan"];
  fan["point"] = list_of(u.fan_point);
  fan["normal"] = list_of(u.fan_normal);
  if (u.mirror) {
    Note& mirror = item["mirror"];
    mirror["axis_point"] = list_of(u.axis_point);
    mirror["axis_direction"] = list_of(u.axis_direction);
    mirror["normal_at_zero"] = list_of(u.normal_at_zero);
    mirror["offset_mm"] = u.offset;
    mirror["angle_scale"] = u.angle_scale;
    mirror["angle_zero_rad"] = u.angle_zero;
  } else {
    item.erase("mirror");
  }
  lasers.add(std::move(item));
  json["lasers"] = std::move(lasers);
  return note_text(json, "rig");
}

}  // namespace sgrt
