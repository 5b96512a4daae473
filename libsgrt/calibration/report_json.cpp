// Reports, see calibration/report.hpp. A number that is not there is null.
#include <nlohmann/json.hpp>

#include "calibration/figures.hpp"
#include "calibration/report.hpp"
#include "core/frames.hpp"
#include "core/strict_json.inl"

namespace sgrt {
namespace {

constexpr const char* kSchema = "sgrt-calibration/1";
constexpr double kDegree = 3.14159265358979323846 / 180;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

template <class Matrix>
Json rows_of(const Matrix& m) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < m.cols(); ++j) row.push_back(number(m(i, j)));
    rows.push_back(std::move(row));
  }
  return rows;
}

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

Json head(const char* kind, Status status, const std::string& message) {
  Json json = {{"schema", kSchema}, {"kind", kind}, {"status", word_of(status)}};
  json["message"] = status == Status::kOk ? Json(nullptr) : Json(message);
  return json;
}

Json discarded_of(const CalibrationData& data, const std::vector<Discarded>& list) {
  Json all = Json::array();
  for (const Discarded& d : list) {
    Json item = {{"camera", data.cameras[d.camera].id}, {"image", data.placements[d.placement]}};
    item["point"] = d.point < 0 ? Json(nullptr) : Json(d.point);
    item["residual_px"] = number(d.residual);
    item["why"] = d.why;
    all.push_back(std::move(item));
  }
  return all;
}

Json figures_of(const std::string& id, const CameraFigures& f) {
  return {{"id", id},
          {"images", f.views},
          {"corners", f.corners},
          {"rms_px", number(f.rms)},
          {"rms_all_px", number(f.rms_all)}};
}

Json coverage_map(const CalibrationResult& r, int camera) {
  const std::vector<bool> covered = coverage_of(r, camera);
  Json rows = Json::array();
  for (int i = 0; i < kCellsDown; ++i) {
    Json row = Json::array();
    for (int j = 0; j < kCellsAcross; ++j) row.push_back(covered[i * kCellsAcross + j] ? 1 : 0);
    rows.push_back(std::move(row));
  }
  return rows;
}

Json camera_of(const CalibrationResult& r, int c) {
  const CameraFigures& f = r.cameras[c];
  const Camera& camera = r.rig.cameras[c];
  Json json = figures_of(camera.id, f);
  json["coverage"] = f.coverage;
  json["coverage_cells"] = coverage_map(r, c);
  json["tilt_deg"] = {f.tilt_min_deg, f.tilt_max_deg};
  json["tilt_spread_deg"] = f.tilt_spread_deg;
  json["distance_mm"] = {f.distance_min, f.distance_max};
  json["residual_pattern"] = number(f.pattern);
  Json map = Json::object();
  map["distance_mm"] = f.map_distances;
  map["columns_px"] = f.map_x;
  map["rows_px"] = f.map_y;
  Json layers = Json::array();
  for (const Eigen::MatrixXd& layer : f.map_sigma) layers.push_back(rows_of(layer));
  map["sigma_px"] = std::move(layers);
  json["projection_sigma_px"] = {{"middle", number(f.projection_sigma_centre)},
                                 {"worst", number(f.projection_sigma_worst)}};
  json["projection_map"] = std::move(map);
  json["split_half"] = {{"difference_px", number(f.split_rms)}, {"predicted_px", number(f.split_predicted)}};
  return json;
}

Json fit_of(const RoomFit& f) {
  Json json = {{"name", f.name},
               {"points", f.points},
               {"sights", f.sights},
               {"rms_px", number(f.rms_px)},
               {"point_rms_mm", number(f.point_rms_mm)}};
  json["rig_from_room"] = rows_of(f.rig_from_room.matrix());
  json["covariance"] = rows_of(f.covariance);
  const Vec6 d = f.covariance.diagonal();
  json["sigma_deg"] = {std::sqrt(d(0)) / kDegree, std::sqrt(d(1)) / kDegree, std::sqrt(d(2)) / kDegree};
  json["sigma_mm"] = {std::sqrt(d(3)), std::sqrt(d(4)), std::sqrt(d(5))};
  // Where the phantom stands in a rig that is in the room already: its displacement from where it should be.
  const PatientDisplacement p = displacement_of(f.rig_from_room.inverse(), Vec3::Zero());
  json["phantom_displacement"] = {{"lat_mm", p.lat_mm},       {"lng_mm", p.lng_mm},     {"vrt_mm", p.vrt_mm},
                                  {"pitch_deg", p.pitch_deg}, {"roll_deg", p.roll_deg}, {"rtn_deg", p.rtn_deg},
                                  {"mag_mm", p.mag_mm}};
  return json;
}

std::string with_provenance(const Rig& rig, const Json& provenance) {
  const std::string text = rig_to_json(rig);
  JsonTree tree = parse_json(text.data(), text.size(), "rig");
  Json& json = tree.root;
  json["provenance"] = provenance;
  return json_text(json, "rig");
}

}  // namespace

std::string report_json(const CalibrationData& data, const CalibrationResult& r) {
  Json json = head("calibration", r.status, r.message);
  json["noise_px"] = number(r.status == Status::kOk ? r.noise : std::nan(""));
  json["rms_px"] = number(r.status == Status::kOk ? r.rms : std::nan(""));
  json["rms_all_px"] = number(r.status == Status::kOk ? r.rms_all : std::nan(""));
  json["iterations"] = r.iterations;
  json["board"] = {{"points", data.points.rows()}, {"warp_mm", {r.scene.warp.x(), r.scene.warp.y(), r.scene.warp.z()}}};
  json["cameras"] = Json::array();
  for (int c = 0; c < static_cast<int>(r.cameras.size()); ++c) json["cameras"].push_back(camera_of(r, c));
  Json sigmas = Json::object();
  for (std::size_t i = 0; i < r.parameters.size(); ++i)
    sigmas[r.parameters[i]] = std::sqrt(r.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)));
  json["sigma"] = std::move(sigmas);
  json["volume"] = Json::array();
  for (const VolumeFigures& v : r.volume)
    json["volume"].push_back({{"pair", v.pair},
                              {"distance_mm", v.distance},
                              {"point_sigma_mm", {number(v.sigma.x()), number(v.sigma.y()), number(v.sigma.z())}}});
  json["discarded"] = discarded_of(data, r.discarded);
  json["warnings"] = r.warnings;
  return json_text(json, "report");
}

std::string report_json(const CalibrationData& data, const CheckResult& r) {
  Json json = head("check", r.status, r.message);
  const bool ok = r.status == Status::kOk;
  json["noise_px"] = number(ok ? r.noise : std::nan(""));
  json["rms_px"] = number(ok ? r.rms : std::nan(""));
  json["expected_rms_px"] = number(ok ? r.expected_rms : std::nan(""));
  json["cameras"] = Json::array();
  for (std::size_t c = 0; c < r.figures.size(); ++c) json["cameras"].push_back(figures_of(r.cameras[c], r.figures[c]));
  json["discarded"] = discarded_of(data, r.discarded);
  json["warnings"] = r.warnings;
  return json_text(json, "report");
}

std::string report_json(const CalibrationData& data, const RoomResult& r) {
  Json json = head("room", r.status, r.message);
  json["noise_px"] = number(r.status == Status::kOk ? r.noise_px : std::nan(""));
  json["rigs"] = Json::array();
  for (const RoomFit& f : r.rigs) json["rigs"].push_back(fit_of(f));
  json["pairs"] = Json::array();
  for (const RoomFit& f : r.pairs) json["pairs"].push_back(fit_of(f));
  json["pair_disagreement_mm"] = number(r.status == Status::kOk ? r.pair_disagreement_mm : std::nan(""));
  json["discarded"] = discarded_of(data, r.discarded);
  json["warnings"] = r.warnings;
  return json_text(json, "report");
}

std::string report_json(const CalibrationData& data, const LaserCalibration& r) {
  Json json = head("laser", r.status, r.message);
  json["laser"] = r.unit.id;
  json["camera"] = data.cameras.empty() ? Json(nullptr) : Json(data.cameras[0].id);
  const bool ok = r.status == Status::kOk;
  json["rms_px"] = number(ok ? r.rms : std::nan(""));
  json["residuals_over_sigma"] = number(ok ? r.noise_scale : std::nan(""));
  json["point_sigma_mm"] = number(ok ? r.sigma_mm : std::nan(""));
  json["iterations"] = r.iterations;
  Json placements = Json::array();
  for (const LaserCalibration::Placement& p : r.placements) {
    placements.push_back({{"name", p.name},
                          {"corners", p.corners},
                          {"corner_rms_px", number(p.corner_rms)},
                          {"stripe_points", p.stripes},
                          {"stripe_rms_px", number(p.stripe_rms)}});
  }
  json["placements"] = std::move(placements);
  Json sigmas = Json::object();
  for (std::size_t i = 0; i < r.parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    sigmas[r.parameters[i]] = number(std::sqrt(std::max(r.covariance(k, k), 0.0)));
  }
  json["sigma"] = std::move(sigmas);
  json["not_fixed"] = r.unfixed;
  json["warnings"] = r.warnings;
  return json_text(json, "report");
}

std::string rig_with_provenance(const CalibrationData& data, const CalibrationResult& r) {
  Json json = {{"made_by", "sgrt calibration"}, {"images", data.placements}, {"noise_px", r.noise}, {"rms_px", r.rms}};
  json["board_warp_mm"] = {r.scene.warp.x(), r.scene.warp.y(), r.scene.warp.z()};
  json["warnings"] = r.warnings;
  return with_provenance(r.rig, json);
}

std::string rig_with_provenance(const CalibrationData& data, const RoomResult& r) {
  Json json = {{"made_by", "sgrt room calibration"}, {"phantom_points", data.points.rows()}};
  json["fits"] = Json::array();
  for (const RoomFit& f : r.rigs) json["fits"].push_back(fit_of(f));
  json["warnings"] = r.warnings;
  return with_provenance(r.rig, json);
}

std::string report_json(const TofCalibration& r) {
  Json json = head("tof", r.status, r.message);
  json["unit"] = r.unit;
  json["pixels"] = r.samples;
  json["outliers"] = r.outliers;
  const bool ok = r.status == Status::kOk;
  json["rms_before_mm"] = number(ok ? r.rms_before : std::nan(""));
  json["rms_after_mm"] = number(ok ? r.rms_after : std::nan(""));
  json["expected_rms_mm"] = number(ok ? r.expected : std::nan(""));
  json["placement_rms_mm"] = number(ok ? r.placement_rms : std::nan(""));
  json["pixel_offset_rms_mm"] = number(ok ? r.pixel_rms : std::nan(""));
  json["range_correction_sigma_mm"] = r.range_sigma;
  json["placements"] = Json::array();
  for (const TofPlacementFigures& p : r.placements)
    json["placements"].push_back({{"name", p.name},
                                  {"pixels", p.pixels},
                                  {"range_mm", number(p.range)},
                                  {"mean_before_mm", number(p.before)},
                                  {"mean_after_mm", number(p.after)}});
  json["warnings"] = r.warnings;
  return json_text(json, "report");
}

std::string rig_with_provenance(const TofCalibration& r) {
  Rig rig = r.rig;
  for (TofUnit& unit : rig.tofs) {
    if (unit.id == r.unit && !r.pixel_offset.empty()) unit.pixel_offset_file = "pixel-offset.npy";
  }
  const std::string text = rig_to_json(rig);
  JsonTree tree = parse_json(text.data(), text.size(), "rig");
  Json& json = tree.root;  // what the rig came from stays
  json["provenance"]["tof"][r.unit] = {{"made_by", "sgrt tof calibration"},
                                       {"placements", r.placements.size()},
                                       {"rms_after_mm", r.rms_after},
                                       {"placement_rms_mm", r.placement_rms},
                                       {"warnings", r.warnings}};
  return json_text(json, "rig");
}

}  // namespace sgrt
