// Reports, see calibration/report.hpp. A number that is not there is null.
#include <nlohmann/json.hpp>

#include "calibration/figures.hpp"
#include "calibration/report.hpp"
#include "core/frames.hpp"
#include "core/note_json.inl"

namespace sgrt {
namespace {

constexpr const char* kSchema = "sgrt-calibration/1";
constexpr double kDegree = 3.14159265358979323846 / 180;

// The table of docs/abi.md for the statuses that a report can have.
const char* word_of(Status status) {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kInsufficientData:
      return "insufficient_data";
    case Status::kDegenerate:
      return "degenerate";
    case Status::kNotConverged:
      return "not_converged";
    default:
      return "not_found";
  }
}

Note head(const char* kind, Status status, const std::string& message) {
  Note json;
  json["schema"] = kSchema;
  json["kind"] = kind;
  json["status"] = word_of(status);
  json["message"] = status == Status::kOk ? Note() : Note(message);
  return json;
}

Note discarded_of(const CalibrationData& data, const std::vector<Discarded>& list) {
  Note all = Note::list();
  for (const Discarded& d : list) {
    Note item;
    item["camera"] = data.cameras[d.camera].id;
    item["image"] = data.placements[d.placement];
    item["point"] = d.point < 0 ? Note() : Note(d.point);
    item["residual_px"] = d.residual;
    item["why"] = d.why;
    all.add(std::move(item));
  }
  return all;
}

Note figures_of(const std::string& id, const CameraFigures& f) {
  Note json;
  json["id"] = id;
  json["images"] = f.views;
  json["corners"] = f.corners;
  json["rms_px"] = f.rms;
  json["rms_all_px"] = f.rms_all;
  return json;
}

Note coverage_map(const CalibrationResult& r, int camera) {
  const std::vector<bool> covered = coverage_of(r, camera);
  Note rows = Note::list();
  for (int i = 0; i < kCellsDown; ++i) {
    Note row = Note::list();
    for (int j = 0; j < kCellsAcross; ++j) row.add(covered[i * kCellsAcross + j] ? 1 : 0);
    rows.add(std::move(row));
  }
  return rows;
}

Note camera_of(const CalibrationResult& r, int c) {
  const CameraFigures& f = r.cameras[c];
  const Camera& camera = r.rig.cameras[c];
  Note json = figures_of(camera.id, f);
  json["coverage"] = f.coverage;
  json["coverage_cells"] = coverage_map(r, c);
  json["tilt_deg"] = Note::list(f.tilt_min_deg, f.tilt_max_deg);
  json["tilt_spread_deg"] = f.tilt_spread_deg;
  json["distance_mm"] = Note::list(f.distance_min, f.distance_max);
  json["residual_pattern"] = f.pattern;
  Note map;
  map["distance_mm"] = f.map_distances;
  map["columns_px"] = f.map_x;
  map["rows_px"] = f.map_y;
  Note layers = Note::list();
  for (const Eigen::MatrixXd& layer : f.map_sigma) layers.add(rows_of(layer));
  map["sigma_px"] = std::move(layers);
  json["projection_sigma_px"]["middle"] = f.projection_sigma_centre;
  json["projection_sigma_px"]["worst"] = f.projection_sigma_worst;
  json["projection_map"] = std::move(map);
  json["split_half"]["difference_px"] = f.split_rms;
  json["split_half"]["predicted_px"] = f.split_predicted;
  return json;
}

Note fit_of(const RoomFit& f) {
  Note json;
  json["name"] = f.name;
  json["points"] = f.points;
  json["sights"] = f.sights;
  json["rms_px"] = f.rms_px;
  json["point_rms_mm"] = f.point_rms_mm;
  json["rig_from_room"] = rows_of(f.rig_from_room.matrix());
  json["covariance"] = rows_of(f.covariance);
  const Vec6 d = f.covariance.diagonal();
  json["sigma_deg"] = Note::list(std::sqrt(d(0)) / kDegree, std::sqrt(d(1)) / kDegree, std::sqrt(d(2)) / kDegree);
  json["sigma_mm"] = Note::list(std::sqrt(d(3)), std::sqrt(d(4)), std::sqrt(d(5)));
  // Where the phantom stands in a rig that is in the room already: its displacement from where it should be.
  const PatientDisplacement p = displacement_of(f.rig_from_room.inverse(), Vec3::Zero());
  json["phantom_displacement"]["lat_mm"] = p.lat_mm;
  json["phantom_displacement"]["lng_mm"] = p.lng_mm;
  json["phantom_displacement"]["vrt_mm"] = p.vrt_mm;
  json["phantom_displacement"]["pitch_deg"] = p.pitch_deg;
  json["phantom_displacement"]["roll_deg"] = p.roll_deg;
  json["phantom_displacement"]["rtn_deg"] = p.rtn_deg;
  json["phantom_displacement"]["mag_mm"] = p.mag_mm;
  return json;
}

Note fits_of(const std::vector<RoomFit>& fits) {
  Note all = Note::list();
  for (const RoomFit& f : fits) all.add(fit_of(f));
  return all;
}

Note note_of_rig(const Rig& rig) {
  const std::string text = rig_to_json(rig);
  return note_of(parse_json(text.data(), text.size(), "rig").root);
}

std::string with_provenance(const Rig& rig, const Note& provenance) {
  Note json = note_of_rig(rig);
  json["provenance"] = provenance;
  return note_text(json, "rig");
}

// An object stays, anything else is kept as its "before".
Note& as_object(Note& note) {
  if (note.kind() == Note::Kind::kObject) return note;
  Note before = std::move(note);
  note = Note::object();
  if (before.kind() != Note::Kind::kNull) note["before"] = std::move(before);
  return note;
}

}  // namespace

std::string report_json(const CalibrationData& data, const CalibrationResult& r) {
  Note json = head("calibration", r.status, r.message);
  json["noise_px"] = r.status == Status::kOk ? r.noise : std::nan("");
  json["rms_px"] = r.status == Status::kOk ? r.rms : std::nan("");
  json["rms_all_px"] = r.status == Status::kOk ? r.rms_all : std::nan("");
  json["iterations"] = r.iterations;
  json["board"]["points"] = data.points.rows();
  json["board"]["warp_mm"] = list_of(r.scene.warp);
  json["cameras"] = Note::list();
  for (int c = 0; c < static_cast<int>(r.cameras.size()); ++c) json["cameras"].add(camera_of(r, c));
  Note sigmas = Note::object();
  for (std::size_t i = 0; i < r.parameters.size(); ++i)
    sigmas[r.parameters[i]] = std::sqrt(r.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)));
  json["sigma"] = std::move(sigmas);
  json["volume"] = Note::list();
  for (const VolumeFigures& v : r.volume) {
    Note item;
    item["pair"] = v.pair;
    item["distance_mm"] = v.distance;
    item["point_sigma_mm"] = list_of(v.sigma);
    json["volume"].add(std::move(item));
  }
  json["discarded"] = discarded_of(data, r.discarded);
  json["warnings"] = r.warnings;
  return note_text(json, "report");
}

std::string report_json(const CalibrationData& data, const CheckResult& r) {
  Note json = head("check", r.status, r.message);
  const bool ok = r.status == Status::kOk;
  json["noise_px"] = ok ? r.noise : std::nan("");
  json["rms_px"] = ok ? r.rms : std::nan("");
  json["expected_rms_px"] = ok ? r.expected_rms : std::nan("");
  json["cameras"] = Note::list();
  for (std::size_t c = 0; c < r.figures.size(); ++c) json["cameras"].add(figures_of(r.cameras[c], r.figures[c]));
  json["discarded"] = discarded_of(data, r.discarded);
  json["warnings"] = r.warnings;
  return note_text(json, "report");
}

std::string report_json(const CalibrationData& data, const RoomResult& r) {
  Note json = head("room", r.status, r.message);
  json["noise_px"] = r.status == Status::kOk ? r.noise_px : std::nan("");
  json["rigs"] = fits_of(r.rigs);
  json["pairs"] = fits_of(r.pairs);
  json["pair_disagreement_mm"] = r.status == Status::kOk ? r.pair_disagreement_mm : std::nan("");
  json["discarded"] = discarded_of(data, r.discarded);
  json["warnings"] = r.warnings;
  return note_text(json, "report");
}

std::string report_json(const CalibrationData& data, const LaserCalibration& r) {
  Note json = head("laser", r.status, r.message);
  json["laser"] = r.unit.id;
  json["camera"] = data.cameras.empty() ? Note() : Note(data.cameras[0].id);
  const bool ok = r.status == Status::kOk;
  json["rms_px"] = ok ? r.rms : std::nan("");
  json["residuals_over_sigma"] = ok ? r.noise_scale : std::nan("");
  json["point_sigma_mm"] = ok ? r.sigma_mm : std::nan("");
  json["iterations"] = r.iterations;
  json["placements"] = Note::list();
  for (const LaserCalibration::Placement& p : r.placements) {
    Note item;
    item["name"] = p.name;
    item["corners"] = p.corners;
    item["corner_rms_px"] = p.corner_rms;
    item["stripe_points"] = p.stripes;
    item["stripe_rms_px"] = p.stripe_rms;
    json["placements"].add(std::move(item));
  }
  Note sigmas = Note::object();
  for (std::size_t i = 0; i < r.parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    sigmas[r.parameters[i]] = std::sqrt(std::max(r.covariance(k, k), 0.0));
  }
  json["sigma"] = std::move(sigmas);
  json["not_fixed"] = r.unfixed;
  json["warnings"] = r.warnings;
  return note_text(json, "report");
}

std::string rig_with_provenance(const CalibrationData& data, const CalibrationResult& r) {
  Note json;
  json["made_by"] = "sgrt calibration";
  json["images"] = data.placements;
  json["noise_px"] = r.noise;
  json["rms_px"] = r.rms;
  json["board_warp_mm"] = list_of(r.scene.warp);
  json["warnings"] = r.warnings;
  return with_provenance(r.rig, json);
}

std::string rig_with_provenance(const CalibrationData& data, const RoomResult& r) {
  Note json;
  json["made_by"] = "sgrt room calibration";
  json["phantom_points"] = data.points.rows();
  json["fits"] = fits_of(r.rigs);
  json["warnings"] = r.warnings;
  return with_provenance(r.rig, json);
}

std::string report_json(const TofCalibration& r) {
  Note json = head("tof", r.status, r.message);
  json["unit"] = r.unit;
  json["pixels"] = r.samples;
  json["outliers"] = r.outliers;
  const bool ok = r.status == Status::kOk;
  json["rms_before_mm"] = ok ? r.rms_before : std::nan("");
  json["rms_after_mm"] = ok ? r.rms_after : std::nan("");
  json["expected_rms_mm"] = ok ? r.expected : std::nan("");
  json["placement_rms_mm"] = ok ? r.placement_rms : std::nan("");
  json["pixel_offset_rms_mm"] = ok ? r.pixel_rms : std::nan("");
  json["range_correction_sigma_mm"] = r.range_sigma;
  json["placements"] = Note::list();
  for (const TofPlacementFigures& p : r.placements) {
    Note item;
    item["name"] = p.name;
    item["pixels"] = p.pixels;
    item["range_mm"] = p.range;
    item["mean_before_mm"] = p.before;
    item["mean_after_mm"] = p.after;
    json["placements"].add(std::move(item));
  }
  json["warnings"] = r.warnings;
  return note_text(json, "report");
}

std::string rig_with_provenance(const TofCalibration& r) {
  Rig rig = r.rig;
  for (TofUnit& unit : rig.tofs) {
    if (unit.id == r.unit && !r.pixel_offset.empty()) unit.pixel_offset_file = "pixel-offset.npy";
  }
  Note json = note_of_rig(rig);
  Note& note = as_object(as_object(json["provenance"])["tof"])[r.unit];  // what the rig came from stays
  note = Note();
  note["made_by"] = "sgrt tof calibration";
  note["placements"] = r.placements.size();
  note["rms_after_mm"] = r.rms_after;
  note["placement_rms_mm"] = r.placement_rms;
  note["warnings"] = r.warnings;
  return note_text(json, "rig");
}

}  // namespace sgrt
