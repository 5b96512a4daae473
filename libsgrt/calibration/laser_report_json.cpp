// The report of a laser's calibration, schema sgrt-calibration/1, kind "laser". A number that is not there is null.
#include <cmath>
#include <nlohmann/json.hpp>

#include "calibration/laser.hpp"
#include "core/strict_json.inl"

namespace sgrt {
namespace {

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

const char* word_of(Status status) {
  return status == Status::kOk                 ? "ok"
         : status == Status::kInsufficientData ? "insufficient_data"
         : status == Status::kNotConverged     ? "not_converged"
         : status == Status::kNotFound         ? "not_found"
                                               : "degenerate";
}

}  // namespace

std::string report_json(const CalibrationData& data, const LaserCalibration& r) {
  Json json = {{"schema", "sgrt-calibration/1"}, {"kind", "laser"}, {"status", word_of(r.status)}};
  json["message"] = r.status == Status::kOk ? Json(nullptr) : Json(r.message);
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
    sigmas[r.parameters[i]] = number(std::sqrt(std::max(0.0, r.covariance(k, k))));
  }
  json["sigma"] = std::move(sigmas);
  json["not_fixed"] = r.unfixed;
  json["warnings"] = r.warnings;
  return json_text(json, "report");
}

}  // namespace sgrt
