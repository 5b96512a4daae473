// Time-of-flight units of a rig.json, see rig/rig_json.cpp, which includes this inside its namespace.

std::vector<double> some_numbers(const Json& value, const std::string& path, std::size_t least, std::size_t most) {
  if (!value.is_array()) refuse(path + ": expected numbers, got " + value.type_name());
  if (value.size() < least || value.size() > most)
    refuse(path + ": expected " + std::to_string(least) + " to " + std::to_string(most) + " numbers, got " +
           std::to_string(value.size()));
  return numbers(value, path, value.size());
}

double number_or(const Json& object, const std::string& path, const char* key, double otherwise) {
  const auto found = object.find(key);
  if (found == object.end()) return otherwise;
  if (!found->is_number()) refuse(path + key + ": expected a number, got " + found->type_name());
  return found->get<double>();
}

// {"range_mm": [...], "error_mm": [...]}: knots that rise, and the error at each.
void read_correction(const Json& json, const std::string& path, const char* key, const char* knots_key,
                     std::vector<double>& knots, std::vector<double>& errors) {
  constexpr std::size_t kMostKnots = 10'000;
  const auto found = json.find(key);
  if (found == json.end()) return;
  const std::string here = path + key + ".";
  if (!found->is_object()) refuse(path + key + ": expected an object, got " + found->type_name());
  knots = some_numbers(member(*found, here, knots_key), here + knots_key, 1, kMostKnots);
  errors = numbers(member(*found, here, "error_mm"), here + "error_mm", knots.size());
  for (std::size_t i = 1; i < knots.size(); ++i) {
    if (!(knots[i] > knots[i - 1]))
      refuse(here + knots_key + "[" + std::to_string(i) + "]: " + text_of(knots[i]) + ", expected more than " +
             text_of(knots[i - 1]) + " before it");
  }
}

std::string taps_kind(const Json& json, const std::string& path) {
  if (!json.contains("taps")) return "single";
  std::string kind = text_at(json, path, "taps");
  if (kind != "single" && kind != "differential")
    refuse(path + "taps: expected single or differential, got " + in_quotes(kind));
  return kind;
}

// A file's name beside the rig: no folder, no way out of one.
std::string file_beside(const Json& json, const std::string& path, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || found->is_null()) return "";
  std::string name = text_at(json, path, key);
  if (name.front() == '/' || name.find("..") != std::string::npos || name.find_first_of("\\:") != std::string::npos)
    refuse(path + key + ": expected the name of a file beside the rig, got " + in_quotes(name));
  return name;
}

TofUnit tof_of(const Json& json, const Rig& rig, const std::string& path) {
  constexpr std::size_t kMostFrequencies = 8, kMostTaps = 32;
  TofUnit t;
  t.id = text_at(json, path, "id");
  t.camera = camera_at(json, rig, path, "camera");
  t.modulation_hz = some_numbers(member(json, path, "modulation_hz"), path + "modulation_hz", 1, kMostFrequencies);
  t.tap_phase_rad = some_numbers(member(json, path, "tap_phase_rad"), path + "tap_phase_rad", 3, kMostTaps);
  t.differential = taps_kind(json, path) == "differential";
  t.electrons_per_count = number_or(json, path, "electrons_per_count", t.electrons_per_count);
  t.read_noise_e = number_or(json, path, "read_noise_e", t.read_noise_e);
  t.refractive_index = number_or(json, path, "refractive_index", t.refractive_index);
  read_correction(json, path, "range_correction", "range_mm", t.range_mm, t.range_error_mm);
  read_correction(json, path, "amplitude_correction", "amplitude", t.amplitude, t.amplitude_error_mm);
  t.pixel_offset_file = file_beside(json, path, "pixel_offset_mm");
  try {
    check_tof(t);
  } catch (const Error& error) {
    refuse(path + error.what());
  }
  return t;
}

void read_tofs(const Json& json, Rig& rig) {
  constexpr std::size_t kMost = 64;
  if (!json.contains("tofs")) return;
  const Json& list = list_at(json, "tofs");
  if (list.size() > kMost) fail(Status::kLimit, "tofs: expected at most 64, got " + std::to_string(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string path = "tofs[" + std::to_string(i) + "].";
    TofUnit unit = tof_of(list[i], rig, path);
    for (const TofUnit& other : rig.tofs) {
      if (other.id == unit.id) refuse(path + "id: " + in_quotes(unit.id) + " stands twice");
    }
    rig.tofs.push_back(std::move(unit));
  }
}

bool same(const TofUnit& a, const TofUnit& b) {
  return a.id == b.id && a.camera == b.camera && a.modulation_hz == b.modulation_hz &&
         a.tap_phase_rad == b.tap_phase_rad && a.differential == b.differential &&
         a.electrons_per_count == b.electrons_per_count && a.read_noise_e == b.read_noise_e &&
         a.refractive_index == b.refractive_index && a.range_mm == b.range_mm && a.range_error_mm == b.range_error_mm &&
         a.amplitude == b.amplitude && a.amplitude_error_mm == b.amplitude_error_mm &&
         a.pixel_offset_file == b.pixel_offset_file;
}

void write_correction(Note& json, const char* key, const char* knots_key, const std::vector<double>& knots,
                      const std::vector<double>& errors) {
  if (knots.empty()) {
    json.erase(key);
    return;
  }
  json[key][knots_key] = knots;
  json[key]["error_mm"] = errors;
}

void write_tof(const TofUnit& t, const std::string& camera, Note& json) {
  json["camera"] = camera;
  json["modulation_hz"] = t.modulation_hz;
  json["tap_phase_rad"] = t.tap_phase_rad;
  json["taps"] = t.differential ? "differential" : "single";
  json["electrons_per_count"] = t.electrons_per_count;
  json["read_noise_e"] = t.read_noise_e;
  json["refractive_index"] = t.refractive_index;
  write_correction(json, "range_correction", "range_mm", t.range_mm, t.range_error_mm);
  write_correction(json, "amplitude_correction", "amplitude", t.amplitude, t.amplitude_error_mm);
  json.erase("pixel_offset_mm");
  if (!t.pixel_offset_file.empty()) json["pixel_offset_mm"] = t.pixel_offset_file;
}
