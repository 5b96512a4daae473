/* sgrt.h - surface-guided radiation therapy: from camera images of a patient's skin to a six-degree couch shift.
 *
 * This header is the C manual. Sections follow the pipeline: library, context, view, surface, roi, frame, rig, stereo, icp,
 * board, calibration.
 *
 * Conventions (docs/conventions.md): lengths in mm, angles in rad unless a name ends in _deg, matrices row-major, a pose
 * `a_from_b` maps b-coordinates to a. Pixel (0,0) is the centre of the top-left pixel. The room frame is IEC 61217 fixed:
 * origin at the isocentre, X to the right of an observer who faces the gantry, Y towards the gantry, Z up.
 *
 * Every function that can fail returns an sgrt_status; sgrt_last_error() then tells, in one line, which argument was
 * wrong, its value and what was expected. On statuses 1-9 and >= 20 outputs are untouched; on 10-19 a result handle is
 * written so that its diagnostics can be read, and its numbers are NaN. Any pointer may be NULL without undefined
 * behaviour: optional ones say so, for all others SGRT_E_INVALID_ARGUMENT is returned. Every *_free(NULL) is fine.
 *
 * Handles are immutable: any number of threads may use one. Sessions are mutable: one thread at a time. A context may be
 * shared; concurrent calls on it queue. The library keeps no global state, reads no clock, no environment and no file, and
 * writes to no stream. Results do not depend on the number of threads.
 *
 * This is not a medical device. SPDX-License-Identifier: Apache-2.0 */
#ifndef SGRT_H
#define SGRT_H

#include <stddef.h>
#include <stdint.h>

#define SGRT_VERSION_MAJOR 0
#define SGRT_VERSION_MINOR 1
#define SGRT_VERSION_PATCH 0

#if defined(_WIN32)
#define SGRT_API __declspec(dllexport)
#elif defined(__GNUC__)
#define SGRT_API __attribute__((visibility("default")))
#else
#define SGRT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------------- library */

/* The outcome of a call. 0: answered (a `weak` verdict is still an answer). 1-9: the call is wrong, outputs untouched.
 * 10-19: the data have no answer; diagnostics written, numbers NaN. 20 and above: stopped, outputs untouched. */
typedef int32_t sgrt_status;
enum {
  SGRT_OK = 0,
  SGRT_E_INVALID_ARGUMENT = 1,   /* NULL, shape, dtype, range, non-finite */
  SGRT_E_FORMAT = 2,             /* a text (JSON) that is malformed, of an unknown schema or lacks a field */
  SGRT_E_INSUFFICIENT_DATA = 10, /* too few points, pairs or pixels */
  SGRT_E_DEGENERATE = 11,        /* the data leave a direction free */
  SGRT_E_NOT_CONVERGED = 12,     /* the iteration limit came first */
  SGRT_E_NOT_FOUND = 13,         /* no match, no overlap */
  SGRT_E_CANCELLED = 20,         /* the progress callback returned non-zero */
  SGRT_E_OUT_OF_MEMORY = 21,
  SGRT_E_LIMIT = 22,             /* larger than a documented limit */
  SGRT_E_INTERNAL = 23           /* a defect of the library; please report the message */
};

/* The library's version, "major.minor.patch". Never NULL. since 0.1 */
SGRT_API const char *sgrt_version(void);

/* The message of the last failed call on this thread: one English line; "" before any failure. Valid until the next
 * failing call on this thread. since 0.1 */
SGRT_API const char *sgrt_last_error(void);

/* The word of a status as it stands in JSON ("ok", "invalid_argument", ...); "unknown" for any other number. since 0.1 */
SGRT_API const char *sgrt_status_word(sgrt_status status);

/* ------------------------------------------------------------------------------------------------------- context */

/* Thread budget, instruction set, log and progress. Owns its worker threads (started lazily, again after a fork).
 * A NULL context means one thread, silent. */
typedef struct sgrt_context sgrt_context;

/* Called on the calling thread only. fraction: 0 to 1 within `stage`. Non-zero cancels: SGRT_E_CANCELLED. A callback may
 * call the library, but not with the context that it was called by: SGRT_E_INVALID_ARGUMENT. */
typedef int32_t (*sgrt_progress_fn)(void *user, double fraction, const char *stage);

enum { SGRT_LOG_INFO = 0, SGRT_LOG_WARNING = 1 };
/* Called on the calling thread only, with one line of text. */
typedef void (*sgrt_log_fn)(void *user, int32_t level, const char *message);

enum { SGRT_ISA_AUTO = 0, SGRT_ISA_BASELINE = 1, SGRT_ISA_AVX2 = 2 };

typedef struct sgrt_context_options {
  uint32_t struct_size;
  int32_t threads; /* threads in all, the calling one included; 0: one a core. Default 1. At most 256 */
  int32_t max_isa; /* SGRT_ISA_...: the highest instruction set to use. Default SGRT_ISA_AUTO: the best of this machine */
  int32_t reserved;
  sgrt_log_fn log; /* may be NULL */
  void *log_user;
  sgrt_progress_fn progress; /* may be NULL */
  void *progress_user;
} sgrt_context_options;

/* Writes the defaults into *options and its struct_size. size: sizeof *options at the caller.
 * SGRT_E_INVALID_ARGUMENT  NULL, or a size that this library does not know. since 0.1 */
SGRT_API sgrt_status sgrt_context_options_init(sgrt_context_options *options, size_t size);

/* options may be NULL. SGRT_E_INVALID_ARGUMENT  threads or max_isa out of range, unknown struct_size. since 0.1 */
SGRT_API sgrt_status sgrt_context_create(const sgrt_context_options *options, sgrt_context **context);
/* Joins the worker threads. No call may be using the context. since 0.1 */
SGRT_API void sgrt_context_free(sgrt_context *context);

/* ---------------------------------------------------------------------------------------------------------- view */

/* A borrowed n-dimensional array, numpy's model. Frozen layout. */
enum { SGRT_F32 = 1, SGRT_F64 = 2, SGRT_U8 = 3, SGRT_I16 = 4, SGRT_U16 = 5, SGRT_I32 = 6 };

typedef struct sgrt_view {
  const void *data; /* aligned to the dtype; NULL: an absent array */
  int32_t dtype;    /* SGRT_F32 ... */
  int32_t ndim;     /* 1 to 6 */
  int64_t shape[6];
  int64_t strides[6]; /* in bytes; may be negative, 0 only where the shape is 1 for outputs */
} sgrt_view;

/* Its writable twin: an output that the caller owns. Must not overlap an input. */
typedef struct sgrt_mut_view {
  void *data;
  int32_t dtype;
  int32_t ndim;
  int64_t shape[6];
  int64_t strides[6];
} sgrt_mut_view;

/* Bytes of one element, 0 for an unknown dtype. */
static inline int64_t sgrt_dtype_size(int32_t dtype) {
  switch (dtype) {
    case SGRT_F32:
    case SGRT_I32: return 4;
    case SGRT_F64: return 8;
    case SGRT_U8: return 1;
    case SGRT_I16:
    case SGRT_U16: return 2;
    default: return 0;
  }
}

/* A contiguous row-major array of up to three dimensions; pass 0 for `b`, or `b` and `c`, to leave dimensions out. */
static inline sgrt_view sgrt_view_of(const void *data, int32_t dtype, int64_t a, int64_t b, int64_t c) {
  sgrt_view v;
  int64_t size = sgrt_dtype_size(dtype);
  int i;
  for (i = 0; i < 6; ++i) v.shape[i] = v.strides[i] = 0;
  v.data = data;
  v.dtype = dtype;
  v.ndim = c > 0 ? 3 : b > 0 ? 2 : 1;
  v.shape[0] = a;
  v.shape[1] = b;
  v.shape[2] = c;
  v.strides[v.ndim - 1] = size;
  if (v.ndim > 1) v.strides[v.ndim - 2] = size * v.shape[v.ndim - 1];
  if (v.ndim > 2) v.strides[0] = size * b * c;
  return v;
}

static inline sgrt_mut_view sgrt_mut_view_of(void *data, int32_t dtype, int64_t a, int64_t b, int64_t c) {
  sgrt_view v = sgrt_view_of(data, dtype, a, b, c);
  sgrt_mut_view m;
  int i;
  m.data = data;
  m.dtype = v.dtype;
  m.ndim = v.ndim;
  for (i = 0; i < 6; ++i) {
    m.shape[i] = v.shape[i];
    m.strides[i] = v.strides[i];
  }
  return m;
}

/* ------------------------------------------------------------------------------------------------------- surface */

/* Points of a skin with what is known of each: an unordered cloud, an organised grid (H x W, row-major, as a sensor sees
 * it) or a triangle mesh. Immutable. */
typedef struct sgrt_surface sgrt_surface;

/* What a surface is made from. N is the number of points, H*W for a grid. An array whose data is NULL is absent.
 * float32 and float64 are accepted; inside all is float64. */
typedef struct sgrt_surface_data {
  uint32_t struct_size;
  int32_t reserved;
  sgrt_view points;     /* N x 3 or H x W x 3, mm (eq. 10.1). In a grid an absent point is NaN in all three */
  sgrt_view normals;    /* like points; unit, outward (towards the sensor); NaN in all three where unknown */
  sgrt_view sigma_mm;   /* N or H x W: one sigma along the normal, > 0 */
  sgrt_view covariance; /* N x 6 or H x W x 6: xx xy xz yy yz zz, mm2, positive semi-definite */
  sgrt_view faces;      /* M x 3 int32, counter-clockwise seen from outside; only with N x 3 points */
  sgrt_view modes;      /* K x N x 3 or K x H x W x 3, K <= 8: shared error modes, mm at one sigma */
  double correlation_points; /* how many neighbouring points share one noise sample; default 1 (independent points) */
} sgrt_surface_data;

/* Empties *data and sets its struct_size and defaults. since 0.1 */
SGRT_API sgrt_status sgrt_surface_data_init(sgrt_surface_data *data, size_t size);

/* Copies the arrays into a new surface. A mesh without normals gets area-weighted vertex normals.
 * SGRT_E_INVALID_ARGUMENT  shape, dtype or stride; a NaN or Inf (absent grid points excepted); |coordinate| > 1e5 mm;
 *                          sigma <= 0 or > 1e5 mm; a normal that is not unit within 1e-3; a face index out of range
 * SGRT_E_INSUFFICIENT_DATA no point
 * SGRT_E_LIMIT             more than 50 million points, or arrays of more than 4 GiB in all. since 0.1 */
SGRT_API sgrt_status sgrt_surface_create(sgrt_context *context, const sgrt_surface_data *data, sgrt_surface **surface);

/* A height field z(x, y) (eq. 10.1): z is H x W, mm, NaN where absent; column j lies at x = origin_mm[0] + j spacing_mm[0],
 * row i at y = origin_mm[1] + i spacing_mm[1]. Normals point to +z.
 * Errors as sgrt_surface_create; spacing must be finite and not 0. since 0.1 */
SGRT_API sgrt_status sgrt_surface_from_height_field(sgrt_context *context, const sgrt_view *z_mm,
                                                    const double origin_mm[2], const double spacing_mm[2],
                                                    sgrt_surface **surface);
SGRT_API void sgrt_surface_free(sgrt_surface *surface);

typedef struct sgrt_surface_info {
  uint32_t struct_size;
  int32_t mode_count;
  int64_t point_count; /* N, or the present points of a grid */
  int64_t height, width; /* of the grid; 0 for a cloud or mesh */
  int64_t face_count;
  double bounds_min_mm[3], bounds_max_mm[3];
  double correlation_points;
} sgrt_surface_info;
/* info->struct_size must be set by the caller. since 0.1 */
SGRT_API sgrt_status sgrt_surface_summary(const sgrt_surface *surface, sgrt_surface_info *info);

enum {
  SGRT_SURFACE_POINTS = 1,     /* f64, N x 3 or H x W x 3 */
  SGRT_SURFACE_NORMALS = 2,    /* f64, like points */
  SGRT_SURFACE_SIGMA = 3,      /* f64, N or H x W */
  SGRT_SURFACE_COVARIANCE = 4, /* f64, N x 6 or H x W x 6 */
  SGRT_SURFACE_FACES = 5,      /* i32, M x 3 */
  SGRT_SURFACE_MODES = 6       /* f64, K x N x 3 or K x H x W x 3 */
};
/* Lends an array; it lives as long as the surface. An absent array has data NULL.
 * SGRT_E_INVALID_ARGUMENT  NULL, unknown field. since 0.1 */
SGRT_API sgrt_status sgrt_surface_array(const sgrt_surface *surface, int32_t field, sgrt_view *view);

typedef struct sgrt_surface_normals_options {
  uint32_t struct_size;
  int32_t neighbours; /* points of the local fit, 6 to 200; default 24 */
  double viewpoint_mm[3]; /* normals of a cloud turn towards this point; default (0, 0, 1e4): above the couch */
  double radius_mm;   /* neighbours further than this do not count; default 50 */
} sgrt_surface_normals_options;
SGRT_API sgrt_status sgrt_surface_normals_options_init(sgrt_surface_normals_options *options, size_t size);

/* The surface with normals estimated by a local fit: the plane of the nearest neighbours, then a quadric over it
 * (docs/theory/surface.md eq. 1-2). A point whose neighbours fix no plane (fewer than 6 in reach, or on a line) gets a NaN
 * normal. sigma, covariance, faces and modes are kept. options may be NULL.
 * SGRT_E_INSUFFICIENT_DATA  fewer than 6 points
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_surface_estimate_normals(sgrt_context *context, const sgrt_surface *surface,
                                                   const sgrt_surface_normals_options *options, sgrt_surface **result);

typedef struct sgrt_surface_fuse_options {
  uint32_t struct_size;
  int32_t reserved;
  double max_distance_mm; /* points of two surfaces further apart than this are not the same skin; default 3 */
  double max_angle_deg;   /* nor are points whose normals differ by more; default 60 */
} sgrt_surface_fuse_options;
SGRT_API sgrt_status sgrt_surface_fuse_options_init(sgrt_surface_fuse_options *options, size_t size);

typedef struct sgrt_surface_fuse_info {
  uint32_t struct_size;
  int32_t surface_count;
  int64_t point_count;     /* points of the fused surface */
  int64_t overlap_count;   /* points seen by more than one surface */
  double disagreement_mean_mm; /* mean signed distance along the normal in the overlap, later surface minus first; NaN without overlap */
  double disagreement_rms_mm;  /* the daily check of a real room; NaN without overlap */
  double disagreement_expected_mm; /* RMS predicted from the points' own sigma; NaN without sigma */
} sgrt_surface_fuse_info;

/* Fuses surfaces of one frame (the pods of a room) into one cloud with normals; where they overlap a point is moved along its normal to
 * the covariance-weighted mean, and the doubled point of the later surface is dropped. All surfaces need normals.
 * options and info may be NULL.
 * SGRT_E_INVALID_ARGUMENT  count < 1 or > 64, a surface without normals. since 0.1 */
SGRT_API sgrt_status sgrt_surface_fuse(sgrt_context *context, const sgrt_surface *const *surfaces, int32_t count,
                                       const sgrt_surface_fuse_options *options, sgrt_surface **result,
                                       sgrt_surface_fuse_info *info);

typedef struct sgrt_surface_distance_options {
  uint32_t struct_size;
  int32_t reserved;
  double max_distance_mm; /* beyond it there is no correspondence; default 20 */
} sgrt_surface_distance_options;
SGRT_API sgrt_status sgrt_surface_distance_options_init(sgrt_surface_distance_options *options, size_t size);

/* The signed distance map: for each point of `live`, moved by reference_from_live (4 x 4; NULL: where it is), its distance
 * to `reference` along the reference's normal, mm, positive outside. NaN where there is no correspondence: too far, or
 * past the border of the reference. distance_mm: f64, N or H x W as live. The reference needs normals. options may be NULL. since 0.1 */
SGRT_API sgrt_status sgrt_surface_distance(sgrt_context *context, const sgrt_surface *reference,
                                           const sgrt_surface *live, const double reference_from_live[16],
                                           const sgrt_surface_distance_options *options,
                                           const sgrt_mut_view *distance_mm);

/* ----------------------------------------------------------------------------------------------------------- roi */

/* The part of the reference that counts. Immutable. */
typedef struct sgrt_roi sgrt_roi;
/* A polygon in the room's X-Y plane, seen from above: vertices is V x 2, mm, V >= 3, closed by itself. A reference point is
 * inside by the even-odd rule if its normal has z > 0.
 * SGRT_E_INVALID_ARGUMENT  fewer than 3 vertices, non-finite, no area
 * SGRT_E_LIMIT             more than 10,000 vertices. since 0.1 */
SGRT_API sgrt_status sgrt_roi_from_polygon(const sgrt_view *vertices_xy_mm, sgrt_roi **roi);
/* An axis-aligned box of the room. SGRT_E_INVALID_ARGUMENT  non-finite, or min >= max. since 0.1 */
SGRT_API sgrt_status sgrt_roi_from_box(const double min_mm[3], const double max_mm[3], sgrt_roi **roi);
SGRT_API void sgrt_roi_free(sgrt_roi *roi);
/* mask: u8, N or H x W as the surface: 1 inside, 0 outside or absent. since 0.1 */
SGRT_API sgrt_status sgrt_roi_mask(const sgrt_roi *roi, const sgrt_surface *surface, const sgrt_mut_view *mask);

/* --------------------------------------------------------------------------------------------------------- frame */

/* Where the patient is: D(x) = R (x - iso) + iso + t maps the reference (the plan) to the live patient, with
 * R = Rz(rtn) Rx(pitch) Ry(roll), right-handed about room X, Y, Z, and (lat, lng, vrt) = t. Frozen layout. */
typedef struct sgrt_patient_displacement {
  double lat_mm, lng_mm, vrt_mm;       /* along room X, Y, Z */
  double pitch_deg, roll_deg, rtn_deg; /* about room X, Y, Z */
  double mag_mm;                       /* length of the translation */
} sgrt_patient_displacement;

/* What the couch must do about it: the inverse of D, decomposed in the same way about the isocentre (R^T and -R^T t), which
 * is not minus the six numbers. Frozen layout. */
typedef struct sgrt_couch_correction {
  double lat_mm, lng_mm, vrt_mm;
  double pitch_deg, roll_deg, rtn_deg;
  double mag_mm;
} sgrt_couch_correction;

/* The six numbers of a registration. reference_from_live is the inverse of D. Either output may be NULL.
 * At pitch = +-90 deg roll is set to 0 (the two other turns are then one).
 * SGRT_E_INVALID_ARGUMENT  not a rigid motion within 1e-6, non-finite. since 0.1 */
SGRT_API sgrt_status sgrt_frame_shift_from_pose(const double reference_from_live[16], const double isocentre_mm[3],
                                                sgrt_patient_displacement *displacement, sgrt_couch_correction *correction);
/* The inverse of it. mag_mm is ignored. since 0.1 */
SGRT_API sgrt_status sgrt_frame_pose_from_displacement(const sgrt_patient_displacement *displacement,
                                                       const double isocentre_mm[3], double reference_from_live[16]);
SGRT_API sgrt_status sgrt_frame_pose_from_correction(const sgrt_couch_correction *correction,
                                                     const double isocentre_mm[3], double reference_from_live[16]);

enum { SGRT_HFS = 0, SGRT_HFP = 1, SGRT_FFS = 2, SGRT_FFP = 3, SGRT_HFDL = 4, SGRT_HFDR = 5, SGRT_FFDL = 6, SGRT_FFDR = 7 };
/* IEC 61217 fixed (couch at 0, plan's isocentre at the origin) from DICOM patient coordinates (LPS), 4 x 4.
 * patient_position: SGRT_HFS ... isocentre_dicom_mm: the plan's (300A,012C). since 0.1 */
SGRT_API sgrt_status sgrt_frame_fixed_from_dicom(int32_t patient_position, const double isocentre_dicom_mm[3],
                                                 double fixed_from_dicom[16]);
/* IEC 61217 fixed from the couch (patient support) turned by couch_deg, counter-clockwise seen from above: Rz, 4 x 4. since 0.1 */
SGRT_API sgrt_status sgrt_frame_fixed_from_couch(double couch_deg, double fixed_from_couch[16]);

/* ----------------------------------------------------------------------------------------------------------- rig */

/* The calibrated cameras of a room, schema "sgrt-rig/1" (docs/formats.md). Immutable. */
typedef struct sgrt_rig sgrt_rig;
/* text: UTF-8 JSON of `size` bytes, at most 16 MiB and nested at most 16 deep; need not end in NUL.
 * SGRT_E_FORMAT  not JSON, unknown schema or model, a missing or wrong field (the message names it, e.g.
 *                cameras[1].intrinsics), a pose that is not a rotation within 1e-6, a duplicated or unknown camera id,
 *                a distortion that folds inside the image
 * SGRT_E_LIMIT   too long, too deep, more than 64 cameras, an image side above 32,768. since 0.1 */
SGRT_API sgrt_status sgrt_rig_from_json(const char *text, size_t size, sgrt_rig **rig);
SGRT_API void sgrt_rig_free(sgrt_rig *rig);

typedef struct sgrt_rig_info {
  uint32_t struct_size;
  int32_t camera_count;
  int32_t pair_count;
  int32_t reserved;
} sgrt_rig_info;
SGRT_API sgrt_status sgrt_rig_summary(const sgrt_rig *rig, sgrt_rig_info *info);

enum {
  SGRT_RIG_JSON = 1,      /* the rig as JSON, all numbers to the last bit, unknown keys kept */
  SGRT_RIG_ID = 2,
  SGRT_RIG_ROOM = 3,
  SGRT_RIG_CAMERA_ID = 4, /* of camera `index` */
  SGRT_RIG_PAIR_ID = 5,   /* of pair `index` */
  SGRT_RIG_PAIR_LEFT = 6, /* camera id of pair `index` */
  SGRT_RIG_PAIR_RIGHT = 7
};
/* Lends a text; NULL where rig is NULL, the field unknown or index out of range. index is 0 for single texts. since 0.1 */
SGRT_API const char *sgrt_rig_text(const sgrt_rig *rig, int32_t field, int32_t index);

typedef struct sgrt_rig_camera {
  uint32_t struct_size;
  int32_t width, height; /* px */
  int32_t distortion_count; /* 0 pinhole, 5 brown5, 8 rational8 */
  double intrinsics[4]; /* fx fy cx cy, px */
  double distortion[8]; /* k1 k2 p1 p2 k3 (k4 k5 k6) */
  double camera_from_room[16];
} sgrt_rig_camera;
/* index: 0 to camera_count - 1. SGRT_E_INVALID_ARGUMENT  index out of range. since 0.1 */
SGRT_API sgrt_status sgrt_rig_camera_get(const sgrt_rig *rig, int32_t index, sgrt_rig_camera *camera);

/* Pixels of room points in a camera (pinhole and Brown-Conrady distortion, docs/theory/rig.md eq. 1-3).
 * camera_id: must be in the rig. x_in_room: N x 3, mm. pixels: f64, N x 2; NaN behind the camera, where the distortion
 * folds, and of a point that is not finite. jacobian: f64, N x 2 x 3, d pixel / d x_in_room, px/mm; may be NULL. A pixel outside the image is still given. since 0.1 */
SGRT_API sgrt_status sgrt_rig_project(sgrt_context *context, const sgrt_rig *rig, const char *camera_id,
                                      const sgrt_view *x_in_room, const sgrt_mut_view *pixels,
                                      const sgrt_mut_view *jacobian);
/* Rays of pixels: pixels N x 2; directions: f64, N x 3, unit, room axes, from the camera's centre; NaN where no ray has this pixel.
 * jacobian: f64, N x 3 x 2, d direction / d pixel; may be NULL. centre_mm: 3 doubles, may be NULL. since 0.1 */
SGRT_API sgrt_status sgrt_rig_unproject(sgrt_context *context, const sgrt_rig *rig, const char *camera_id,
                                        const sgrt_view *pixels, const sgrt_mut_view *directions,
                                        const sgrt_mut_view *jacobian, double centre_mm[3]);

/* -------------------------------------------------------------------------------------------------------- stereo */

/* Surface of one pod from a pair of speckle images. */
typedef struct sgrt_stereo sgrt_stereo;

typedef struct sgrt_stereo_options {
  uint32_t struct_size;
  int32_t window_px;       /* side of the square window, odd, 9 to 41; default 15 */
  int32_t stride_px;       /* a point every so many pixels of the rectified left image, 1 to 32; default 4 */
  int32_t min_component;   /* groups of fewer connected points are rejected as ambiguous; default 30 */
  double volume_min_mm[3]; /* working volume, room axes; it decides the search range. Default -infinity ... */
  double volume_max_mm[3]; /* ... +infinity: wherever both cameras see */
  double min_correlation;  /* ZNCC of an accepted match, above 0, below 1; default 0.8 */
  double max_left_right_px; /* left-right check; default 0.5 */
  double max_sigma_px;     /* matches with a larger predicted sigma have no texture; default 0.15 */
} sgrt_stereo_options;
SGRT_API sgrt_status sgrt_stereo_options_init(sgrt_stereo_options *options, size_t size);

/* Why a grid point has no surface point. */
enum {
  SGRT_REASON_NONE = 0,          /* it has one */
  SGRT_REASON_OUT_OF_VIEW = 1,   /* the window leaves one of the images */
  SGRT_REASON_OUT_OF_VOLUME = 2, /* its point lies outside the working volume */
  SGRT_REASON_NO_TEXTURE = 3,    /* too dark or too flat to match to max_sigma_px */
  SGRT_REASON_SATURATED = 4,     /* clipped pixels in the window */
  SGRT_REASON_NO_MATCH = 5,      /* no correlation above min_correlation: occluded, or lit unlike */
  SGRT_REASON_LEFT_RIGHT = 6,    /* the match back from the right image ends elsewhere */
  SGRT_REASON_AMBIGUOUS = 7,     /* an island too small to be trusted */
  SGRT_REASON_EDGE = 8,          /* the window straddles the edge of the surface, or a fold that its shape cannot follow */
  SGRT_REASON_COUNT = 9
};

/* Matches one pair along its epipolar lines and triangulates (docs/theory/stereo.md).
 * pair_id: of the rig. left, right: H x W, u8, u16 or f32, of the size the rig states. options may be NULL.
 * *result is written for SGRT_OK and for SGRT_E_NOT_FOUND; free with sgrt_stereo_free.
 * SGRT_E_INVALID_ARGUMENT  unknown pair, image of another size than the rig's, dtype, a window that is even
 * SGRT_E_NOT_FOUND         no point of the scene could be matched; the reasons are in the result
 * SGRT_E_DEGENERATE        one camera looks along the baseline: no rectification exists. *result is not written
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_stereo_match(sgrt_context *context, const sgrt_rig *rig, const char *pair_id,
                                       const sgrt_view *left, const sgrt_view *right,
                                       const sgrt_stereo_options *options, sgrt_stereo **result);
SGRT_API void sgrt_stereo_free(sgrt_stereo *result);

typedef struct sgrt_stereo_info {
  uint32_t struct_size;
  int32_t width, height; /* of the grid */
  int32_t reserved;
  int64_t point_count;
  int64_t reason_count[16]; /* grid points by SGRT_REASON_...; they sum to width * height */
  double noise_left;     /* image noise estimated from the matches' residuals, grey levels of the left image; NaN if nothing matched */
  double median_sigma_px; /* predicted one-sigma of a match along the epipolar line */
  double median_sigma_mm;
} sgrt_stereo_info;
SGRT_API sgrt_status sgrt_stereo_summary(const sgrt_stereo *result, sgrt_stereo_info *info);

enum {
  SGRT_STEREO_REASON = 1,      /* u8, H x W, SGRT_REASON_... */
  SGRT_STEREO_CORRELATION = 2, /* f32, H x W, ZNCC; NaN where absent */
  SGRT_STEREO_SIGMA_PX = 3,    /* f32, H x W, one sigma of the match; NaN where absent */
  SGRT_STEREO_LEFT_PX = 4,     /* f64, H x W x 2, pixel of the point in the left image as taken */
  SGRT_STEREO_RIGHT_PX = 5     /* f64, H x W x 2, in the right image; NaN where absent */
};
SGRT_API sgrt_status sgrt_stereo_array(const sgrt_stereo *result, int32_t field, sgrt_view *view);
/* A new surface handle on the result's organised grid (points, normals, sigma_mm, covariance); shares memory, free both.
 * since 0.1 */
SGRT_API sgrt_status sgrt_stereo_surface(const sgrt_stereo *result, sgrt_surface **surface);

/* Session: the same pair again and again (live mode). Owns its buffers: the steady state allocates nothing. One thread at
 * a time. */
typedef struct sgrt_stereo_session sgrt_stereo_session;
SGRT_API sgrt_status sgrt_stereo_session_create(sgrt_context *context, const sgrt_rig *rig, const char *pair_id,
                                                const sgrt_stereo_options *options, sgrt_stereo_session **session);
/* time_s: finite, must not decrease. *result is lent until the next push or the session's end: do not free it. Errors as
 * sgrt_stereo_match; after any but SGRT_E_NOT_FOUND *result is NULL, and the session can go on. A surface taken from
 * *result (sgrt_stereo_surface) outlives the next push. since 0.1 */
SGRT_API sgrt_status sgrt_stereo_session_push(sgrt_context *context, sgrt_stereo_session *session, const sgrt_view *left,
                                              const sgrt_view *right, double time_s, const sgrt_stereo **result);
SGRT_API void sgrt_stereo_session_free(sgrt_stereo_session *session);

/* ----------------------------------------------------------------------------------------------------------- icp */

/* Result of a fine registration. */
typedef struct sgrt_icp sgrt_icp;

typedef struct sgrt_icp_options {
  uint32_t struct_size;
  int32_t max_iterations;   /* of closest points and step, 1 to 10,000; default 60 */
  double max_distance_mm;   /* pairs further apart never count; default 40 */
  double max_angle_deg;     /* nor do pairs whose normals differ by more; default 45 */
  double min_inlier_share;  /* of the live points, or of the reference: below it they do not overlap; default 0.3 */
  double step_tolerance_mm; /* converged when a step moves no inlier by more; default 1e-4 */
  double weak_sigma_mm;     /* verdict `weak` when one sigma of a motion exceeds it (rotations at 100 mm); default 0.5 */
  double degenerate_sigma_mm; /* SGRT_E_DEGENERATE beyond it; default 5 */
} sgrt_icp_options;
SGRT_API sgrt_status sgrt_icp_options_init(sgrt_icp_options *options, size_t size);

/* Finds the rigid motion that lays `live` on `reference`: point-to-plane ICP with robust weights, refined with Ceres'
 * TinySolver on the points' own covariances (docs/theory/icp.md).
 *
 * reference, live: mm, one room frame. Missing normals are estimated. isocentre_mm: where the motion is reported.
 * roi: the part of the reference that counts; NULL: all. initial_reference_from_live: 4 x 4 first guess; NULL: identity.
 * options may be NULL. *result is written for SGRT_OK and for statuses 10-19; free with sgrt_icp_free.
 * Uses the context's threads; the result does not depend on their number.
 *
 * SGRT_E_INSUFFICIENT_DATA  fewer than 6 points in either surface or in the ROI, or fewer than 6 pairs
 * SGRT_E_NOT_FOUND          the surfaces do not overlap: inlier share below min_inlier_share
 * SGRT_E_DEGENERATE         the pairs leave a direction free; the summary and SGRT_ICP_WORDS name it, the pose is NaN
 * SGRT_E_NOT_CONVERGED      max_iterations came first; the pose is NaN
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_icp_align(sgrt_context *context, const sgrt_surface *reference, const sgrt_surface *live,
                                    const double isocentre_mm[3], const sgrt_roi *roi,
                                    const double initial_reference_from_live[16], const sgrt_icp_options *options,
                                    sgrt_icp **result);
SGRT_API void sgrt_icp_free(sgrt_icp *result);

enum { SGRT_VERDICT_NONE = 0, SGRT_VERDICT_OK = 1, SGRT_VERDICT_WEAK = 2 };

/* All numbers are NaN where no pose was found, but for the isocentre, the counts, the inlier share and the free motions. */
typedef struct sgrt_icp_info {
  uint32_t struct_size;
  sgrt_status status;     /* as sgrt_icp_align returned */
  int32_t verdict;        /* SGRT_VERDICT_...; SGRT_ICP_VERDICT tells why */
  int32_t iterations;
  int64_t pair_count;     /* inlier pairs of the last iteration */
  int32_t free_count;     /* free directions, 0 to 6 */
  int32_t reserved;
  double reference_from_live[16];
  double isocentre_mm[3];
  sgrt_patient_displacement displacement;
  sgrt_couch_correction correction;
  double covariance[36];  /* of (rotation rad, translation mm) of the displacement at the isocentre, room axes:
                             D_true = D exp(delta) about the isocentre */
  double sigma_mm[3];     /* of lat, lng, vrt: its diagonal */
  double sigma_deg[3];    /* about X, Y, Z */
  double free_motion[36]; /* free_count rows of (rotation rad, translation mm) at the isocentre, largest entry 1 with
                             rotations at 100 mm */
  double rms_mm;          /* weighted, of the inliers' distances along the normal */
  double inlier_share;    /* of the live points whose match lies in the ROI */
} sgrt_icp_info;
SGRT_API sgrt_status sgrt_icp_summary(const sgrt_icp *result, sgrt_icp_info *info);

enum {
  SGRT_ICP_DISTANCE = 1, /* f64, N or H x W as live: signed distance map, mm, at the pose found; NaN without correspondence */
  SGRT_ICP_INLIER = 2    /* u8, like it: 1 where the point took part */
};
SGRT_API sgrt_status sgrt_icp_array(const sgrt_icp *result, int32_t field, sgrt_view *view);

enum {
  SGRT_ICP_VERDICT = 1, /* "ok", "weak: ...", or why there is no pose */
  SGRT_ICP_WORDS = 2    /* of free motion `index`: "slides along LNG" */
};
SGRT_API const char *sgrt_icp_text(const sgrt_icp *result, int32_t field, int32_t index);

/* --------------------------------------------------------------------------------------------------------- board */

enum {
  SGRT_BOARD_CHESSBOARD = 1, /* its inner corners; point 0 lies at a dark square of the board's corner */
  SGRT_BOARD_CIRCLES = 2     /* dark discs in an asymmetric grid, as OpenCV numbers them */
};

/* A calibration target. Its points, row by row, z = 0, x to the right and y down as the board is looked at: a chessboard's at
 * (j, i) spacing_mm, circles at (2 j + i mod 2, i) spacing_mm. */
typedef struct sgrt_board {
  uint32_t struct_size;
  int32_t kind;          /* SGRT_BOARD_... */
  int32_t columns, rows; /* inner corners, or circles a row and rows; 3 to 100 */
  double spacing_mm;     /* side of a square; of circles: the distance of two rows */
} sgrt_board;
/* A chessboard without a size: columns, rows and spacing_mm are the caller's to set. since 0.1 */
SGRT_API sgrt_status sgrt_board_init(sgrt_board *board, size_t size);
/* points: f64, columns*rows x 3, mm. SGRT_E_INVALID_ARGUMENT  a side below 3 or above 100, a spacing that is not positive. since 0.1 */
SGRT_API sgrt_status sgrt_board_points(const sgrt_board *board, const sgrt_mut_view *points);

typedef struct sgrt_board_info {
  uint32_t struct_size;
  int32_t found_count;             /* points found; hidden ones are NaN */
  int32_t seen_columns, seen_rows; /* where it was not found: the largest chessboard that was seen; 0: none */
  int32_t half_turn_ambiguous;     /* 1: turned by half a turn the board looks the same, and either order may have come out */
  int32_t reserved;
} sgrt_board_info;

/* Finds the board in an image and each of its points to a fraction of a pixel (docs/theory/calibration.md eq. 18-19).
 * image: H x W, u8, u16 or f32. pixels: f64, columns*rows x 2; NaN where a point is hidden. sigma_px: f64, columns*rows, one sigma of each
 * coordinate from the image's noise; may be NULL. info may be NULL. The whole board must be in the image; a fifth of its points may be
 * hidden. The time is bounded by the image's size, board or none.
 * SGRT_E_NOT_FOUND  no whole board of this size; the message and info tell what was seen; pixels are NaN
 * SGRT_E_INVALID_ARGUMENT, SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_board_detect(sgrt_context *context, const sgrt_board *board, const sgrt_view *image,
                                       const sgrt_mut_view *pixels, const sgrt_mut_view *sigma_px, sgrt_board_info *info);

/* --------------------------------------------------------------------------------------------------- calibration */

/* A calibration of cameras, a check of a rig, or its fit into a room. */
typedef struct sgrt_calibration sgrt_calibration;

/* What cameras saw of a target: K correspondences, in any order. */
typedef struct sgrt_calibration_data {
  uint32_t struct_size;
  int32_t camera_count;          /* C, 1 to 64 */
  int32_t placement_count;       /* of the target; 1 for a phantom */
  int32_t pair_count;            /* may be 0 */
  int32_t half_turn_ambiguous;   /* 1: the target turned by half a turn looks the same (sgrt_board_info) */
  int32_t reserved;
  const char *const *camera_ids; /* the first one's frame is the room of the calibrated rig */
  const char *const *placements; /* their names, for the report; NULL: numbers */
  const char *const *pair_ids;   /* of stereo pairs to be stated in the rig */
  sgrt_view image_sizes;         /* C x 2 i32, width and height */
  sgrt_view pair_cameras;        /* pair_count x 2 i32, left and right; absent where pair_count is 0 */
  sgrt_view points;              /* N x 3, mm: the target's, flat (z = 0) but for sgrt_calibration_room */
  sgrt_view index;               /* K x 3 i32: camera, placement, point */
  sgrt_view pixels;              /* K x 2 */
  sgrt_view sigma;               /* K, relative one sigma of a pixel coordinate; absent: all alike */
} sgrt_calibration_data;
SGRT_API sgrt_status sgrt_calibration_data_init(sgrt_calibration_data *data, size_t size);

typedef struct sgrt_calibration_options {
  uint32_t struct_size;
  int32_t distortion_count; /* 0 pinhole, 5 brown5, 8 rational8; default 5 */
  int32_t max_iterations;   /* of each solve; default 100 */
  int32_t min_views;        /* of each camera, at least 3; default 3 */
  int32_t split_half;       /* 1: two halves of the placements are calibrated too and compared; default 1 */
  int32_t reserved;
  double outlier_sigma;     /* a corner further off than this many sigma, and than 0.25 px, does not count; default 6 */
  double warp_sigma_mm;     /* how far the board may be bent; 0: 1 % of its half size; negative: it is flat; default 0 */
  double point_sigma_mm;    /* sgrt_calibration_room: one sigma of the phantom's own points; default 0 */
  double noise_px;          /* sgrt_calibration_room: one sigma of a found point; 0: what the rig states; default 0 */
  const char *rig_id;       /* of the result; NULL: "calibrated rig", or the first rig's */
} sgrt_calibration_options;
SGRT_API sgrt_status sgrt_calibration_options_init(sgrt_calibration_options *options, size_t size);

/* Calibrates all cameras, board placements and the board's warp in one least-squares solve (bundle adjustment, placements eliminated;
 * docs/theory/calibration.md eq. 4-14), with the covariance of all lenses and poses. The result does not depend on the order of the input
 * but for the room, which is the first camera's frame. options may be NULL.
 * *result is written for SGRT_OK and for statuses 10-19; free with sgrt_calibration_free.
 * SGRT_E_INVALID_ARGUMENT   shape, dtype, range, non-finite; two cameras with one id; a point seen twice; a target that is not flat
 * SGRT_E_INSUFFICIENT_DATA  a camera with fewer than min_views usable views, or one that no placement links to the others; it is named
 * SGRT_E_DEGENERATE         the views leave the lens free; the message says which motion of the board is missing
 * SGRT_E_NOT_CONVERGED, SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_solve(sgrt_context *context, const sgrt_calibration_data *data,
                                            const sgrt_calibration_options *options, sgrt_calibration **result);

/* Holds a rig against images that it was not made from: only the target's placements (and its warp) are fitted. No corner is left out.
 * SGRT_E_INVALID_ARGUMENT   also: a camera that is not in the rig, or images of another size
 * SGRT_E_INSUFFICIENT_DATA  no usable view. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_check(sgrt_context *context, const sgrt_rig *rig, const sgrt_calibration_data *data,
                                            const sgrt_calibration_options *options, sgrt_calibration **result);

/* Brings rigs (pods calibrated by themselves, or one rig) into the room: data->points are a phantom's, at least 3 and not on a line, in the
 * room's frame; each rig must see three of them with two cameras. The result's rig holds all cameras, with the fit's covariance in its
 * modes. A rig that is in the room already: the report tells how far the phantom stands from where it should (the daily check).
 * SGRT_E_INSUFFICIENT_DATA  a rig that sees fewer than 3 points with two cameras
 * SGRT_E_DEGENERATE         points on a line
 * SGRT_E_NOT_FOUND          a point that lies outside what a camera can see. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_room(sgrt_context *context, const sgrt_rig *const *rigs, int32_t count,
                                           const sgrt_calibration_data *data, const sgrt_calibration_options *options,
                                           sgrt_calibration **result);
SGRT_API void sgrt_calibration_free(sgrt_calibration *result);

/* Numbers are NaN where there is no answer. */
typedef struct sgrt_calibration_info {
  uint32_t struct_size;
  sgrt_status status;
  int32_t camera_count, view_count; /* views: images that count */
  int32_t corner_count;             /* corners that count */
  int32_t discarded_count;          /* images and corners that do not; the report names them */
  int32_t warning_count;
  int32_t iterations;
  double noise_px;        /* one sigma of a corner's coordinate, corrected for degrees of freedom */
  double rms_px;          /* root mean square length of the residuals that count (OpenCV's figure) */
  double rms_all_px;      /* ... of all corners of the views that count */
  double expected_rms_px; /* of sgrt_calibration_check: what the rig's noise and uncertainty let expect; else NaN */
} sgrt_calibration_info;
SGRT_API sgrt_status sgrt_calibration_summary(const sgrt_calibration *result, sgrt_calibration_info *info);

enum {
  SGRT_CALIBRATION_CORNERS = 1,   /* f64, K x 8: camera, placement, point, pixel x y, residual x y (seen less projected, px), 1 where it counts */
  SGRT_CALIBRATION_COVARIANCE = 2 /* f64, P x P, of SGRT_CALIBRATION_PARAMETER 0 to P - 1; of sgrt_calibration_solve only */
};
/* Lends an array; it lives as long as the result. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_array(const sgrt_calibration *result, int32_t field, sgrt_view *view);

enum {
  SGRT_CALIBRATION_REPORT = 1,   /* JSON, schema sgrt-calibration/1 (docs/formats.md) */
  SGRT_CALIBRATION_WARNING = 2,  /* number `index`, one line */
  SGRT_CALIBRATION_PARAMETER = 3 /* name of parameter `index`: "pod1-left.fx" */
};
SGRT_API const char *sgrt_calibration_text(const sgrt_calibration *result, int32_t field, int32_t index);
/* The calibrated rig, or the rig in the room. SGRT_E_NOT_FOUND  the result has none. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_rig(const sgrt_calibration *result, sgrt_rig **rig);

/* How uncertain a rig's calibration leaves the pixel of a room point: covariance: f64, N x 3, xx xy yy, px2, from the modes that the rig
 * states (eq. 20); NaN where the point has no pixel. camera_id: of the rig. x_in_room: N x 3, mm.
 * SGRT_E_INVALID_ARGUMENT  also: a rig that states no uncertainty. since 0.1 */
SGRT_API sgrt_status sgrt_rig_pixel_covariance(sgrt_context *context, const sgrt_rig *rig, const char *camera_id,
                                               const sgrt_view *x_in_room, const sgrt_mut_view *covariance);
/* ... and the point that a pair triangulates: covariance: f64, N x 6, xx xy xz yy yz zz, mm2, of the calibration and of noise_px on each
 * pixel coordinate (eq. 21-22). since 0.1 */
SGRT_API sgrt_status sgrt_rig_point_covariance(sgrt_context *context, const sgrt_rig *rig, const char *pair_id,
                                               const sgrt_view *x_in_room, double noise_px, const sgrt_mut_view *covariance);

#ifdef __cplusplus
}
#endif
#endif /* SGRT_H */
