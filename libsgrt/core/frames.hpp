// IEC 61217 and DICOM frames, and the six numbers that a clinic reads. docs/conventions.md, docs/theory/frames.md.
#pragma once

#include "core/geometry.hpp"

namespace sgrt {

// Shifts in mm along room X, Y, Z; turns in deg: R = Rz(rtn) Rx(pitch) Ry(roll), about the isocentre.
struct SixDof {
  double lat_mm, lng_mm, vrt_mm, pitch_deg, roll_deg, rtn_deg, mag_mm;
};
// Two types, so that a displacement is never taken for the correction.
struct PatientDisplacement : SixDof {};
struct CouchCorrection : SixDof {};

// D(x) = R (x - iso) + iso + t is the inverse of reference_from_live.
PatientDisplacement displacement_of(const Pose& reference_from_live, const Vec3& isocentre);
CouchCorrection correction_of(const Pose& reference_from_live, const Vec3& isocentre);
Pose pose_of(const PatientDisplacement& displacement, const Vec3& isocentre);  // reference_from_live
Pose pose_of(const CouchCorrection& correction, const Vec3& isocentre);

// What a couch without pitch and roll can do: lat, lng, vrt and rtn. Its correction brings the isocentre back exactly
// and leaves the patient's own pitch and roll. docs/theory/frames.md eq. 5.
struct FourDof {
  CouchCorrection correction;     // pitch and roll 0
  PatientDisplacement remaining;  // after it: pitch and roll alone
};
FourDof four_dof_of(const Pose& reference_from_live, const Vec3& isocentre);

enum class PatientPosition : int { kHfs, kHfp, kFfs, kFfp, kHfdl, kHfdr, kFfdl, kFfdr };
Pose fixed_from_dicom(PatientPosition position, const Vec3& isocentre_dicom);
Pose fixed_from_couch(double couch_deg);
Pose fixed_from_gantry(double gantry_deg);
// How what lies on the couch moves in the room when the couch turns from 0: about the vertical through the isocentre.
Pose couch_turn(double couch_deg, const Vec3& isocentre);

}  // namespace sgrt
