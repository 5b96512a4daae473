// Prepare, find the rigid part, certify it, and tell what else moved. docs/theory/nonrigid.md.
#include "registration/deform.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "registration/displacement_field.hpp"
#include "registration/rigid_part.hpp"
#include "registration/similarity.hpp"
#include "surface/local_fit.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr std::int64_t kPointsAPatch = 30, kFewest = 30, kMost = 200;
constexpr double kTurnLever = 100;  // mm
constexpr double kDisagree = 0.3;   // mm: between the consensus and its certified refinement

void check(const DeformOptions& o) {
  const auto in = [](double v, double low, double high, const char* name) {
    if (!(v >= low && v <= high)) {
      fail(Status::kInvalidArgument,
           std::string(name) + ": " + text_of(v) + ", expected " + text_of(low) + " to " + text_of(high));
    }
  };
  const int mode = static_cast<int>(o.mode);
  if (mode < 0 || mode > 2) fail(Status::kInvalidArgument, "mode: " + std::to_string(mode) + ", expected 0 to 2");
  in(o.min_rigid_share, 0, 1, "min_rigid_share");
  in(o.max_structure, 0, 1e5, "max_structure_mm");
  in(o.max_rivalry, 0, 1, "max_rivalry");
  in(o.stiffness, 1e-6, 1e6, "stiffness");
}

Surface with_normals(const Run& run, const Surface& s) {
  return s.has_normals() ? s : estimate_normals(run, s, NormalsOptions{});
}

double or_zero(double v) {
  return v == v ? v : 0;
}

bool carries_noise(const Surface& s) {
  return s.sigma.size() > 0 || s.covariance.rows() > 0;
}

// What all modes work on.
struct Scene {
  Surface reference, live;
  Field field;
  double reference_roughness = 0, live_roughness = 0;
  Patches patches;

  Scene(const Run& run, const Surface& r, const Surface& l)
      : reference(with_normals(run, r)), live(with_normals(run, l)), field(make_field(run, reference)) {
    if (!carries_noise(reference)) reference_roughness = or_zero(roughness(run, reference, field.nearest));
    if (!carries_noise(live)) live_roughness = or_zero(roughness(run, live, Nearest(run, live.points)));
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  std::vector<Contact> contacts(const Run& run, const Surface& moving, const Pose& pose, const IcpOptions& o) const {
    return contacts_at(run, field, patches, moving, pose, o.max_distance, std::cos(o.max_angle_deg * kPi / 180),
                       live_roughness);
  }
};

Surface subset(const Surface& s, const std::vector<std::int64_t>& rows) {
  Surface out;
  const auto n = static_cast<Eigen::Index>(rows.size());
  const auto pick = [&](const auto& from, auto& to) {
    if (from.rows() == 0) return;
    to.resize(n, from.cols());
    for (Eigen::Index k = 0; k < n; ++k) to.row(k) = from.row(rows[static_cast<std::size_t>(k)]);
  };
  pick(s.points, out.points);
  pick(s.normals, out.normals);
  pick(s.sigma, out.sigma);
  pick(s.covariance, out.covariance);
  for (const Points& mode : s.modes) pick(mode, out.modes.emplace_back());
  out.correlation_points = s.correlation_points;
  return out;
}

// What changes its shape lets ICP circle for longer.
IcpResult align_patiently(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre,
                          const Roi* roi, const Pose& start, IcpOptions options) {
  IcpResult r = align(run, reference, live, isocentre, roi, start, options);
  if (r.status != Status::kNotConverged) return r;
  options.max_iterations *= 5;
  options.step_tolerance *= 10;
  return align(run, reference, live, isocentre, roi, start, options);
}

// The certified registration of some live points, its maps spread over all of them.
IcpResult align_rows(const Run& run, const Scene& scene, const std::vector<std::int64_t>& rows, const Vec3& isocentre,
                     const Roi* roi, const Pose& start, const IcpOptions& options) {
  IcpResult r = align_patiently(run, scene.reference, subset(scene.live, rows), isocentre, roi, start, options);
  const auto n = static_cast<std::size_t>(scene.live.size());
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(scene.live.size(), kNan);
  std::vector<std::uint8_t> inlier(n, 0);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    inlier[static_cast<std::size_t>(rows[k])] = k < r.inlier.size() ? r.inlier[k] : 0;
  }
  if (r.status == Status::kOk) {
    for (std::int64_t i = 0; i < scene.live.size(); ++i) {
      if (!scene.live.present(i)) continue;
      distance[i] =
          distance_at(scene.field, r.reference_from_live * scene.live.point(i), options.max_distance).distance;
    }
  }
  r.distance = std::move(distance);
  r.inlier = std::move(inlier);
  r.live_height = scene.live.height;
  r.live_width = scene.live.width;
  return r;
}

void forget_pose(IcpResult& r) {
  r.reference_from_live = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  static_cast<SixDof&>(r.displacement) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  static_cast<SixDof&>(r.correction) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  r.covariance.setConstant(kNan);
  r.rms = kNan;
  r.distance.setConstant(kNan);
}

void give_up(IcpResult& r, Status status, const std::string& message) {
  forget_pose(r);
  r.status = status;
  r.verdict = Verdict::kNone;
  r.message = r.verdict_words = message;
}

void doubt(IcpResult& r, const std::string& words) {
  r.verdict_words = (r.verdict == Verdict::kWeak ? r.verdict_words + "; " : "weak: ") + words;
  r.verdict = Verdict::kWeak;
}

std::string percent(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

std::string rounded(double mm) {
  return text_of(std::round(100 * mm) / 100);
}

double difference_at(const Pose& a, const Pose& b, const Vec3& isocentre) {
  const Pose d = about(a * b.inverse(), isocentre);
  return std::hypot(d.t.norm(), kTurnLever * so3_log(d.R).norm());
}

// One sigma of the whole motion at the isocentre, mm.
double length_of(const Mat6& covariance) {
  const Vec6 variance = covariance.diagonal();
  return std::sqrt(kTurnLever * kTurnLever * variance.head<3>().sum() + variance.tail<3>().sum());
}

// The rigid part with every doubt answered, or a status that says that it cannot be told.
void solve_rigid(const Run& run, Scene& scene, const Vec3& isocentre, const Roi* roi, const Pose& start,
                 const DeformOptions& o, DeformResult& out) {
  const RigidPart part =
      find_rigid_part(run, scene.field, scene.patches, scene.live, isocentre, start, scene.live_roughness, o.icp);
  out.rigid_share = part.share;
  out.runner_up_share = part.runner_up_share;
  out.runner_up_distance = part.runner_up_distance;
  out.runner_up_rivalry = part.runner_up_rivalry;
  const auto contacts = scene.contacts(run, scene.live, part.pose, o.icp);
  std::vector<std::int64_t> rows;
  for (const Contact& c : contacts) {
    out.rigid[static_cast<std::size_t>(c.live)] = part.rigid[static_cast<std::size_t>(c.patch)];
    if (part.core[static_cast<std::size_t>(c.patch)]) rows.push_back(c.live);
  }
  if (part.share < o.min_rigid_share) {
    return give_up(out.icp, Status::kNotFound,
                   "cannot tell the rigid motion: only " + percent(part.share) +
                       " of the region moved as one, at least " + percent(o.min_rigid_share) + " is needed");
  }
  if (part.runner_up_rivalry > o.max_rivalry) {
    return give_up(out.icp, Status::kDegenerate,
                   "cannot tell the rigid motion: another one, " + rounded(part.runner_up_distance) +
                       " mm away, explains " + percent(part.runner_up_share) + " of the region, this one " +
                       percent(part.share));
  }
  out.icp = align_rows(run, scene, rows, isocentre, roi, part.pose, o.icp);
  if (out.icp.status != Status::kOk) return;
  const double apart = difference_at(out.icp.reference_from_live, part.pose, isocentre);
  if (apart > kDisagree && apart > 4 * length_of(out.icp.covariance)) {
    return give_up(out.icp, Status::kDegenerate,
                   "cannot tell the rigid motion: patches and points differ by " + rounded(apart) + " mm");
  }
  const Evidence e = evidence_of(
      scene.patches, sum_patches(scene.patches, scene.contacts(run, scene.live, out.icp.reference_from_live, o.icp)),
      scene.live.correlation_points);
  out.structure = structure_of(scene.patches, e, part.rigid);
  if (out.structure > o.max_structure) {
    return give_up(out.icp, Status::kNotFound,
                   "cannot tell the rigid motion: what moved as one still changes its shape by " +
                       rounded(out.structure) + " mm rms, more than " + rounded(o.max_structure));
  }
  if (out.structure > 0) {
    out.icp.covariance += structure_covariance(scene.patches, e, part.core, out.structure, isocentre);
    const double worst =
        std::sqrt(std::max(out.icp.covariance.diagonal().tail<3>().maxCoeff(),
                           kTurnLever * kTurnLever * out.icp.covariance.diagonal().head<3>().maxCoeff()));
    if (worst > o.icp.weak_sigma) {
      doubt(out.icp, "sigma " + rounded(worst) + " mm by what changed its shape");
    } else if (out.structure > 0.5 * o.max_structure) {
      doubt(out.icp, "what moved as one still changes its shape by " + rounded(out.structure) + " mm rms");
    }
  }
}

void solve_similarity(const Run& run, Scene& scene, const Vec3& isocentre, const Roi* roi, const Pose& start,
                      const DeformOptions& o, DeformResult& out) {
  const Similarity s =
      fit_similarity(run, scene.field, scene.patches, scene.live, isocentre, start, scene.live_roughness, o.icp);
  out.scale = s.scale;
  out.scale_sigma = s.sigma;
  scene.live = scaled_about(std::move(scene.live), isocentre, s.scale);
  std::vector<std::int64_t> rows;
  for (std::int64_t i = 0; i < scene.live.size(); ++i) {
    if (scene.live.present(i)) rows.push_back(i);
  }
  out.icp = align_rows(run, scene, rows, isocentre, roi, s.pose, o.icp);
  if (out.icp.status == Status::kOk) out.icp.covariance += s.sigma * s.sigma * s.lever * s.lever.transpose();
}

void solve_field(const Run& run, const Scene& scene, const DeformOptions& o, DeformResult& out) {
  if (out.icp.status != Status::kOk) return;
  const FieldOptions options{o.icp.max_distance, std::cos(o.icp.max_angle_deg * kPi / 180), o.stiffness};
  // The field lays live on the reference; what the body did is the opposite.
  out.deformation = -displacement_field(run, scene.field, scene.patches, scene.live, out.icp.reference_from_live,
                                        scene.live_roughness, options);
  double sum2 = 0, count = 0;
  for (Eigen::Index i = 0; i < out.deformation.rows(); ++i) {
    const double length = out.deformation.row(i).norm();
    if (!(length == length)) continue;
    out.deformation_max = std::max(out.deformation_max, length);
    sum2 += length * length;
    ++count;
  }
  out.deformation_rms = std::sqrt(sum2 / count);
}

}  // namespace

DeformResult deform_align(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre,
                          const Roi* roi, const Pose& initial, const DeformOptions& options) {
  check(options);
  DeformResult out;
  out.rigid_share = out.structure = out.runner_up_share = out.runner_up_distance = kNan;
  out.scale_sigma = out.scale = kNan;
  out.rigid.assign(static_cast<std::size_t>(live.size()), 255);
  // The rigid registration of all first: its start, and its refusals.
  out.icp = align_patiently(run, reference, live, isocentre, roi, initial, options.icp);
  if (out.icp.status != Status::kOk && out.icp.status != Status::kNotConverged) return out;
  const Pose start = out.icp.status == Status::kOk ? out.icp.reference_from_live : initial;
  try {
    Scene scene(run, reference, live);
    scene.patches = make_patches(scene.field, roi, 1, scene.reference_roughness);
    const auto seen = static_cast<std::int64_t>(scene.contacts(run, scene.live, start, options.icp).size());
    scene.patches =
        make_patches(scene.field, roi, std::clamp(seen / kPointsAPatch, kFewest, kMost), scene.reference_roughness);
    if (options.mode == DeformMode::kSimilarity) {
      solve_similarity(run, scene, isocentre, roi, start, options, out);
    } else {
      out.scale = 1;
      solve_rigid(run, scene, isocentre, roi, start, options, out);
      if (options.mode == DeformMode::kField) solve_field(run, scene, options, out);
    }
  } catch (const Error& e) {
    const auto status = static_cast<int>(e.status());
    if (status < 10 || status > 19) throw;
    give_up(out.icp, e.status(), e.what());
  }
  return out;
}

}  // namespace sgrt
