// The skin's own: the guard, the handles behind the opaque types, and what a call may use. A function of the skin
// checks, converts, calls the core, converts back; it computes everything first and writes its outputs last.
// docs/abi.md.
#pragma once

#include <sgrt.h>

#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "calibration/calibrate.hpp"
#include "capi/check.hpp"
#include "capi/lazy.hpp"
#include "capi/sized.hpp"
#include "capi/view.hpp"
#include "core/error.hpp"
#include "core/frames.hpp"
#include "core/parallel.hpp"
#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "nurbs/curve.hpp"
#include "nurbs/evaluate.hpp"
#include "nurbs/fit.hpp"
#include "registration/advisor.hpp"
#include "registration/deform.hpp"
#include "registration/icp.hpp"
#include "registration/landmark_fit.hpp"
#include "rig/rig.hpp"
#include "shape/curvature.hpp"
#include "shape/locate.hpp"
#include "stereo/stereo.hpp"
#include "surface/temporal.hpp"
#include "tof/tof.hpp"
#include "tracking/tracker.hpp"
#include "volume/contours.hpp"

struct sgrt_context {
  sgrt::ThreadPool pool;
  sgrt::Isa isa;
  sgrt_context_options options;
};

struct sgrt_surface {
  std::shared_ptr<const sgrt::Surface> surface;
  sgrt::Lazy<std::vector<double>> modes;  // of the surface, K x N x 3 in one piece, to be lent
};

struct sgrt_roi {
  sgrt::Roi roi;
};

struct sgrt_rig {
  sgrt::Rig rig;
  std::string json;
};

struct sgrt_stereo {
  std::shared_ptr<const sgrt::StereoResult> result;
};

struct sgrt_stereo_session {
  sgrt::StereoMatcher matcher;
  double time_s;  // of the last push
  sgrt_stereo lent;
};

// A result knows the sensor that made it, for its surface.
struct sgrt_tof {
  std::shared_ptr<const sgrt::TofSensor> sensor;
  std::shared_ptr<const sgrt::TofResult> result;
};

struct sgrt_tof_session {
  std::shared_ptr<sgrt::TofSensor> sensor;
  double time_s;  // of the last push
  sgrt_tof lent;
};

struct sgrt_filter_session {
  sgrt::TemporalFilter filter;
};

struct sgrt_reference {
  std::shared_ptr<const sgrt::Reference> reference;
};

struct sgrt_nurbs_curve {
  sgrt::NurbsCurve curve;
  sgrt::Lazy<std::string> json;
};

struct sgrt_nurbs_surface {
  explicit sgrt_nurbs_surface(sgrt::NurbsSurface surface) : evaluator(std::move(surface)) {}
  sgrt::SurfaceEvaluator evaluator;
  sgrt::Lazy<std::string> json;
};

struct sgrt_nurbs_fit {
  sgrt::NurbsFit fit;
};

struct sgrt_curvature {
  sgrt::CurvatureField field;
};

// The arrays that a model and a result lend, packed.
struct sgrt_landmark_model {
  sgrt::LandmarkModel model;
  sgrt::Points positions, normals;
  std::vector<double> curvature, sigma;
  sgrt::Lazy<std::string> json;
};

struct sgrt_landmarks {
  sgrt::LocatedLandmarks landmarks;
  std::vector<double> positions, covariance, repeat_covariance, scores;
};

struct sgrt_volume {
  sgrt::ClosedContours body;  // of a CT: its skin alone
};

struct sgrt_icp {
  sgrt::IcpResult result;
};

// What the three calls have in common, ready to be lent.
struct sgrt_calibration {
  sgrt_calibration_info info;
  std::string message, report, rig_json;  // no rig: empty
  std::vector<std::string> warnings, parameters;
  std::vector<double> corners, covariance;
  std::vector<float> pixel_offset;  // height x width
  std::int64_t height = 0, width = 0;
};

struct sgrt_advice {
  sgrt::Advice advice;
  std::vector<double> forecast;  // rows of five
};

struct sgrt_coarse {
  sgrt::LandmarkFit fit;
};

struct sgrt_deform {
  sgrt::DeformResult result;
};

struct sgrt_tracker {
  sgrt::Tracker tracker;
  std::string hold_words;
};

namespace sgrt {

// Keeps the message for sgrt_last_error and returns the status as the ABI's.
sgrt_status answer(Status status, const char* message) noexcept;
// The status of the exception in flight; keeps its message. Only inside a catch.
sgrt_status answer_exception() noexcept;

// No exception leaves a body. The body returns nothing, or a status.
template <class Body>
sgrt_status guard(Body&& body) noexcept {
  try {
    if constexpr (std::is_void_v<decltype(body())>) {
      body();
      return SGRT_OK;
    } else {
      return body();
    }
  } catch (...) {
    return answer_exception();
  }
}

// For functions that lend a text: NULL where the body throws.
template <class Body>
const char* guard_text(Body&& body) noexcept {
  const char* text = nullptr;
  guard([&] { text = body(); });
  return text;
}

// Threads, instruction set and callbacks of a call. Refuses a context whose own callback makes the call.
Run run_of(sgrt_context* context);

sgrt_icp_options to_c(const IcpOptions& o);
IcpOptions from_c(const sgrt_icp_options& c);
sgrt_patient_displacement to_c(const PatientDisplacement& d);
sgrt_couch_correction to_c(const CouchCorrection& c);

TapsView taps_of(const sgrt_view* view, const char* name);
sgrt_tof_options to_c(const TofOptions& o);
TofOptions from_c(const sgrt_tof_options& c);

// Of the calls that share sgrt_calibration_data.
CalibrationData from_c(const sgrt_calibration_data* given);
sgrt_calibration_info empty_info(Status status);

// A handle on a surface.
std::unique_ptr<sgrt_surface> handle_of(std::shared_ptr<const Surface> surface);
std::unique_ptr<sgrt_surface> handle_of(Surface&& surface);

}  // namespace sgrt
