/* sgrt.h - surface-guided radiation therapy: from camera images of a patient's skin to a six-degree couch shift.
 *
 * This header is the C manual; its sections follow the pipeline.
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
#define SGRT_VERSION_MINOR 9
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

/* The same of an output. */
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
  const char *const *mode_names; /* K texts, or NULL: unnamed. Modes of two surfaces with one name have one cause ("rig id/3"), and
                                    cancel in a registration as far as they are alike */
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

enum { SGRT_SURFACE_MODE_NAME = 1 /* of mode `index`; "" where it has none */ };
/* Lends a text; NULL where surface is NULL, the field unknown or index out of range. since 0.1 */
SGRT_API const char *sgrt_surface_text(const sgrt_surface *surface, int32_t field, int32_t index);
/* The surface under a rigid motion x -> R x + t (4 x 4, row-major, mm): points, normals, covariance and modes; all else is
 * kept. A reference for another couch angle: pose from sgrt_frame_couch_turn.
 * SGRT_E_INVALID_ARGUMENT  not a rigid motion within 1e-6, or it moves a point beyond 1e5 mm. since 0.1 */
SGRT_API sgrt_status sgrt_surface_move(sgrt_context *context, const sgrt_surface *surface, const double pose[16],
                                       sgrt_surface **result);

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

typedef struct sgrt_surface_filter_options {
  uint32_t struct_size;
  int32_t reserved;
  double radius_mm;   /* neighbours within it count; 0, the default: three spacings of the points */
  double max_sigmas;  /* two points further apart along their normals, in sigmas of both, are not one skin; 1 to 100, default 4 */
  double min_support; /* a point that agrees with no more than this share of its neighbours is an outlier; default 0.15 */
} sgrt_surface_filter_options;
SGRT_API sgrt_status sgrt_surface_filter_options_init(sgrt_surface_filter_options *options, size_t size);

/* What became of a point. */
enum {
  SGRT_FILTER_FILTERED = 0, /* moved along its normal onto the quadric through its neighbours */
  SGRT_FILTER_ABSENT = 1,   /* it was absent, and still is */
  SGRT_FILTER_KEPT = 2,     /* left as it was: too few neighbours, or their noise is shared so that no mean would be better */
  SGRT_FILTER_OUTLIER = 3,  /* taken out: it agrees with no neighbour, or with too few */
  SGRT_FILTER_COUNT = 4
};

typedef struct sgrt_surface_filter_info {
  uint32_t struct_size;
  int32_t reserved;
  int64_t count[8]; /* points by SGRT_FILTER_... */
  double radius_mm; /* that was used */
  double sigma_before_mm, sigma_after_mm; /* median over the filtered points, along the normal; NaN without any */
  double correlation_points; /* of the result: what one point has gained, it shares with its neighbours */
} sgrt_surface_filter_info;

/* The spatial filter, for the surface of any sensor, a cloud or a mesh: takes outliers out and moves the other points along
 * their normals onto a weighted quadric through the neighbours on the same side of every edge (docs/theory/filters.md). Nothing is
 * filled; tangential position, modes and absent points stay. sigma and covariance along the normal become those of the
 * filtered points, larger where the skin is no quadric within the radius; a surface without them gets its measured roughness.
 * An outlier is absent in a grid and dropped, with its faces, from a cloud or a mesh.
 * The surface needs normals. reason: u8, N or H x W as the surface, SGRT_FILTER_...; it, options and info may be NULL.
 * SGRT_E_INVALID_ARGUMENT   no normals, an option out of range
 * SGRT_E_INSUFFICIENT_DATA  points without neighbours, nothing left. since 0.1 */
SGRT_API sgrt_status sgrt_surface_filter(sgrt_context *context, const sgrt_surface *surface,
                                         const sgrt_surface_filter_options *options, sgrt_surface **result,
                                         const sgrt_mut_view *reason, sgrt_surface_filter_info *info);

/* ------------------------------------------------------------------------------------------------ filter_session */

/* The temporal filter of one sensor's organised surfaces: a Kalman filter a pixel, which starts again where a patch of 1 to
 * 63 pixels has moved by more than its noise. One thread at a time; the steady state allocates nothing. */
typedef struct sgrt_filter_session sgrt_filter_session;

typedef struct sgrt_filter_session_options {
  uint32_t struct_size;
  int32_t reserved;
  double motion_sigmas; /* of a patch's mean innovation, beyond which it has moved; 1 to 100, default 4 */
  double drift_mm;      /* how far skin may wander unseen in a second, one sigma of a random walk; 0 to 1000, default 0.05 */
} sgrt_filter_session_options;
SGRT_API sgrt_status sgrt_filter_session_options_init(sgrt_filter_session_options *options, size_t size);

/* What became of a pixel. */
enum {
  SGRT_TEMPORAL_AVERAGED = 0, /* with the frames before */
  SGRT_TEMPORAL_ABSENT = 1,   /* absent in this frame; what was known of it waits */
  SGRT_TEMPORAL_STARTED = 2,  /* seen for the first time */
  SGRT_TEMPORAL_MOVED = 3,    /* started again: this frame alone */
  SGRT_TEMPORAL_COUNT = 4
};

typedef struct sgrt_filter_session_info {
  uint32_t struct_size;
  int32_t reserved;
  int64_t count[8]; /* pixels by SGRT_TEMPORAL_... */
} sgrt_filter_session_info;

/* options may be NULL. since 0.1 */
SGRT_API sgrt_status sgrt_filter_session_create(const sgrt_filter_session_options *options,
                                                sgrt_filter_session **session);
/* frame: an organised grid with normals and sigma or covariance, of one size in all pushes. time_s: must not decrease. info
 * may be NULL. After an error the session is as it was.
 * SGRT_E_INVALID_ARGUMENT  another size, no normals, no sigma, a time that runs backwards
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_filter_session_push(sgrt_context *context, sgrt_filter_session *session,
                                              const sgrt_surface *frame, double time_s, sgrt_filter_session_info *info);
/* A new handle on the filtered frame of the last push; it outlives the next one. Its errors are correlated from push to
 * push. SGRT_E_NOT_FOUND  nothing pushed yet. since 0.1 */
SGRT_API sgrt_status sgrt_filter_session_surface(const sgrt_filter_session *session, sgrt_surface **surface);
/* What became of the pixels at the last push: u8, H x W, SGRT_TEMPORAL_...; lent until the next push. Absent before the
 * first. since 0.1 */
SGRT_API sgrt_status sgrt_filter_session_states(const sgrt_filter_session *session, sgrt_view *view);
SGRT_API void sgrt_filter_session_free(sgrt_filter_session *session);

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

/* The region under a rigid motion, as sgrt_surface_move moves the reference that it was drawn on. A polygon turns about the
 * vertical alone, a box not at all: SGRT_E_INVALID_ARGUMENT. since 0.1 */
SGRT_API sgrt_status sgrt_roi_move(const sgrt_roi *roi, const double pose[16], sgrt_roi **result);

enum {
  SGRT_ROI_POLYGON = 1, /* f64, V x 2, mm; absent for a box */
  SGRT_ROI_BOX = 2      /* f64, 2 x 3, mm: min and max; absent for a polygon */
};
/* Lends what the region was made from; it lives as long as the region. SGRT_E_INVALID_ARGUMENT  unknown field. since 0.1 */
SGRT_API sgrt_status sgrt_roi_array(const sgrt_roi *roi, int32_t field, sgrt_view *view);

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

/* What a couch without pitch and roll can do about it: the correction by lat, lng, vrt and rtn that brings the isocentre back
 * exactly and takes away the turn about the vertical; `remaining` is what the patient is then displaced by: his pitch and
 * roll alone (docs/theory/frames.md eq. 5). Either output may be NULL. Errors as sgrt_frame_shift_from_pose. since 0.1 */
SGRT_API sgrt_status sgrt_frame_four_dof(const double reference_from_live[16], const double isocentre_mm[3],
                                         sgrt_couch_correction *correction, sgrt_patient_displacement *remaining);

enum { SGRT_HFS = 0, SGRT_HFP = 1, SGRT_FFS = 2, SGRT_FFP = 3, SGRT_HFDL = 4, SGRT_HFDR = 5, SGRT_FFDL = 6, SGRT_FFDR = 7 };
/* IEC 61217 fixed (couch at 0, plan's isocentre at the origin) from DICOM patient coordinates (LPS), 4 x 4.
 * patient_position: SGRT_HFS ... isocentre_dicom_mm: the plan's (300A,012C). since 0.1 */
SGRT_API sgrt_status sgrt_frame_fixed_from_dicom(int32_t patient_position, const double isocentre_dicom_mm[3],
                                                 double fixed_from_dicom[16]);
/* IEC 61217 fixed from the couch (patient support) turned by couch_deg, counter-clockwise seen from above: Rz, 4 x 4. since 0.1 */
SGRT_API sgrt_status sgrt_frame_fixed_from_couch(double couch_deg, double fixed_from_couch[16]);
/* IEC 61217 fixed from the gantry turned by gantry_deg, clockwise seen by who faces it: Ry, 4 x 4. since 0.1 */
SGRT_API sgrt_status sgrt_frame_fixed_from_gantry(double gantry_deg, double fixed_from_gantry[16]);
/* How what lies on the couch moves in the room when the couch turns from 0 to couch_deg: about the vertical through the
 * isocentre. pose: 4 x 4, for sgrt_surface_move and sgrt_roi_move. since 0.1 */
SGRT_API sgrt_status sgrt_frame_couch_turn(double couch_deg, const double isocentre_mm[3], double pose[16]);

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
  int32_t tof_count;
} sgrt_rig_info;
SGRT_API sgrt_status sgrt_rig_summary(const sgrt_rig *rig, sgrt_rig_info *info);

enum {
  SGRT_RIG_JSON = 1,      /* the rig as JSON, all numbers to the last bit, unknown keys kept */
  SGRT_RIG_ID = 2,
  SGRT_RIG_ROOM = 3,
  SGRT_RIG_CAMERA_ID = 4, /* of camera `index` */
  SGRT_RIG_PAIR_ID = 5,   /* of pair `index` */
  SGRT_RIG_PAIR_LEFT = 6, /* camera id of pair `index` */
  SGRT_RIG_PAIR_RIGHT = 7,
  SGRT_RIG_TOF_ID = 8,           /* of time-of-flight unit `index` */
  SGRT_RIG_TOF_CAMERA = 9,       /* its camera's id */
  SGRT_RIG_TOF_PIXEL_OFFSET = 10 /* the file of its pixel offsets, beside the rig; "" where it has none */
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

/* A time-of-flight camera: tap_k = B + A cos(phi - tap_phase_rad[k]), phi = 4 pi modulation_hz n range / c. */
typedef struct sgrt_rig_tof {
  uint32_t struct_size;
  int32_t frequency_count; /* 1 to 8 */
  int32_t tap_count;       /* 3 to 32 */
  int32_t differential;    /* 1: signed taps, which tell nothing of their shot noise */
  double modulation_hz[8];
  double tap_phase_rad[32];
  double electrons_per_count, read_noise_e, refractive_index;
} sgrt_rig_tof;
/* index: 0 to tof_count - 1. SGRT_E_INVALID_ARGUMENT  index out of range. since 0.1 */
SGRT_API sgrt_status sgrt_rig_tof_get(const sgrt_rig *rig, int32_t index, sgrt_rig_tof *tof);

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
  int32_t window_px;       /* side of the square window, odd, 9 to 41; default 21 */
  int32_t stride_px;       /* a point every so many pixels of the rectified left image, 1 to 32; default 3 */
  int32_t min_component;   /* groups of fewer connected points are rejected as ambiguous; default 30 */
  double volume_min_mm[3]; /* working volume, room axes; it decides the search range. Default -infinity ... */
  double volume_max_mm[3]; /* ... +infinity: wherever both cameras see */
  double min_correlation;  /* ZNCC of an accepted match, above 0, below 1; default 0.8 */
  double max_left_right_px; /* left-right check; default 0.5 */
  double max_sigma_px;     /* matches with a larger predicted sigma are left out; default 0.1 (metrology). 1 covers weakly
                              textured skin and edges too, each point with its sigma */
  double max_epipolar_px;  /* off the epipolar lines by more (RMS), the rig is out of calibration; default 0.1 */
} sgrt_stereo_options;
SGRT_API sgrt_status sgrt_stereo_options_init(sgrt_stereo_options *options, size_t size);

/* Why a grid point has no surface point. */
enum {
  SGRT_REASON_NONE = 0,          /* it has one */
  SGRT_REASON_OUT_OF_VIEW = 1,   /* the window leaves one of the images */
  SGRT_REASON_OUT_OF_VOLUME = 2, /* its point lies outside the working volume */
  SGRT_REASON_NO_TEXTURE = 3,    /* too dark or too flat to match to max_sigma_px */
  SGRT_REASON_SATURATED = 4,     /* clipped pixels in the window */
  SGRT_REASON_NO_MATCH = 5,      /* no correlation above min_correlation: lit unlike, or hidden from one camera */
  SGRT_REASON_LEFT_RIGHT = 6,    /* the match back from the right image ends elsewhere */
  SGRT_REASON_AMBIGUOUS = 7,     /* an island too small to be trusted */
  SGRT_REASON_EDGE = 8,          /* the window straddles the edge of the surface, or a fold that its shape cannot follow */
  SGRT_REASON_MOVED = 9,         /* live mode: its match lies further from the prior than band_mm */
  SGRT_REASON_OCCLUDED = 10,     /* another part of the surface stands before it in the right image */
  SGRT_REASON_COUNT = 11
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
  /* The rig on trial: how far matches lie off their epipolar lines, px, over a subset of windows. A right rig leaves noise
   * alone. NaN where fewer than 20 windows answer. */
  double epipolar_px;       /* the median: row in the right image less the row that the rig predicts, rectified */
  double epipolar_sigma_px; /* its sigma */
  double epipolar_rms_px;   /* over the image, noise taken out */
  int64_t epipolar_count;   /* windows that answered */
  int32_t out_of_calibration; /* 1: epipolar_rms_px is beyond max_epipolar_px and beyond three sigma. Depths are then wrong
                                 by an unknown amount: calibrate again */
  int32_t reserved2;
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
/* Of one pair of the rig. options may be NULL. Errors as sgrt_stereo_match, but for those of images. since 0.1 */
SGRT_API sgrt_status sgrt_stereo_session_create(sgrt_context *context, const sgrt_rig *rig, const char *pair_id,
                                                const sgrt_stereo_options *options, sgrt_stereo_session **session);
/* time_s: finite, must not decrease. *result is lent until the next push or the session's end: do not free it. Errors as
 * sgrt_stereo_match; after any but SGRT_E_NOT_FOUND *result is NULL, and the session can go on. A surface taken from
 * *result (sgrt_stereo_surface) outlives the next push. since 0.1 */
SGRT_API sgrt_status sgrt_stereo_session_push(sgrt_context *context, sgrt_stereo_session *session, const sgrt_view *left,
                                              const sgrt_view *right, double time_s, const sgrt_stereo **result);

typedef struct sgrt_stereo_prior_options {
  uint32_t struct_size;
  int32_t follow;  /* 1: each result is the prior of the next push; default 0 */
  double band_mm;  /* along the line of sight: what has moved further gets SGRT_REASON_MOVED; above 0, at most 1000; default 25 */
} sgrt_stereo_prior_options;
SGRT_API sgrt_status sgrt_stereo_prior_options_init(sgrt_stereo_prior_options *options, size_t size);

/* Live mode: the pushes that follow search only near `prior` (a reference, an earlier surface, any cloud of chosen points; room
 * axes), only where it lies in `roi`, and prefilter only what shows that. The grid is that part of the rectified left image;
 * what of it lies beside the region is SGRT_REASON_OUT_OF_VOLUME. The prior says where to look, never what is found: a match
 * must correlate and agree left-right as without it. prior NULL: as before. roi may be NULL: all of the prior. options may be NULL.
 * SGRT_E_INSUFFICIENT_DATA  fewer than 3 points of the prior lie in roi and where both cameras see. The session is as before. since 0.1 */
SGRT_API sgrt_status sgrt_stereo_session_set_prior(sgrt_context *context, sgrt_stereo_session *session,
                                                   const sgrt_surface *prior, const sgrt_roi *roi,
                                                   const sgrt_stereo_prior_options *options);

SGRT_API void sgrt_stereo_session_free(sgrt_stereo_session *session);

/* -------------------------------------------------------------------------------------------------------- stripe */

/* The centre of a laser stripe in each line of an image. */
typedef struct sgrt_stripe sgrt_stripe;

enum {
  SGRT_STRIPE_CENTROID = 0, /* grey centroid over the local background: fastest */
  SGRT_STRIPE_GAUSSIAN = 1, /* least-squares Gaussian: nearest to what the noise allows */
  SGRT_STRIPE_RIDGE = 2     /* Steger's ridge of the smoothed image: for weak stripes; rounds bends */
};

typedef struct sgrt_stripe_options {
  uint32_t struct_size;
  int32_t method;       /* SGRT_STRIPE_...; default SGRT_STRIPE_GAUSSIAN */
  int32_t columns;      /* 1: lines are columns (a stripe that runs across), 0: rows; default 0. A sweep chooses by itself */
  int32_t min_length;   /* lines; shorter pieces of a stripe are rejected as ambiguous, 1 to 1000; default 5 */
  double half_width_px; /* of the centroid's window, 2 to 100; 0: from the stripe's own width; default 0 */
  double min_signal;    /* grey levels of a peak over its background; default 0: 6 times the noise, at least 2 levels of an integer image */
  double noise;         /* grey levels, one sigma of a dark pixel; default 0: from the image */
  double gain;          /* grey levels an electron; shot noise adds gain x signal to the variance; default 0 */
  double saturation;    /* grey level from which a pixel is clipped; default 0: the type's largest */
  double max_asymmetry; /* two-sided width test: (right - left) / (right + left) of the foot about the top; above 0 to 1; default 0.3 */
} sgrt_stripe_options;
SGRT_API sgrt_status sgrt_stripe_options_init(sgrt_stripe_options *options, size_t size);

/* Finds the stripe in each line (docs/theory/laser.md eq. 1-9). Of several candidates in a line the one of the strongest continuous
 * piece of the right width is taken; where two are alike the line is ambiguous.
 * image: H x W, u8, u16 or f32. dark: the same without laser, may be NULL (then the local background is taken off). options may be NULL.
 * *result is written for SGRT_OK and SGRT_E_NOT_FOUND; free with sgrt_stripe_free.
 * SGRT_E_INVALID_ARGUMENT  shape, dtype, a dark frame of another size or type, an option out of range
 * SGRT_E_NOT_FOUND         no stripe in any line; the reasons are in the result
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_stripe_extract(sgrt_context *context, const sgrt_view *image, const sgrt_view *dark,
                                         const sgrt_stripe_options *options, sgrt_stripe **result);
SGRT_API void sgrt_stripe_free(sgrt_stripe *result);

typedef struct sgrt_stripe_info {
  uint32_t struct_size;
  int32_t line_count;
  int64_t found_count;
  int64_t reason_count[16]; /* lines by SGRT_REASON_...: OUT_OF_VIEW its flanks leave the image, NO_TEXTURE no stripe, SATURATED,
                               NO_MATCH no centre, AMBIGUOUS, EDGE the two half widths differ */
  double noise;             /* grey levels, one sigma of a pixel */
  double fit_scale;         /* residuals of the Gaussian fits over the noise, at least 1; it is in the sigmas */
  double median_sigma_px;
} sgrt_stripe_info;
SGRT_API sgrt_status sgrt_stripe_summary(const sgrt_stripe *result, sgrt_stripe_info *info);

enum {
  SGRT_STRIPE_CENTRE = 1,    /* f64, N: px along the line; NaN where absent */
  SGRT_STRIPE_SIGMA = 2,     /* f32, N: px, one sigma of the centre */
  SGRT_STRIPE_SIGNAL = 3,    /* f32, N: grey levels of the peak over its background */
  SGRT_STRIPE_WIDTH = 4,     /* f32, N: px, sigma of the profile along the line */
  SGRT_STRIPE_ASYMMETRY = 5, /* f32, N: of the profile's foot about its top, (right - left) / (right + left) */
  SGRT_STRIPE_REASON = 6     /* u8, N: SGRT_REASON_... */
};
SGRT_API sgrt_status sgrt_stripe_array(const sgrt_stripe *result, int32_t field, sgrt_view *view);

/* --------------------------------------------------------------------------------------------------------- laser */

/* Surface of a body from the sweep of a laser fan by a motor mirror (docs/theory/laser.md). */
typedef struct sgrt_laser sgrt_laser;

/* The light plane of a laser unit at a mirror reading: plane[0..2] . x = plane[3], room, mm, the first three of unit length.
 * SGRT_E_INVALID_ARGUMENT  unknown laser_id. SGRT_E_FORMAT  its entry in the rig is malformed. since 0.1 */
SGRT_API sgrt_status sgrt_laser_plane(const sgrt_rig *rig, const char *laser_id, double angle_rad, double plane[4]);

typedef struct sgrt_laser_options {
  uint32_t struct_size;
  int32_t reserved;
  double angle_sigma_rad;  /* one sigma of a mirror reading, 0 to 1; default 0 */
  double volume_min_mm[3]; /* working volume, room axes; default -infinity ... */
  double volume_max_mm[3]; /* ... +infinity */
  double reference_time_s; /* with a pose track: the instant that the surface shows; default NaN: that of the first frame */
} sgrt_laser_options;
SGRT_API sgrt_status sgrt_laser_options_init(sgrt_laser_options *options, size_t size);

/* A whole sweep: images: F x H x W, u8, u16 or f32, of the size that the rig states for the laser's camera; dark: H x W of the same type, may
 * be NULL. angle_rad: F mirror readings, in any order, none twice. time_s: F, not decreasing; may be NULL (all 0).
 * track_time_s, room_from_body: N and N x 4 x 4, a body's poses over the time of the frames: each column is moved to where the body was
 * at reference_time_s (eq. 15); both NULL: it lay still. stripe and options may be NULL.
 * The surface is organised: a row a line of the image, a column a reading, increasing; with normals, covariance (pixel and reading) and,
 * where the rig states its uncertainty, shared error modes (lens, pose, fan, mirror).
 * *result is written for SGRT_OK and for 10-19; free with sgrt_laser_free.
 * SGRT_E_INVALID_ARGUMENT   unknown laser, image size or dtype, a reading that stands twice, a time that runs backwards or that the track
 *                           does not cover
 * SGRT_E_INSUFFICIENT_DATA  no frame
 * SGRT_E_NOT_FOUND          no stripe in any frame, or no point in the working volume
 * SGRT_E_DEGENERATE         the light plane is parallel to the rays of the stripe or behind the camera
 * SGRT_E_FORMAT             the laser's entry in the rig is malformed
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_laser_sweep(sgrt_context *context, const sgrt_rig *rig, const char *laser_id, const sgrt_view *images,
                                      const sgrt_view *dark, const sgrt_view *angle_rad, const sgrt_view *time_s,
                                      const sgrt_view *track_time_s, const sgrt_view *room_from_body,
                                      const sgrt_stripe_options *stripe, const sgrt_laser_options *options,
                                      sgrt_laser **result);
SGRT_API void sgrt_laser_free(sgrt_laser *result);

typedef struct sgrt_laser_info {
  uint32_t struct_size;
  int32_t width, height;    /* of the grid: readings, lines */
  int32_t columns;          /* 1: a line is a column of the image, 0: a row */
  int64_t point_count;
  int64_t reason_count[16]; /* grid points by SGRT_REASON_... as in sgrt_stripe_info; NO_MATCH also: the ray does not meet the plane */
  double median_sigma_px;   /* predicted one sigma of a stripe's centre */
  double median_sigma_mm;   /* ... of a point along its normal, by noise alone */
  double reference_time_s;
} sgrt_laser_info;
SGRT_API sgrt_status sgrt_laser_summary(const sgrt_laser *result, sgrt_laser_info *info);

enum {
  SGRT_LASER_REASON = 1,    /* u8, H x W, SGRT_REASON_... */
  SGRT_LASER_STRIPE_PX = 2, /* f64, H x W: the stripe's centre along the line */
  SGRT_LASER_SIGMA_PX = 3,  /* f32, H x W */
  SGRT_LASER_ANGLE = 4,     /* f64, W: reading of each column, rad */
  SGRT_LASER_TIME = 5       /* f64, W: s */
};
SGRT_API sgrt_status sgrt_laser_array(const sgrt_laser *result, int32_t field, sgrt_view *view);
/* A new surface handle on the grid; shares memory, free both. SGRT_E_NOT_FOUND  the result has no point. since 0.1 */
SGRT_API sgrt_status sgrt_laser_surface(const sgrt_laser *result, sgrt_surface **surface);

/* Session: the frames of a sweep one by one, as they come. One thread at a time. */
typedef struct sgrt_laser_session sgrt_laser_session;
/* Of one laser of the rig. stripe and options may be NULL. Errors as sgrt_laser_sweep, but for those of images. since 0.1 */
SGRT_API sgrt_status sgrt_laser_session_create(sgrt_context *context, const sgrt_rig *rig, const char *laser_id,
                                               const sgrt_stripe_options *stripe, const sgrt_laser_options *options,
                                               sgrt_laser_session **session);
typedef struct sgrt_laser_column {
  uint32_t struct_size;
  int32_t reserved;
  int64_t stripe_count; /* lines with a stripe */
  int64_t point_count;  /* ... that became a point */
} sgrt_laser_column;
/* column may be NULL. A frame without a stripe is no error. Errors as sgrt_laser_sweep; the session can go on without the frame. since 0.1 */
SGRT_API sgrt_status sgrt_laser_session_push(sgrt_context *context, sgrt_laser_session *session, const sgrt_view *image,
                                             const sgrt_view *dark, double angle_rad, double time_s, sgrt_laser_column *column);
/* The surface of what was pushed so far; the session can go on. Errors and *result as sgrt_laser_sweep. since 0.1 */
SGRT_API sgrt_status sgrt_laser_session_finish(sgrt_context *context, const sgrt_laser_session *session,
                                               const sgrt_view *track_time_s, const sgrt_view *room_from_body, sgrt_laser **result);
SGRT_API void sgrt_laser_session_free(sgrt_laser_session *session);

/* Breathing from one stripe: where the line through point_mm along `axis` (the beam's, unit length, outward positive) meets the skin,
 * *signal_mm from point_mm along the axis, from the stripe's points within radius_mm of the line (eq. 17). sigma_mm may be NULL.
 * SGRT_E_NOT_FOUND  no stripe, or it does not pass there on both sides of the line; *signal_mm is NaN
 * SGRT_E_DEGENERATE the axis is at right angles to the light plane; else as sgrt_laser_sweep. since 0.1 */
SGRT_API sgrt_status sgrt_laser_signal(sgrt_context *context, const sgrt_rig *rig, const char *laser_id, const sgrt_view *image,
                                       const sgrt_view *dark, double angle_rad, const sgrt_stripe_options *stripe,
                                       const double point_mm[3], const double axis[3], double radius_mm, double *signal_mm,
                                       double *sigma_mm);
/* ----------------------------------------------------------------------------------------------------------- tof */

/* What a time-of-flight camera measured: a frame of H x W pixels. */
typedef struct sgrt_tof sgrt_tof;

typedef struct sgrt_tof_options {
  uint32_t struct_size;
  int32_t chapter_c;        /* 1: eq. 10.2 as the chapter prints it, c = 3e8 m/s and no air; default 0 */
  double range_min_mm;      /* the window of ranges along the ray; default 0 */
  double range_max_mm;      /* NaN, the default: range_min_mm and one unambiguous range, at most 1e5 */
  double saturation;        /* taps at or above it are clipped, counts; NaN, the default: the end of the integer type */
  double min_amplitude;     /* counts; default 0 */
  double max_phase_sigma_rad; /* beyond it a phase is noise; default 0.5 */
  double max_sigma_mm;      /* one sigma along the ray; default +infinity */
  double moved_tolerance;   /* of the amplitude: how far the taps of a still scene may disagree beside noise; default 0.004 */
  double max_incidence_deg; /* pixels that jump steeper than skin of this incidence to both sides fly; default 75 */
  double min_unwrap_score;  /* several frequencies: log-likelihood of a range over the next best; default 2 */
  double unwrap_tolerance_mm; /* ... and one sigma of what they disagree by beside noise; default 30 */
  int32_t normal_window_px; /* side of the window of a normal, odd, 3 to 31; default 7 */
  int32_t reserved;
  sgrt_view pixel_offset_mm; /* H x W, subtracted from the range (pixel_offset_mm of the rig); absent: none */
} sgrt_tof_options;
SGRT_API sgrt_status sgrt_tof_options_init(sgrt_tof_options *options, size_t size);

/* What is wrong with a pixel, bits. One with any of them but SGRT_TOF_UNCALIBRATED has no point; its phase, amplitude, offset, range and
 * sigma are given nevertheless. */
enum {
  SGRT_TOF_SATURATED = 1,     /* a tap is clipped, or not a number */
  SGRT_TOF_LOW_AMPLITUDE = 2, /* too little light for a phase: max_phase_sigma_rad, max_sigma_mm, min_amplitude */
  SGRT_TOF_MOVED = 4,         /* the taps contradict each other: the scene moved between them (needs 4 taps) */
  SGRT_TOF_FLYING = 8,        /* between two surfaces: it sees both */
  SGRT_TOF_WRAPPED = 16,      /* the number of turns is in doubt: two ranges of the window explain the phases, or none does */
  SGRT_TOF_OUT_OF_RANGE = 32, /* outside the window */
  SGRT_TOF_UNCALIBRATED = 64  /* outside the knots of the range correction, whose end value was taken */
};

/* Taps to range and points (docs/theory/tof.md): phase, amplitude and offset by least squares over any number >= 3 of taps, range along the
 * ray by eq. 10.2, several frequencies unwrapped jointly, sigma by the shot noise, the rig's corrections subtracted.
 * tof_id: of the rig. taps: frames x frequencies x taps x H x W, or without the frames; u16, i16 or f32, counts, of the camera's size. Several
 * frames are averaged, each pixel backwards from the last frame as far as nothing moved. options may be NULL.
 * *result is written for SGRT_OK and for SGRT_E_NOT_FOUND; free with sgrt_tof_free.
 * SGRT_E_INVALID_ARGUMENT  unknown unit, taps of another shape or dtype, an option out of its range
 * SGRT_E_NOT_FOUND         no pixel has a range; the flags tell why
 * SGRT_E_LIMIT             more than 1000 frames
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_tof_measure(sgrt_context *context, const sgrt_rig *rig, const char *tof_id,
                                      const sgrt_view *taps, const sgrt_tof_options *options, sgrt_tof **result);
SGRT_API void sgrt_tof_free(sgrt_tof *result);

typedef struct sgrt_tof_info {
  uint32_t struct_size;
  int32_t width, height, frequency_count;
  int64_t point_count;
  int64_t flag_count[8]; /* pixels by bit, SGRT_TOF_SATURATED first */
  double range_min_mm, range_max_mm; /* the window that held */
  double ambiguity_mm;     /* ranges this far apart have the same phases */
  double median_sigma_mm;  /* along the ray, of the points; NaN where the noise is not known (differential taps) */
} sgrt_tof_info;
SGRT_API sgrt_status sgrt_tof_summary(const sgrt_tof *result, sgrt_tof_info *info);

enum {
  SGRT_TOF_PHASE = 1,     /* f32, frequencies x H x W, rad in [0, 2 pi) */
  SGRT_TOF_AMPLITUDE = 2, /* f32, frequencies x H x W, counts */
  SGRT_TOF_OFFSET = 3,    /* f32, frequencies x H x W, counts */
  SGRT_TOF_RANGE = 4,     /* f32, H x W, mm along the ray, corrected; given for flagged pixels too, NaN where there is none */
  SGRT_TOF_SIGMA = 5,     /* f32, H x W, one sigma of the range, mm; NaN where the noise is not known */
  SGRT_TOF_FLAGS = 6,     /* u8, H x W, SGRT_TOF_SATURATED ... */
  SGRT_TOF_SCORE = 7,     /* f32, H x W, of the unwrapping (min_unwrap_score); absent for one frequency */
  SGRT_TOF_POINTS = 8,    /* f32, H x W x 3, room, mm; NaN where absent. Planes in memory: mind the strides */
  SGRT_TOF_FRAMES = 9     /* f32, H x W, frames averaged; absent for one frame */
};
/* Lends an array; it lives as long as the result. An absent array has data NULL. since 0.1 */
SGRT_API sgrt_status sgrt_tof_array(const sgrt_tof *result, int32_t field, sgrt_view *view);
/* A new surface: the organised grid of the points with normals, sigma_mm and covariance (along the rays); the last two are absent where the
 * noise is not known. Its work is done here. SGRT_E_NOT_FOUND  the result has no point. SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_tof_surface(sgrt_context *context, const sgrt_tof *result, sgrt_surface **surface);

/* Session: the same unit again and again (live mode). Owns its rays and buffers: the steady state allocates nothing. One thread at a time. */
typedef struct sgrt_tof_session sgrt_tof_session;
/* Of one unit of the rig. options may be NULL. Errors as sgrt_tof_measure, but for those of taps. since 0.1 */
SGRT_API sgrt_status sgrt_tof_session_create(sgrt_context *context, const sgrt_rig *rig, const char *tof_id,
                                             const sgrt_tof_options *options, sgrt_tof_session **session);
/* taps, errors: as sgrt_tof_measure. time_s: finite, must not decrease. *result is lent until the next push or the session's end: do not free
 * it; after an error other than SGRT_E_NOT_FOUND it is NULL, and the session can go on. since 0.1 */
SGRT_API sgrt_status sgrt_tof_session_push(sgrt_context *context, sgrt_tof_session *session, const sgrt_view *taps,
                                           double time_s, const sgrt_tof **result);
/* A handle of its own on what a push lent: it shares the memory and outlives the next push, which then takes other memory. Free it with
 * sgrt_tof_free; once no handle holds it the session uses it again. since 0.1 */
SGRT_API sgrt_status sgrt_tof_keep(const sgrt_tof *lent, sgrt_tof **result);
SGRT_API void sgrt_tof_session_free(sgrt_tof_session *session);

/* --------------------------------------------------------------------------------------------------- nurbs_curve */

/* A non-uniform rational B-spline curve (eq. 10.4 to 10.10; docs/theory/nurbs.md). Immutable; tools give a new one. */
typedef struct sgrt_nurbs_curve sgrt_nurbs_curve;

typedef struct sgrt_nurbs_curve_data {
  uint32_t struct_size;
  int32_t degree;           /* 1 to 24; default 3 */
  sgrt_view knots;          /* N + degree + 1, not decreasing; absent: uniform, clamped, on [0, 1] */
  sgrt_view control_points; /* N x 3, mm */
  sgrt_view weights;        /* N, above 0 (1e-9 to 1e9); absent: all 1 */
} sgrt_nurbs_curve_data;
/* Empties *data and sets its struct_size and defaults. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_data_init(sgrt_nurbs_curve_data *data, size_t size);

/* SGRT_E_INVALID_ARGUMENT  knots that decrease or are too few or too many (the message says how many), an inner knot more
 *                          often than the degree, an end knot more often than degree + 1, an empty domain; fewer than
 *                          degree + 1 control points, one that is not finite or beyond 1e5 mm; a weight out of range
 * SGRT_E_LIMIT             a degree above 24, more than a million knots. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_create(const sgrt_nurbs_curve_data *data, sgrt_nurbs_curve **curve);
/* nurbs.json, schema sgrt-nurbs/1; it need not end with NUL. SGRT_E_FORMAT  the message names the field.
 * SGRT_E_LIMIT  above 16 MiB. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_from_json(const char *text, size_t size, sgrt_nurbs_curve **curve);
/* centre + cos(t) x + sin(t) y, t from begin_rad to end_rad, at most one turn; domain [0, 1]. Exact: a circle where x and
 * y are perpendicular and equally long, else an ellipse (A7.1). since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_arc(const double centre_mm[3], const double x_mm[3], const double y_mm[3],
                                          double begin_rad, double end_rad, sgrt_nurbs_curve **curve);

/* The parameter of a data point: equal steps, by chord length, by its square root. */
enum { SGRT_PARAMETERS_UNIFORM = 0, SGRT_PARAMETERS_CHORD = 1, SGRT_PARAMETERS_CENTRIPETAL = 2 };
/* The curve of `count` control points through N x 3 points (count = N or 0: A9.1), or the least-squares one that keeps
 * the first and the last (A9.6). Domain [0, 1].
 * SGRT_E_INSUFFICIENT_DATA  fewer than degree + 1 points
 * SGRT_E_DEGENERATE         points that coincide, so that there is no such curve. *curve is not written. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_interpolate(const sgrt_view *points_mm, int32_t degree, int32_t count,
                                                  int32_t parameters, sgrt_nurbs_curve **curve);
SGRT_API void sgrt_nurbs_curve_free(sgrt_nurbs_curve *curve);

typedef struct sgrt_nurbs_curve_info {
  uint32_t struct_size;
  int32_t degree;
  int32_t count;    /* of control points */
  int32_t rational; /* 0: all weights alike */
  double domain[2];
} sgrt_nurbs_curve_info;
SGRT_API sgrt_status sgrt_nurbs_curve_summary(const sgrt_nurbs_curve *curve, sgrt_nurbs_curve_info *info);

enum {
  SGRT_NURBS_KNOTS_U = 1,        /* f64 */
  SGRT_NURBS_KNOTS_V = 2,        /* f64, of a surface */
  SGRT_NURBS_CONTROL_POINTS = 3, /* f64, N x 3; NU x NV x 3 of a surface; mm */
  SGRT_NURBS_WEIGHTS = 4         /* f64, N; NU x NV of a surface; absent: all 1 */
};
SGRT_API sgrt_status sgrt_nurbs_curve_array(const sgrt_nurbs_curve *curve, int32_t field, sgrt_view *view);

enum { SGRT_NURBS_JSON = 1 }; /* the file's text; reads back bit for bit */
/* NULL for an unknown field. The text lives as long as the curve. since 0.1 */
SGRT_API const char *sgrt_nurbs_curve_text(const sgrt_nurbs_curve *curve, int32_t field);

/* A parameter outside the domain: an error, or the nearest end of the domain. */
enum { SGRT_OUTSIDE_REFUSE = 0, SGRT_OUTSIDE_CLAMP = 1 };
/* Points and derivatives (A4.2). u: N. derivatives: f64, N x (order + 1) x 3: C, C', C'' ...; order 0 to 24. At a knot
 * the derivatives from the right; the domain's end belongs to its last span. Uses the context's threads, does not poll.
 * SGRT_E_INVALID_ARGUMENT  NaN, u outside the domain unless clamped, order, outside. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_evaluate(sgrt_context *context, const sgrt_nurbs_curve *curve, const sgrt_view *u,
                                               int32_t order, int32_t outside, const sgrt_mut_view *derivatives);
/* The closest point of the curve to each of N x 3 points, over the whole curve (branch and bound, not only Newton). u,
 * distance_mm, gap_mm: f64, N, any may be NULL. gap_mm: no point of the curve is nearer by more than this.
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_closest(sgrt_context *context, const sgrt_nurbs_curve *curve,
                                              const sgrt_view *points_mm, const sgrt_mut_view *u,
                                              const sgrt_mut_view *distance_mm, const sgrt_mut_view *gap_mm);
/* Arc length from begin to end, to about 1e-13 of the curve's size; negative where end < begin. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_length(const sgrt_nurbs_curve *curve, double begin, double end, double *length_mm);

/* Tools: the same shape in another form, to 1e-12 of its size. */
/* Adds knots (A5.4), each at most to multiplicity degree. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_refine(const sgrt_nurbs_curve *curve, const sgrt_view *knots,
                                             sgrt_nurbs_curve **result);
/* Every inner knot to multiplicity degree, clamped (A5.6): control points i p to (i + 1) p are piece i. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_bezier(const sgrt_nurbs_curve *curve, sgrt_nurbs_curve **result);
/* The part over [begin, end], clamped; twice it splits a curve. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_restrict(const sgrt_nurbs_curve *curve, double begin, double end,
                                               sgrt_nurbs_curve **result);
/* The degree raised by `times`; clamped (A5.9). since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_elevate(const sgrt_nurbs_curve *curve, int32_t times, sgrt_nurbs_curve **result);
/* Removes the inner knot u, `times` times or as often as the curve moves by no more than tolerance_mm (A5.8). *count: how
 * often; *bound_mm: the curve moved by no more than this anywhere; either may be NULL. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_remove_knot(const sgrt_nurbs_curve *curve, double u, int32_t times,
                                                  double tolerance_mm, sgrt_nurbs_curve **result, int32_t *count,
                                                  double *bound_mm);
/* Lowers the degree by one where the curve moves by no more than tolerance_mm (A5.11); else *count is 0. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_reduce_degree(const sgrt_nurbs_curve *curve, double tolerance_mm,
                                                    sgrt_nurbs_curve **result, int32_t *count, double *bound_mm);
/* The same shape over [begin, end]; begin > end runs it backwards. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_curve_reparameterise(const sgrt_nurbs_curve *curve, double begin, double end,
                                                     sgrt_nurbs_curve **result);

/* ------------------------------------------------------------------------------------------------- nurbs_surface */

/* A non-uniform rational B-spline surface (eq. 10.4). Direction 0 is u, 1 is v. Immutable; tools give a new one. */
typedef struct sgrt_nurbs_surface sgrt_nurbs_surface;

typedef struct sgrt_nurbs_surface_data {
  uint32_t struct_size;
  int32_t degree_u, degree_v; /* 1 to 24; default 3 */
  int32_t reserved;
  sgrt_view knots_u, knots_v; /* NU + degree_u + 1, NV + degree_v + 1; absent: uniform, clamped, on [0, 1] */
  sgrt_view control_points;   /* NU x NV x 3, mm */
  sgrt_view weights;          /* NU x NV, above 0; absent: all 1 */
} sgrt_nurbs_surface_data;
SGRT_API sgrt_status sgrt_nurbs_surface_data_init(sgrt_nurbs_surface_data *data, size_t size);

/* Errors as sgrt_nurbs_curve_create. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_create(const sgrt_nurbs_surface_data *data, sgrt_nurbs_surface **surface);
/* As sgrt_nurbs_curve_from_json. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_from_json(const char *text, size_t size, sgrt_nurbs_surface **surface);
/* The chapter's eight steps: the points of an organised surface without holes become the control points, knots by eq. 10.9
 * and 10.10. It approximates: at degree 3 a cap of radius R sampled at pitch h is flattened by h^2 / (3 R). u runs along
 * a row of the grid, v across the rows, turned so that normals stay outward where the surface carries some. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_chapter(const sgrt_surface *surface, int32_t degree_u, int32_t degree_v,
                                                sgrt_nurbs_surface **result);
/* Through NU x NV x 3 points (count 0 or as many as points: A9.4), or the least-squares surface of fewer control points
 * (A9.7), in each direction. Errors as sgrt_nurbs_curve_interpolate. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_interpolate(const sgrt_view *points_mm, const int32_t degree[2],
                                                    const int32_t count[2], int32_t parameters,
                                                    sgrt_nurbs_surface **surface);
/* The curve turned about an axis by at most one turn (A8.1): u in [0, 1] turns counter-clockwise, v runs along the
 * curve. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_revolve(const sgrt_nurbs_curve *curve, const double axis_point_mm[3],
                                                const double axis_direction[3], double angle_rad,
                                                sgrt_nurbs_surface **surface);
/* Exact quadrics with outward normals; the cylinder from base to base + axis, without caps. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_sphere(const double centre_mm[3], double radius_mm,
                                               sgrt_nurbs_surface **surface);
SGRT_API sgrt_status sgrt_nurbs_surface_cylinder(const double base_mm[3], const double axis_mm[3], double radius_mm,
                                                 sgrt_nurbs_surface **surface);
SGRT_API sgrt_status sgrt_nurbs_surface_torus(const double centre_mm[3], const double axis[3], double radius_mm,
                                              double tube_radius_mm, sgrt_nurbs_surface **surface);
SGRT_API void sgrt_nurbs_surface_free(sgrt_nurbs_surface *surface);

typedef struct sgrt_nurbs_surface_info {
  uint32_t struct_size;
  int32_t rational; /* 0: all weights alike */
  int32_t degree[2];
  int32_t count[2]; /* NU, NV */
  double domain_u[2], domain_v[2];
} sgrt_nurbs_surface_info;
SGRT_API sgrt_status sgrt_nurbs_surface_summary(const sgrt_nurbs_surface *surface, sgrt_nurbs_surface_info *info);
SGRT_API sgrt_status sgrt_nurbs_surface_array(const sgrt_nurbs_surface *surface, int32_t field, sgrt_view *view);
SGRT_API const char *sgrt_nurbs_surface_text(const sgrt_nurbs_surface *surface, int32_t field);

/* Points and partial derivatives (A4.4) at N x 2 pairs (u, v). derivatives: f64, N x K x 3 with K = (order + 1)
 * (order + 2) / 2: S, S_u, S_v, S_uu, S_uv, S_vv, S_uuu ...; order 0 to 24. Otherwise as sgrt_nurbs_curve_evaluate.
 * since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_evaluate(sgrt_context *context, const sgrt_nurbs_surface *surface,
                                                 const sgrt_view *uv, int32_t order, int32_t outside,
                                                 const sgrt_mut_view *derivatives);
/* The same on the grid of u (NU) and v (NV): derivatives NU x NV x K x 3. Fastest with v sorted; the same bits as
 * point by point. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_grid(sgrt_context *context, const sgrt_nurbs_surface *surface, const sgrt_view *u,
                                             const sgrt_view *v, int32_t order, int32_t outside,
                                             const sgrt_mut_view *derivatives);
/* Unit normals S_u x S_v, f64, N x 3; at a pole or a degenerate edge their limit from inside, NaN where there is none.
 * since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_normals(sgrt_context *context, const sgrt_nurbs_surface *surface,
                                                const sgrt_view *uv, int32_t outside, const sgrt_mut_view *normals);
/* As sgrt_nurbs_curve_closest; uv: N x 2. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_closest(sgrt_context *context, const sgrt_nurbs_surface *surface,
                                                const sgrt_view *points_mm, const sgrt_mut_view *uv,
                                                const sgrt_mut_view *distance_mm, const sgrt_mut_view *gap_mm);
/* A mesh of triangles, with exact normals, that lies within chord_error_mm of the surface (a bound, not an estimate).
 * SGRT_E_LIMIT  it would take more than 50 million points
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_surface_mesh(sgrt_context *context, const sgrt_nurbs_surface *surface,
                                             double chord_error_mm, sgrt_surface **mesh);

/* Tools along one direction, as those of the curve. */
SGRT_API sgrt_status sgrt_nurbs_surface_refine(const sgrt_nurbs_surface *surface, int32_t direction,
                                               const sgrt_view *knots, sgrt_nurbs_surface **result);
SGRT_API sgrt_status sgrt_nurbs_surface_bezier(const sgrt_nurbs_surface *surface, int32_t direction,
                                               sgrt_nurbs_surface **result);
SGRT_API sgrt_status sgrt_nurbs_surface_restrict(const sgrt_nurbs_surface *surface, int32_t direction, double begin,
                                                 double end, sgrt_nurbs_surface **result);
SGRT_API sgrt_status sgrt_nurbs_surface_elevate(const sgrt_nurbs_surface *surface, int32_t direction, int32_t times,
                                                sgrt_nurbs_surface **result);
SGRT_API sgrt_status sgrt_nurbs_surface_remove_knot(const sgrt_nurbs_surface *surface, int32_t direction, double u,
                                                    int32_t times, double tolerance_mm, sgrt_nurbs_surface **result,
                                                    int32_t *count, double *bound_mm);
SGRT_API sgrt_status sgrt_nurbs_surface_reduce_degree(const sgrt_nurbs_surface *surface, int32_t direction,
                                                      double tolerance_mm, sgrt_nurbs_surface **result, int32_t *count,
                                                      double *bound_mm);
SGRT_API sgrt_status sgrt_nurbs_surface_reparameterise(const sgrt_nurbs_surface *surface, int32_t direction,
                                                       double begin, double end, sgrt_nurbs_surface **result);
/* ----------------------------------------------------------------------------------------------------- nurbs_fit */

/* A smooth surface through scattered points with noise, holes and outliers, and how sure it is: cubic tensor-product
 * B-splines by penalised robust least squares (docs/theory/nurbs_fit.md). Immutable. */
typedef struct sgrt_nurbs_fit sgrt_nurbs_fit;

/* What the parameters u and v run over. */
enum {
  SGRT_NURBS_CHART_AUTO = 0,     /* a plane where the body is a height field, else the less steep of the next two */
  SGRT_NURBS_CHART_PLANE = 1,    /* a height field over the best plane, or along axis */
  SGRT_NURBS_CHART_CYLINDER = 2, /* angle x height about an axis: a torso, a limb; closed where the points go all round */
  SGRT_NURBS_CHART_SPHERE = 3,   /* directions from inside, without a pole among the points: a head */
  SGRT_NURBS_CHART_GRID = 4      /* the column and row of an organised surface */
};
enum {
  SGRT_NURBS_SMOOTHING_REML = 0, /* restricted maximum likelihood */
  SGRT_NURBS_SMOOTHING_GCV = 1,  /* generalised cross-validation */
  SGRT_NURBS_SMOOTHING_GIVEN = 2 /* lambda */
};

typedef struct sgrt_nurbs_fit_options {
  uint32_t struct_size;
  int32_t chart;              /* SGRT_NURBS_CHART_...; default AUTO */
  int32_t smoothing;          /* SGRT_NURBS_SMOOTHING_...; default REML */
  int32_t robust;             /* 0: least squares; 1: outliers do not count. Default 1 */
  int32_t control_points[2];  /* in u and v, 4 to 2000 (round a closed body 8); 0: from the density. Default 0, 0 */
  int32_t max_control_points; /* in all, where they are chosen, 16 to 100,000; default 10,000 */
  int32_t reserved;
  double axis[3];             /* of the height field (outward) or the cylinder; 0 0 0: estimated. Default 0 0 0 */
  double lambda;              /* of SMOOTHING_GIVEN: weight of the bending energy against sum (r / sigma)^2, >= 0; default 1 */
  double tukey;               /* residuals beyond so many sigma do not count, 2 to 100; default 4.685 */
} sgrt_nurbs_fit_options;
SGRT_API sgrt_status sgrt_nurbs_fit_options_init(sgrt_nurbs_fit_options *options, size_t size);

/* Fits the surface that minimises sum w (r / sigma)^2 + lambda * integral(f_uu^2 + 2 f_uv^2 + f_vv^2) over its chart
 * (docs/theory/nurbs_fit.md eq. 6). A plane comes back exactly whatever lambda is.
 *
 * surface: at least 16 points, mm. sigma_mm or covariance weigh the points; without them sigma is estimated. Normals, where
 * there are any, say what is outward; else +z. options may be NULL. *fit is written for SGRT_OK only; free with
 * sgrt_nurbs_fit_free. Uses the context's threads; the result does not depend on their number.
 *
 * SGRT_E_INVALID_ARGUMENT   an option out of range, SGRT_NURBS_CHART_GRID for a surface that is not organised
 * SGRT_E_INSUFFICIENT_DATA  fewer than 16 points, or points over correlation_points fewer than 4
 * SGRT_E_DEGENERATE         all points on a line or in one place; too flat or too closed for the chart asked for;
 *                           lambda = 0 where control points have no data; robust, and as many control points as points;
 *                           a sigma less than a millionth of the usual one
 * SGRT_E_LIMIT              control points whose band matrix exceeds 1 GiB
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_create(sgrt_context *context, const sgrt_surface *surface,
                                           const sgrt_nurbs_fit_options *options, sgrt_nurbs_fit **fit);
SGRT_API void sgrt_nurbs_fit_free(sgrt_nurbs_fit *fit);

typedef struct sgrt_nurbs_fit_info {
  uint32_t struct_size;
  int32_t chart;             /* SGRT_NURBS_CHART_... that was used */
  int32_t control_points[2]; /* of the surface, in u and v */
  int32_t closed;            /* 1: the surface goes all round in u */
  int32_t iterations;        /* solutions with new weights */
  int64_t point_count;       /* present points of the surface */
  int64_t inlier_count;      /* points with a weight above 0 */
  double lambda;
  double effective_parameters; /* trace of the smoother */
  double noise;              /* estimated sigma along the normal: in units of the points' own; mm where they have none */
  double rms_mm;             /* of the inliers' distances along the normal */
  double conversion_error_mm; /* the surface is a spline, a chart on a cylinder or sphere is not: largest difference found */
} sgrt_nurbs_fit_info;
SGRT_API sgrt_status sgrt_nurbs_fit_summary(const sgrt_nurbs_fit *fit, sgrt_nurbs_fit_info *info);

enum {
  SGRT_NURBS_FIT_RESIDUAL = 1,       /* f64, N or H x W as the surface: mm along the normal, positive outside; NaN where absent */
  SGRT_NURBS_FIT_WEIGHT = 2,         /* f64, like it: robust weight, 0 (outlier) to 1 */
  SGRT_NURBS_FIT_PARAMETERS = 3      /* f64, N x 2 or H x W x 2: u, v of each point */
};
/* Lends an array; it lives as long as the fit. SGRT_E_INVALID_ARGUMENT  NULL, unknown field. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_array(const sgrt_nurbs_fit *fit, int32_t field, sgrt_view *view);

/* The fitted surface as a new handle, clamped on [0, 1] x [0, 1]; free both. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_surface(const sgrt_nurbs_fit *fit, sgrt_nurbs_surface **surface);

/* The fit as numbers, to travel between processes, and back: the same fit to the last bit. count: how many they are;
 * numbers: f64, one dimension, or its data NULL to learn the count alone; both may be NULL, not both at once. What the
 * numbers mean may change between versions, which from_state tells apart.
 * SGRT_E_INVALID_ARGUMENT  another length; numbers that are no such state. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_state(const sgrt_nurbs_fit *fit, const sgrt_mut_view *numbers, int64_t *count);
SGRT_API sgrt_status sgrt_nurbs_fit_from_state(const sgrt_view *numbers, sgrt_nurbs_fit **fit);

/* What is wanted of N places; an array whose data is NULL is not. All f64. */
typedef struct sgrt_nurbs_fit_samples {
  uint32_t struct_size;
  int32_t reserved;
  sgrt_mut_view points;            /* N x 3, mm */
  sgrt_mut_view normals;           /* N x 3, unit, outward */
  sgrt_mut_view sigma_mm;          /* N: one sigma of the surface along its normal, bias by smoothing included */
  sgrt_mut_view support;           /* N: 1 with points all round, 0 with none near; below 0.5 it is extrapolated */
  sgrt_mut_view covariance;        /* N x 6: of the point, xx xy xz yy yz zz, mm2 */
  sgrt_mut_view normal_covariance; /* N x 6: of the normal (delta method) */
  sgrt_mut_view derivatives;       /* N x 5 x 3: S_u S_v S_uu S_uv S_vv, mm */
  sgrt_mut_view derivative_covariance; /* N x 5 x 6, mm2 */
} sgrt_nurbs_fit_samples;
/* Empties *samples and sets its struct_size. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_samples_init(sgrt_nurbs_fit_samples *samples, size_t size);

/* The surface and its posterior at parameters uv: N x 2, each in [0, 1].
 * SGRT_E_INVALID_ARGUMENT  a parameter outside or not finite; an output of another shape. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_evaluate(sgrt_context *context, const sgrt_nurbs_fit *fit, const sgrt_view *uv,
                                             const sgrt_nurbs_fit_samples *samples);
/* Parameters of the surface points nearest to points (N x 3, mm), from their feet in the chart downhill: meant for points
 * near the surface. uv: f64, N x 2. SGRT_E_INVALID_ARGUMENT  a point that is not finite. since 0.1 */
SGRT_API sgrt_status sgrt_nurbs_fit_nearest(sgrt_context *context, const sgrt_nurbs_fit *fit, const sgrt_view *points,
                                            const sgrt_mut_view *uv);

/* ----------------------------------------------------------------------------------------------------- curvature */

/* Curvature, 1/mm, in one convention: the normal points outward (towards the sensor) and convex is positive, so that a sphere of
 * radius R has k1 = k2 = H = 1/R and the tip of a nose H > 0. k1 >= k2 are the principal curvatures, H = (k1 + k2)/2 and
 * K = k1 k2, the shape index S = 2/pi atan2(k1 + k2, k1 - k2) (+1 a cap, 0 a saddle, -1 a cup, NaN on a plane), the curvedness
 * sqrt((k1^2 + k2^2)/2) (docs/theory/curvature.md). What is not known is NaN, with a reason. */

/* The signs of H and K (fig. 10.7); zero is what does not exceed two sigma. */
enum {
  SGRT_HK_UNKNOWN = 0,
  SGRT_HK_FLAT = 1,
  SGRT_HK_PEAK = 2,          /* H > 0, K > 0: a convex cap */
  SGRT_HK_PIT = 3,           /* H < 0, K > 0: a concave cup */
  SGRT_HK_RIDGE = 4,         /* H > 0, K = 0 */
  SGRT_HK_VALLEY = 5,        /* H < 0, K = 0 */
  SGRT_HK_SADDLE_RIDGE = 6,  /* H > 0, K < 0 */
  SGRT_HK_SADDLE_VALLEY = 7, /* H < 0, K < 0 */
  SGRT_HK_MINIMAL = 8        /* H = 0, K < 0 */
};

/* Curvature of a curve at parameters (eq. 10.11): |c' x c''| / |c'|^3, whatever the parameter, and torsion. u: N. outside:
 * SGRT_OUTSIDE_... plane_normal: NULL, or 3 numbers: the curvature is then signed, positive where the curve turns left as seen
 * from the tip of the normal. curvature, torsion: f64, N, either may be NULL. Torsion is NaN where the curve is straight.
 * SGRT_E_INVALID_ARGUMENT  a parameter outside the domain; a normal without length. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_nurbs_curve(const sgrt_nurbs_curve *curve, const sgrt_view *u, int32_t outside,
                                                const double plane_normal[3], const sgrt_mut_view *curvature,
                                                const sgrt_mut_view *torsion);

/* The same of points sampled along a curve: N x 3, mm. closed: 1 where the last is followed by the first. A polynomial of `degree`
 * (3 to 6) of the chord length is fitted to each point and `half_window` neighbours on each side. sigma_mm: of each coordinate,
 * or 0; sigma_curvature tells what it does. Each output: f64, N, or NULL; NaN where points are absent (NaN), coincide or are too few.
 * SGRT_E_INVALID_ARGUMENT   degree, half_window (fewer samples than unknowns), sigma_mm out of range
 * SGRT_E_INSUFFICIENT_DATA  fewer than degree + 1 points. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_points(const sgrt_view *points_mm, int32_t closed, int32_t half_window, int32_t degree,
                                           double sigma_mm, const double plane_normal[3],
                                           const sgrt_mut_view *curvature, const sgrt_mut_view *torsion,
                                           const sgrt_mut_view *sigma_curvature);

/* What is wanted of N places; an array whose data is NULL is not. */
typedef struct sgrt_curvature_samples {
  uint32_t struct_size;
  int32_t reserved;
  sgrt_mut_view k1, k2, mean, gauss, shape_index, curvedness; /* f64, N */
  sgrt_mut_view normals, d1, d2; /* f64, N x 3: outward normal, directions of k1 and k2; n, d1, d2 right-handed */
  sgrt_mut_view hk;              /* u8, N: SGRT_HK_... */
} sgrt_curvature_samples;
/* Empties *samples and sets its struct_size. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_samples_init(sgrt_curvature_samples *samples, size_t size);
/* Exact curvature of a NURBS surface at parameters uv: N x 2; its normal is S_u x S_v (eq. 10.12-10.17). All NaN at a pole.
 * SGRT_E_INVALID_ARGUMENT  a parameter outside the domain; an output of another shape. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_nurbs_surface(sgrt_context *context, const sgrt_nurbs_surface *surface,
                                                  const sgrt_view *uv, int32_t outside,
                                                  const sgrt_curvature_samples *samples);

/* Curvature at every point of a surface, with its uncertainty. Immutable. */
typedef struct sgrt_curvature sgrt_curvature;

typedef struct sgrt_curvature_options {
  uint32_t struct_size;
  int32_t degree;          /* of the fit to a point's neighbours, 2 to 4. Default 2 (normal sections are circles); 3 and 4 are jets */
  double radius_mm;        /* of the neighbourhood; 0, the default: chosen at each place, where the predicted error is least */
  double max_radius_mm;    /* of a chosen one; default 25 */
  double noise_mm;         /* one sigma along the normal; 0, the default: the surface's sigma or covariance, or measured */
  double max_sigma_per_mm; /* of H: above it nothing is said; default 0.1 */
} sgrt_curvature_options;
SGRT_API sgrt_status sgrt_curvature_options_init(sgrt_curvature_options *options, size_t size);

/* Fits the shape about every point: cloud, organised grid or mesh (docs/theory/curvature.md eq. 10-18). The surface must have
 * normals (outward is not guessed: see sgrt_surface_estimate_normals; a mesh has them). Points at one place count once.
 * options may be NULL. *result is written for SGRT_OK only; free with sgrt_curvature_free. Uses the context's threads; the result
 * does not depend on their number.
 * SGRT_E_INVALID_ARGUMENT   no normals; an option out of range
 * SGRT_E_INSUFFICIENT_DATA  not one point has curvature: the message says why
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_compute(sgrt_context *context, const sgrt_surface *surface,
                                            const sgrt_curvature_options *options, sgrt_curvature **result);
SGRT_API void sgrt_curvature_free(sgrt_curvature *result);

/* Why a point has no curvature. */
enum {
  SGRT_CURVATURE_KNOWN = 0,
  SGRT_CURVATURE_ABSENT = 1,      /* no point */
  SGRT_CURVATURE_NO_NORMAL = 2,   /* what is outward is not known there */
  SGRT_CURVATURE_TOO_FEW = 3,     /* fewer neighbours than unknowns, or on a line */
  SGRT_CURVATURE_BORDER = 4,      /* neighbours on one side only: a border or a hole; or the neighbourhood is larger than the surface */
  SGRT_CURVATURE_DISAGREE = 5,    /* neighbours' normals contradict the point's */
  SGRT_CURVATURE_NOT_A_SHEET = 6, /* the neighbours are no height over any plane */
  SGRT_CURVATURE_TOO_NOISY = 7    /* sigma of H above max_sigma_per_mm */
};
/* The word of a reason ("known", "border", ...); "unknown" for any other number. since 0.1 */
SGRT_API const char *sgrt_curvature_reason_word(int32_t reason);

typedef struct sgrt_curvature_info {
  uint32_t struct_size;
  int32_t reserved;
  int64_t point_count, known_count, duplicate_count;
  int64_t reason_count[8]; /* points by SGRT_CURVATURE_... */
  int64_t height, width;   /* of the grid; 0 for a cloud or mesh */
  double spacing_mm;       /* a point stands for the square of it */
  double noise_mm;         /* one sigma along the normal that was used, the median; NaN where it could not be measured */
} sgrt_curvature_info;
SGRT_API sgrt_status sgrt_curvature_summary(const sgrt_curvature *result, sgrt_curvature_info *info);

enum {
  SGRT_CURVATURE_K1 = 1, /* f64, N or H x W, as all that follow unless said */
  SGRT_CURVATURE_K2 = 2,
  SGRT_CURVATURE_MEAN = 3,
  SGRT_CURVATURE_GAUSS = 4,
  SGRT_CURVATURE_SHAPE_INDEX = 5,
  SGRT_CURVATURE_CURVEDNESS = 6,
  SGRT_CURVATURE_SIGMA_K1 = 7, /* one sigma: noise, and the bias expected of the scale */
  SGRT_CURVATURE_SIGMA_K2 = 8,
  SGRT_CURVATURE_SIGMA_MEAN = 9,
  SGRT_CURVATURE_SIGMA_GAUSS = 10,
  SGRT_CURVATURE_SIGMA_SHAPE_INDEX = 11,
  SGRT_CURVATURE_RADIUS = 12,  /* mm, of the neighbourhood */
  SGRT_CURVATURE_NORMALS = 13, /* N x 3 or H x W x 3: of the fitted surface */
  SGRT_CURVATURE_D1 = 14,      /* like them: direction of k1 */
  SGRT_CURVATURE_D2 = 15,
  SGRT_CURVATURE_HK = 16,      /* u8: SGRT_HK_... */
  SGRT_CURVATURE_REASON = 17   /* u8: SGRT_CURVATURE_KNOWN ... */
};
/* Lends an array; it lives as long as the result. SGRT_E_INVALID_ARGUMENT  NULL, unknown field. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_array(const sgrt_curvature *result, int32_t field, sgrt_view *view);

enum { SGRT_CREST_NONE = 0, SGRT_CREST_RIDGE = 1, SGRT_CREST_VALLEY = 2 };
/* What stands out of the curvature of a surface (docs/theory/landmarks.md eq. 1-3). surface: the one that curvature is of. sigmas:
 * how many of its own sigma a feature must stand out by, 0 to 100; 2 to 4 let noise make none. crest: u8, N or H x W: SGRT_CREST_...:
 * points where k1 is greatest (ridge) or k2 least (valley) along its own direction. persistence: f64, like it, 1/mm: at a maximum of H
 * above 0 how far H falls before a higher one is reached, at a minimum below 0 minus that, elsewhere NaN. Either may be NULL.
 * SGRT_E_INVALID_ARGUMENT  another surface's size, an output of another shape. since 0.1 */
SGRT_API sgrt_status sgrt_curvature_features(sgrt_context *context, const sgrt_surface *surface,
                                             const sgrt_curvature *curvature, double sigmas, const sgrt_mut_view *crest,
                                             const sgrt_mut_view *persistence);

/* ------------------------------------------------------------------------------------------------ landmark_model */

/* Named points of a body with their curvature and their places among each other, and how far both may differ: of any head, or of
 * one patient's own reference, with the skin about each point (docs/theory/landmarks.md). Immutable. */
typedef struct sgrt_landmark_model sgrt_landmark_model;

/* Any adult head: nose_apex, ala_left, ala_right, nasion, nasolabial_left, nasolabial_right, nasofacial_left, nasofacial_right, chin,
 * eye_inner_left, eye_inner_right (left and right are the patient's own). since 0.1 */
SGRT_API sgrt_status sgrt_landmark_model_head(sgrt_landmark_model **model);
/* text: UTF-8 JSON of `size` bytes, schema "sgrt-landmark-model/1" (docs/formats.md).
 * SGRT_E_FORMAT, SGRT_E_LIMIT  as sgrt_rig_from_json; fewer than 4 or more than 64 points. since 0.1 */
SGRT_API sgrt_status sgrt_landmark_model_from_json(const char *text, size_t size, sgrt_landmark_model **model);

typedef struct sgrt_landmark_learn_options {
  uint32_t struct_size;
  int32_t count;   /* most points that are taken, where none are named; 4 to 64, default 12 */
  double scale_mm; /* radius at which curvature is taken; 0, the default: from the surface's noise, at least 6 */
  double patch_mm; /* radius of the skin that is kept about each point, 5 to 50; default 14 */
} sgrt_landmark_learn_options;
SGRT_API sgrt_status sgrt_landmark_learn_options_init(sgrt_landmark_learn_options *options, size_t size);
/* A patient's own model from a reference surface with normals: the points of `named` that are found on it, under their names; or, where
 * named is NULL, its most distinctive points (p01, p02 ...) of any region. Located again, such points are as sure as the skin about
 * them. options may be NULL.
 * SGRT_E_INVALID_ARGUMENT   no normals; an option out of range
 * SGRT_E_NOT_FOUND          `named` is not on the surface, or fewer than 4 places stand out
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_landmark_model_learn(sgrt_context *context, const sgrt_surface *reference,
                                               const sgrt_landmark_model *named,
                                               const sgrt_landmark_learn_options *options, sgrt_landmark_model **model);
SGRT_API void sgrt_landmark_model_free(sgrt_landmark_model *model);

enum {
  SGRT_LANDMARK_MODEL_JSON = 1, /* all numbers to the last bit */
  SGRT_LANDMARK_MODEL_ID = 2,
  SGRT_LANDMARK_MODEL_NAME = 3  /* of point `index` */
};
/* Lends a text; NULL where model is NULL, the field unknown or index out of range. since 0.1 */
SGRT_API const char *sgrt_landmark_model_text(const sgrt_landmark_model *model, int32_t field, int32_t index);
enum {
  SGRT_LANDMARK_MODEL_POSITIONS = 1, /* f64, N x 3, mm, model frame (that of the reference) */
  SGRT_LANDMARK_MODEL_NORMALS = 2,   /* f64, N x 3 */
  SGRT_LANDMARK_MODEL_CURVATURE = 3, /* f64, N x 2: k1, k2, 1/mm */
  SGRT_LANDMARK_MODEL_SIGMA = 4      /* f64, N, mm */
};
/* Lends an array; it lives as long as the model. since 0.1 */
SGRT_API sgrt_status sgrt_landmark_model_array(const sgrt_landmark_model *model, int32_t field, sgrt_view *view);

/* ----------------------------------------------------------------------------------------------------- landmarks */

/* Landmarks located on a surface. Immutable. */
typedef struct sgrt_landmarks sgrt_landmarks;

typedef struct sgrt_landmarks_options {
  uint32_t struct_size;
  int32_t min_points; /* landmarks that must match a place that stands out; 3 to 64, default 4 */
  double min_score;   /* 0 to 1, of the whole match; default 0.6 */
  double noise_mm;    /* one sigma along the normal; 0, the default: the surface's own, or measured */
} sgrt_landmarks_options;
SGRT_API sgrt_status sgrt_landmarks_options_init(sgrt_landmarks_options *options, size_t size);

/* Finds a model's landmarks on a live surface with normals: any pose, part of the body, no first guess
 * (docs/theory/landmarks.md eq. 4-11). options may be NULL. *result is written for SGRT_OK and for statuses 10-19; free with
 * sgrt_landmarks_free. Uses the context's threads; the result does not depend on their number.
 * SGRT_E_INVALID_ARGUMENT   no normals; an option out of range
 * SGRT_E_INSUFFICIENT_DATA  too few points for curvature
 * SGRT_E_NOT_FOUND          nothing on the surface is like the model, or it fits in two ways; positions are NaN
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_landmarks_find(sgrt_context *context, const sgrt_surface *surface,
                                         const sgrt_landmark_model *model, const sgrt_landmarks_options *options,
                                         sgrt_landmarks **result);
SGRT_API void sgrt_landmarks_free(sgrt_landmarks *result);

typedef struct sgrt_landmarks_info {
  uint32_t struct_size;
  sgrt_status status;
  int32_t point_count;      /* of the model */
  int32_t found_count;      /* with a position; the others' place is not in view */
  int32_t matched_count;    /* of those in view, that match a place that stands out */
  int32_t seen_count;       /* places in view */
  int32_t candidate_count;  /* places of the surface that stand out */
  int32_t reserved;
  double score;             /* 0 to 1, of the whole match */
  double runner_up_score;   /* of the best match at another pose */
  double live_from_model[16]; /* 4 x 4, of the model first scaled by size; NaN where not found */
  double size;              /* of the body over the model's */
  double scale_mm;          /* radius at which curvature was taken */
  double noise_mm;
} sgrt_landmarks_info;
SGRT_API sgrt_status sgrt_landmarks_summary(const sgrt_landmarks *result, sgrt_landmarks_info *info);

enum {
  SGRT_LANDMARKS_POSITIONS = 1,  /* f64, N x 3, mm; NaN where not in view */
  SGRT_LANDMARKS_COVARIANCE = 2, /* f64, N x 3 x 3, mm2, of the anatomical place */
  SGRT_LANDMARKS_SCORES = 3,      /* f64, N, 0 to 1: how well what is there fits the model; near 0 it lies where the others let expect it */
  SGRT_LANDMARKS_REPEAT_COVARIANCE = 4 /* as COVARIANCE, against the model's own place: what a registration wants */
};
SGRT_API sgrt_status sgrt_landmarks_array(const sgrt_landmarks *result, int32_t field, sgrt_view *view);
enum { SGRT_LANDMARKS_NAME = 1, /* of point `index` */ SGRT_LANDMARKS_MESSAGE = 2 /* why not found; "" where it is */ };
SGRT_API const char *sgrt_landmarks_text(const sgrt_landmarks *result, int32_t field, int32_t index);

/* -------------------------------------------------------------------------------------------------------- volume */

/* A closed body with the skin round it: what a planning CT or a structure set says of the patient. Immutable. */
typedef struct sgrt_volume sgrt_volume;

typedef struct sgrt_volume_options {
  uint32_t struct_size;
  int32_t reserved;
  double rescale_slope, rescale_intercept; /* value = slope * stored + intercept, HU; default 1, 0 */
  double threshold_hu;      /* where the skin lies; NaN, the default: at each place half-way between the air outside and the tissue inside */
  double body_threshold_hu; /* what tells tissue from air to find the body; default -480 */
  double closing_mm;        /* air that a ball of this radius cannot reach from outside is inside (airways, lips); 0 to 50; default 4 */
  double smoothing_mm;      /* radius of the quadric that smooths without shrinking, 0: none, at most 50; NaN, the default: 2.5 mm or twice the
                               coarsest spacing */
  double padding_hu;        /* value of voxels that were not scanned; NaN, the default: all below -1100 */
  double down[3];           /* towards the couch, in the volume's frame: (0, 1, 0) in DICOM coordinates of a supine patient. Default 0, 0, 0: no
                               couch is searched for */
} sgrt_volume_options;
SGRT_API sgrt_status sgrt_volume_options_init(sgrt_volume_options *options, size_t size);

/* The skin of a CT volume (docs/theory/volume.md): couch removed, the largest body, airways closed, sub-voxel by the profile across each place of
 * the skin.
 *
 * voxels: slices x rows x columns, i16, u16, u8 or f32, borrowed for the call and not copied. frame_from_voxel: 4 x 4, mm, maps (column, row,
 * slice) to the frame in which the result is wanted; any spacing, oblique or mirrored. options may be NULL.
 *
 * SGRT_E_INVALID_ARGUMENT  dtype, shape, a side below 2; a matrix that is not affine or flattens the volume; an option out of range; a voxel
 *                          that is NaN or Inf
 * SGRT_E_NOT_FOUND         no voxel above body_threshold_hu, or the body meets air nowhere inside the volume
 * SGRT_E_LIMIT             a side above 32,768, more than 4 GiB of voxels
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_volume_skin(sgrt_context *context, const sgrt_view *voxels, const double frame_from_voxel[16],
                                      const sgrt_volume_options *options, sgrt_volume **volume);

typedef struct sgrt_contours_options {
  uint32_t struct_size;
  int32_t reserved;
  double pixel_mm;     /* of the maps of distance to the contours, 0.1 to 10; default 0.75 */
  double smoothing_mm; /* as in sgrt_volume_options; default 0: the surface goes through the contours */
} sgrt_contours_options;
SGRT_API sgrt_status sgrt_contours_options_init(sgrt_contours_options *options, size_t size);

/* A closed surface from planar contours on a stack of slices, e.g. the EXTERNAL structure of an RTSTRUCT: between slices the signed distance is
 * interpolated (Raya and Udupa 1990), so that legs and arms branch. Contours within contours are holes (even-odd rule). Slices may be unequally
 * spaced.
 *
 * points: P x 3, mm, all contours one after the other. lengths: C, i32, points of each contour, 3 or more; they sum to P. options may be NULL.
 *
 * SGRT_E_INVALID_ARGUMENT  lengths that do not sum to P; a contour that leaves its plane by more than 0.05 mm, or is not parallel to the others (named)
 * SGRT_E_INSUFFICIENT_DATA all on one slice, no contour with an area
 * SGRT_E_LIMIT             more than 5e8 pixels in all: choose a larger pixel_mm
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_contours_close(sgrt_context *context, const sgrt_view *points, const sgrt_view *lengths,
                                         const sgrt_contours_options *options, sgrt_volume **volume);
SGRT_API void sgrt_volume_free(sgrt_volume *volume);

/* Why a vertex is not skin that was measured; 0: it is. */
enum {
  SGRT_SKIN_CUT = 1,     /* the body goes on beyond the volume or the round field of view */
  SGRT_SKIN_CONTACT = 2, /* the couch or another object touches the skin */
  SGRT_SKIN_CLOSED = 4,  /* an airway or cavity was closed here */
  SGRT_SKIN_NO_EDGE = 8  /* no clear edge between air and tissue */
};

typedef struct sgrt_volume_info {
  uint32_t struct_size;
  int32_t couch_found;      /* 1: a couch was found and cut away */
  int64_t vertex_count, face_count;
  int64_t flag_count[4];    /* vertices with SGRT_SKIN_CUT, _CONTACT, _CLOSED, _NO_EDGE */
  double volume_mm3;        /* of the closed mesh */
  double bias_mm;           /* mean over the unflagged vertices of SGRT_VOLUME_BIAS */
  double sigma_mm;          /* their median sigma; NaN where there is none */
  double contrast_hu;       /* median of tissue minus air; NaN for contours */
  double slice_spacing_mm, largest_gap_mm; /* between slices: the median and the largest */
  int64_t slice_count;
} sgrt_volume_info;
SGRT_API sgrt_status sgrt_volume_summary(const sgrt_volume *volume, sgrt_volume_info *info);

enum {
  SGRT_VOLUME_POINTS = 1,  /* f64, N x 3, vertices of the closed mesh, mm */
  SGRT_VOLUME_NORMALS = 2, /* f64, N x 3, outward */
  SGRT_VOLUME_FACES = 3,   /* i32, M x 3, counter-clockwise seen from outside; each edge has two faces */
  SGRT_VOLUME_SIGMA = 4,   /* f64, N, one sigma along the normal, mm; NaN where flagged; absent without smoothing and for contours */
  SGRT_VOLUME_BIAS = 5,    /* f64, N, expected distance of the vertex outside (+) the true skin, mm: threshold and blur */
  SGRT_VOLUME_FLAGS = 6    /* u8, N, SGRT_SKIN_... */
};
SGRT_API sgrt_status sgrt_volume_array(const sgrt_volume *volume, int32_t field, sgrt_view *view);
/* The part of the mesh whose vertices have none of the flags in `without` (a sum of SGRT_SKIN_...; 15: only measured skin, 0: the closed body), as
 * a surface with normals and, where there is one for every vertex, sigma. SGRT_E_NOT_FOUND  nothing is left. since 0.1 */
SGRT_API sgrt_status sgrt_volume_surface(const sgrt_volume *volume, int32_t without, sgrt_surface **surface);
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
  int32_t anywhere;         /* 1: assume nothing about the start (docs/theory/coarse.md); the first guess is not used. Default 0 */
  int32_t residual;         /* SGRT_RESIDUAL_...; default SGRT_RESIDUAL_PLANE */
  int32_t kernel;           /* SGRT_KERNEL_...; default SGRT_KERNEL_AUTO */
  int32_t reserved;
  double keep_share;        /* of the pairs, the nearest; the others are trimmed; default 1 */
} sgrt_icp_options;

/* The defaults are the fast search; any other choice is textbook ICP on the same prepared reference: closest points, weights with a
 * scale that shrinks from round to round, step (docs/theory/icp.md section 3). */
enum {
  SGRT_RESIDUAL_PLANE = 0,            /* distance to the closest surface along its normal */
  SGRT_RESIDUAL_POINT_SVD = 1,        /* distance to the closest point; the motion in closed form by singular vectors ... */
  SGRT_RESIDUAL_POINT_QUATERNION = 2, /* ... by a quaternion. Both need many more iterations */
  SGRT_RESIDUAL_SYMMETRIC = 3         /* along the mean of both normals; live needs normals */
};
enum {
  SGRT_KERNEL_AUTO = 0,  /* Tukey on the way, least squares on the inliers at the end; with another residual: Tukey */
  SGRT_KERNEL_NONE = 1,  /* least squares */
  SGRT_KERNEL_TUKEY = 2,
  SGRT_KERNEL_WELSCH = 3
};
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

/* A reference made ready: closest points in constant time, so that a live surface costs only its own points. Immutable. */
typedef struct sgrt_reference sgrt_reference;
/* roi: the part that counts; NULL: all. Both may be freed afterwards.
 * SGRT_E_INSUFFICIENT_DATA  fewer than 6 points that count, or none that lies on a smooth sheet
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_reference_create(sgrt_context *context, const sgrt_surface *surface, const sgrt_roi *roi,
                                           sgrt_reference **reference);
SGRT_API void sgrt_reference_free(sgrt_reference *reference);
/* As sgrt_icp_align, with the reference and its roi prepared. since 0.1 */
SGRT_API sgrt_status sgrt_reference_align(sgrt_context *context, const sgrt_reference *reference,
                                          const sgrt_surface *live, const double isocentre_mm[3],
                                          const double initial_reference_from_live[16], const sgrt_icp_options *options,
                                          sgrt_icp **result);

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
  double covariance_random[36]; /* the part of the live noise: new in every frame */
  double covariance_shared[36]; /* the part that all frames on this reference share: its noise, the error modes of both */
  double chi2;            /* reduced: 1 where the residuals are as the points' noise predicts */
  double coarse_score;    /* of the search without a start, 0 to 1; NaN where there was none */
  double coarse_runner_up; /* score of the best pose elsewhere */
  int32_t direction_count; /* 6, or 0 without a pose */
  int32_t reserved2;
  double direction_motion[36];  /* eigenvectors of the covariance, the least certain first: rows of (rotation rad, translation
                                   mm) at the isocentre, unit length with rotations at 100 mm */
  double direction_sigma_mm[6]; /* one sigma along each, rotations at 100 mm */
  double direction_detectable_mm[6]; /* the smallest shift along it that is found 95 times in 100 at a false alarm in 20 */
} sgrt_icp_info;
SGRT_API sgrt_status sgrt_icp_summary(const sgrt_icp *result, sgrt_icp_info *info);

enum {
  SGRT_ICP_DISTANCE = 1, /* f64, N or H x W as live: signed distance map, mm, at the pose found; NaN without correspondence */
  SGRT_ICP_INLIER = 2    /* u8, like it: 1 where the point took part */
};
SGRT_API sgrt_status sgrt_icp_array(const sgrt_icp *result, int32_t field, sgrt_view *view);

enum {
  SGRT_ICP_VERDICT = 1, /* "ok", "weak: ...", or why there is no pose */
  SGRT_ICP_WORDS = 2,   /* of free motion `index`: "slides along LNG" */
  SGRT_ICP_DIRECTION = 3 /* of direction `index` */
};
SGRT_API const char *sgrt_icp_text(const sgrt_icp *result, int32_t field, int32_t index);

/* What a prepared reference promises at an isocentre before anything is seen: free motions, sigma and directions of a
 * registration of live points as dense as its own, live_sigma_mm along the normal (docs/theory/icp.md section 7). The pose
 * and what hangs on it is NaN. To choose among regions, prepare each and compare the sigmas.
 * *result is written for SGRT_OK and SGRT_E_DEGENERATE; free with sgrt_icp_free.
 * SGRT_E_INVALID_ARGUMENT  live_sigma_mm not positive
 * SGRT_E_DEGENERATE        motions that the shape leaves free. since 0.1 */
SGRT_API sgrt_status sgrt_reference_predict(sgrt_context *context, const sgrt_reference *reference,
                                            const double isocentre_mm[3], double live_sigma_mm, sgrt_icp **result);
/* Which region to track: what each candidate promises at the isocentre for live points as dense as the reference's, ranked, and a region
 * that promises more (docs/theory/icp.md section 6). A handle of its own because its arrays have lengths of their own. */
typedef struct sgrt_advice sgrt_advice;
typedef struct sgrt_advice_options {
  uint32_t struct_size;
  int32_t reserved;
  double live_sigma_mm; /* along the normal; default 0.3 */
  double limit_mm;      /* a region whose predicted error exceeds it, or leaves a motion free, is flagged; default 1 */
  double limit_deg;     /* default 0.5 */
  double max_share;     /* of the reference's points that the proposal may take; 0, the default: that of the largest candidate, or 0.4 */
} sgrt_advice_options;
SGRT_API sgrt_status sgrt_advice_options_init(sgrt_advice_options *options, size_t size);

/* candidates: count of them, 0 to 1,000; NULL only for 0. options may be NULL. Free with sgrt_advice_free.
 * SGRT_E_INSUFFICIENT_DATA  fewer than 6 usable points. SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_roi_advise(sgrt_context *context, const sgrt_surface *reference, const double isocentre_mm[3],
                                     const sgrt_roi *const *candidates, int64_t count, const sgrt_advice_options *options,
                                     sgrt_advice **result);
SGRT_API void sgrt_advice_free(sgrt_advice *result);
typedef struct sgrt_advice_info {
  uint32_t struct_size;
  int32_t candidate_count;
  int32_t best;   /* of the candidates; -1 where there is none */
  int32_t better; /* 1: the proposal promises more than every candidate */
} sgrt_advice_info;
SGRT_API sgrt_status sgrt_advice_summary(const sgrt_advice *result, sgrt_advice_info *info);
enum {
  SGRT_ADVICE_FORECAST = 1, /* f64, (count + 1) x 5, the last row the proposal: one sigma of the length of the shift at the isocentre, mm, and
                               of the angle, deg; share of the reference's points; score (the two over their limits, squared, added, rooted);
                               1 where flagged */
  SGRT_ADVICE_ORDER = 2,    /* i32, count: the candidates, the best first */
  SGRT_ADVICE_POLYGON = 3   /* f64, V x 2: the proposal, for sgrt_roi_from_polygon */
};
SGRT_API sgrt_status sgrt_advice_array(const sgrt_advice *result, int32_t field, sgrt_view *view);
/* What candidate `index` (count: the proposal) sees worst, or leaves free: "slides along LNG". NULL where there is none. since 0.1 */
SGRT_API const char *sgrt_advice_text(const sgrt_advice *result, int32_t index);

/* -------------------------------------------------------------------------------------------------------- coarse */

/* Result of a registration of landmarks. */
typedef struct sgrt_coarse sgrt_coarse;

typedef struct sgrt_coarse_options {
  uint32_t struct_size;
  int32_t reserved;
  double sigma_mm;            /* of each coordinate of a landmark without a covariance; default 2 */
  double min_share;           /* of the ids on both sides: fewer that agree are no answer; default 0.5 */
  double weak_sigma_mm;       /* verdict `weak` beyond it, turns at 100 mm; default 5 */
  double degenerate_sigma_mm; /* SGRT_E_DEGENERATE beyond it; default 10 */
} sgrt_coarse_options;
SGRT_API sgrt_status sgrt_coarse_options_init(sgrt_coarse_options *options, size_t size);

/* Finds the rigid motion that lays landmarks of the live body on those of one id on the reference: weighted Procrustes on the pairs
 * that agree, found by trying every triple (docs/theory/coarse.md section 2). Its pose is a start for sgrt_icp_align.
 *
 * reference_mm: N x 3, live_mm: M x 3, mm, one room frame. reference_ids, live_ids: i32, N and M; an id that occurs twice stands for
 * candidates, of which at most one is right. ..._covariance_mm2: N x 3 x 3, M x 3 x 3, or NULL: options->sigma_mm.
 * At most 64 pairs of one id. options may be NULL. *result is written for SGRT_OK and for statuses 10-19; free with sgrt_coarse_free.
 *
 * SGRT_E_INSUFFICIENT_DATA  fewer than 3 ids on both sides
 * SGRT_E_NOT_FOUND          no three agree, or too few of them (options->min_share)
 * SGRT_E_DEGENERATE         the landmarks lie (nearly) on a line; or another motion explains as many
 * SGRT_E_LIMIT              more than 64 pairs. SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_coarse_align(sgrt_context *context, const sgrt_view *reference_mm, const sgrt_view *reference_ids,
                                       const sgrt_view *reference_covariance_mm2, const sgrt_view *live_mm,
                                       const sgrt_view *live_ids, const sgrt_view *live_covariance_mm2,
                                       const double isocentre_mm[3], const sgrt_coarse_options *options,
                                       sgrt_coarse **result);
SGRT_API void sgrt_coarse_free(sgrt_coarse *result);

/* All numbers are NaN where no pose was found, but for the isocentre and the counts. */
typedef struct sgrt_coarse_info {
  uint32_t struct_size;
  sgrt_status status;      /* as sgrt_coarse_align returned */
  int32_t verdict;         /* SGRT_VERDICT_...; SGRT_COARSE_VERDICT tells why */
  int32_t common_count;    /* ids on both sides */
  int32_t used_count;      /* that agree on the motion */
  int32_t runner_up_count; /* that agree on the best motion that differs from it */
  double reference_from_live[16];
  double isocentre_mm[3];
  sgrt_patient_displacement displacement;
  sgrt_couch_correction correction;
  double covariance[36]; /* as sgrt_icp_info's */
  double sigma_mm[3];
  double sigma_deg[3];
  double rms_mm; /* distance of the landmarks that agree */
  double chi2;   /* reduced: 1 where they lie as far apart as their covariances predict */
} sgrt_coarse_info;
SGRT_API sgrt_status sgrt_coarse_summary(const sgrt_coarse *result, sgrt_coarse_info *info);

enum {
  SGRT_COARSE_DISTANCE = 1, /* f64, M: of each live landmark from its partner at the pose, mm; NaN without */
  SGRT_COARSE_INLIER = 2    /* u8, M: 1 where it agrees */
};
SGRT_API sgrt_status sgrt_coarse_array(const sgrt_coarse *result, int32_t field, sgrt_view *view);
enum { SGRT_COARSE_VERDICT = 1 /* "ok", "weak: ...", or why there is no pose */ };
SGRT_API const char *sgrt_coarse_text(const sgrt_coarse *result, int32_t field);

/* -------------------------------------------------------------------------------------------------------- deform */

/* Result of a registration of a body that is not rigid. */
typedef struct sgrt_deform sgrt_deform;

enum {
  SGRT_DEFORM_RIGID = 0,      /* find the region that moved rigidly and report its motion alone */
  SGRT_DEFORM_SIMILARITY = 1, /* one scale for all */
  SGRT_DEFORM_FIELD = 2       /* as SGRT_DEFORM_RIGID, and a smooth displacement field over that motion */
};

typedef struct sgrt_deform_options {
  uint32_t struct_size;
  int32_t mode;            /* SGRT_DEFORM_...; default SGRT_DEFORM_RIGID */
  double min_rigid_share;  /* of the region's seen area, 0 to 1; below it nothing can be told; default 0.6 */
  double max_structure_mm; /* coherent change of shape, rms, that may be left in what is taken for rigid; default 0.1 */
  double max_rivalry;      /* of another motion, see runner_up_rivalry; above it the answer is ambiguous; default 0.5 */
  double stiffness;        /* of the field, relative; higher: smoother; default 1 */
} sgrt_deform_options;
SGRT_API sgrt_status sgrt_deform_options_init(sgrt_deform_options *options, size_t size);

/* Lays `live` on `reference` although the body changed its shape (an expression, a breath): the motion of the part that moved
 * rigidly, apart from the deformation of the rest (docs/theory/nonrigid.md). Arguments as sgrt_icp_align; icp_options may be NULL.
 * *result is written for SGRT_OK and for statuses 10-19; free with sgrt_deform_free.
 *
 * SGRT_E_NOT_FOUND   cannot tell: too little of the region moved as one (options->min_rigid_share), or what did still changes its shape; the
 *                    scale ran away; no overlap
 * SGRT_E_DEGENERATE  cannot tell: two motions explain the region nearly as well; the surfaces leave a motion or the size free
 * otherwise as sgrt_icp_align. since 0.1 */
SGRT_API sgrt_status sgrt_deform_align(sgrt_context *context, const sgrt_surface *reference, const sgrt_surface *live,
                                       const double isocentre_mm[3], const sgrt_roi *roi,
                                       const double initial_reference_from_live[16], const sgrt_deform_options *options,
                                       const sgrt_icp_options *icp_options, sgrt_deform **result);
SGRT_API void sgrt_deform_free(sgrt_deform *result);

/* Numbers are NaN where they were not found. With SGRT_DEFORM_SIMILARITY live is first scaled about the isocentre,
 * x -> iso + scale (x - iso), then moved by reference_from_live. */
typedef struct sgrt_deform_info {
  uint32_t struct_size;
  sgrt_status status; /* as sgrt_deform_align returned */
  int32_t verdict;    /* SGRT_VERDICT_... */
  int32_t free_count; /* free directions, see SGRT_DEFORM_WORDS */
  double reference_from_live[16]; /* of the rigid part */
  double isocentre_mm[3];
  sgrt_patient_displacement displacement;
  sgrt_couch_correction correction;
  double covariance[36]; /* as sgrt_icp_info's; with what the change of shape may do to it */
  double sigma_mm[3];
  double sigma_deg[3];
  double rms_mm;       /* of the rigid part */
  double inlier_share; /* of its points */
  double rigid_share;  /* of the region's seen area: what moved as one */
  double structure_mm; /* rms, coherent change of shape found within it */
  double runner_up_share;       /* explained by the best motion that differs from the answer; 0: there is none */
  double runner_up_distance_mm; /* by which it differs at the isocentre, turns at 100 mm */
  double runner_up_rivalry;     /* area that it alone explains over area that the answer alone explains */
  double scale, scale_sigma;    /* live to reference; 1 and NaN but with SGRT_DEFORM_SIMILARITY */
  double deformation_rms_mm, deformation_max_mm; /* of the map; 0 without one */
} sgrt_deform_info;
SGRT_API sgrt_status sgrt_deform_summary(const sgrt_deform *result, sgrt_deform_info *info);

enum {
  SGRT_DEFORM_PART = 1,     /* u8, N or H x W as live: 1 moved rigidly, 0 changed its shape, 255 not known; not for similarity */
  SGRT_DEFORM_DISTANCE = 2, /* f64, like it: signed distance map at the rigid part's pose, mm */
  SGRT_DEFORM_MAP = 3       /* f64, N x 3 or H x W x 3: the change of shape of each live point, mm, reference axes; NaN where not
                               known; absent but with SGRT_DEFORM_FIELD */
};
SGRT_API sgrt_status sgrt_deform_array(const sgrt_deform *result, int32_t field, sgrt_view *view);

enum {
  SGRT_DEFORM_VERDICT = 1, /* "ok", "weak: ...", or why it cannot tell */
  SGRT_DEFORM_WORDS = 2    /* of free motion `index` */
};
SGRT_API const char *sgrt_deform_text(const sgrt_deform *result, int32_t field, int32_t index);

/* ------------------------------------------------------------------------------------------------------- tracker */

/* Session: surfaces in, shifts out, and whether the beam may be on (docs/theory/tracking.md). Each frame starts where the motion
 * of the last ones predicts. One thread at a time. */
typedef struct sgrt_tracker sgrt_tracker;

/* Tolerances: conventional 2 mm and 1 deg, SBRT and SRS 1 mm and 0.5 deg, of the length of the translation at the isocentre and
 * of the angle of the rotation. */
enum { SGRT_PROFILE_CONVENTIONAL = 0, SGRT_PROFILE_SBRT = 1, SGRT_PROFILE_SRS = 2 };

typedef struct sgrt_tracker_options {
  uint32_t struct_size;
  int32_t profile;      /* SGRT_PROFILE_...; default conventional */
  int32_t gated;        /* 1: the beam is on only inside the breathing window (DIBH); default 0 */
  int32_t search;       /* 1: a patient who is lost is looked for anywhere, too (docs/theory/coarse.md); default 1 */
  double tolerance_mm;  /* 0, the default: the profile's */
  double tolerance_deg; /* 0, the default: the profile's */
  double hysteresis;    /* after a hold the beam comes on at this share of the tolerance and of the window; default 0.8 */
  double resume_s;      /* and after it has stayed within it for so long; default 0 */
  double max_gap_s;     /* after a longer pause no motion is predicted, and the beam comes back as from a hold; default 1 */
  double gate_low_mm;   /* the window of the breathing amplitude; default -1.5 ... */
  double gate_high_mm;  /* ... 1.5 */
  double search_every_s; /* between two searches anywhere, each of which takes as long as hundreds of frames; default 1 */
} sgrt_tracker_options;
SGRT_API sgrt_status sgrt_tracker_options_init(sgrt_tracker_options *options, size_t size);

/* reference, isocentre_mm, roi (may be NULL): as sgrt_icp_align. gate_roi: the patch of the reference whose height over it is the
 * breathing amplitude, outward positive; NULL: no trace, and options->gated must be 0. options, icp_options may be NULL; the
 * latter's weak_sigma_mm is lowered to half the tolerance. The reference is kept; it may be freed.
 * SGRT_E_INVALID_ARGUMENT   an option out of range, gated without gate_roi
 * SGRT_E_INSUFFICIENT_DATA  fewer than 6 points of the reference in roi or gate_roi; *tracker is not written. since 0.1 */
SGRT_API sgrt_status sgrt_tracker_create(sgrt_context *context, const sgrt_surface *reference,
                                         const double isocentre_mm[3], const sgrt_roi *roi, const sgrt_roi *gate_roi,
                                         const sgrt_tracker_options *options, const sgrt_icp_options *icp_options,
                                         sgrt_tracker **tracker);
SGRT_API void sgrt_tracker_free(sgrt_tracker *tracker);

enum { SGRT_BEAM_HOLD = 0, SGRT_BEAM_ON = 1 };
/* Why the beam holds: bits of sgrt_tracker_info.hold. */
enum {
  SGRT_HOLD_NO_POSE = 1,      /* no pose was found */
  SGRT_HOLD_WEAK = 2,         /* a pose that is not certain enough for the tolerance */
  SGRT_HOLD_TRANSLATION = 4,  /* beyond tolerance */
  SGRT_HOLD_ROTATION = 8,     /* beyond tolerance */
  SGRT_HOLD_BREATHING = 16,   /* outside the window, or not measured */
  SGRT_HOLD_RETURNING = 32    /* back within tolerance, but not yet well inside, or not for long enough */
};
enum { SGRT_TRACK_LOST = 0, SGRT_TRACK_TRACKING = 1, SGRT_TRACK_FOUND = 2 /* the first trusted frame after a loss */ };

/* All numbers are NaN where no pose was found. */
typedef struct sgrt_tracker_info {
  uint32_t struct_size;
  sgrt_status status; /* of this frame's registration */
  int32_t verdict;    /* SGRT_VERDICT_... */
  int32_t beam;       /* SGRT_BEAM_...; on only with a trusted pose within tolerance */
  int32_t hold;       /* SGRT_HOLD_... bits; 0 where the beam is on */
  int32_t state;      /* SGRT_TRACK_... */
  int32_t attempts;   /* starts tried: predicted, last seen, set up */
  int32_t iterations;
  int64_t frame;      /* its number, from 0 */
  double time_s;
  double reference_from_live[16];
  sgrt_patient_displacement displacement;
  sgrt_couch_correction correction;
  sgrt_patient_displacement drift; /* since the first trusted frame */
  double covariance[36];           /* as sgrt_icp_info's */
  double sigma_mm[3];
  double sigma_deg[3];
  double rms_mm;
  double inlier_share;
  double breathing_mm;       /* amplitude over the reference along the patch's mean normal; NaN without gate_roi or points */
  double breathing_sigma_mm;
  int32_t searched;          /* 1: the patient was looked for anywhere in this frame */
  int32_t reserved;
} sgrt_tracker_info;

/* Takes one frame. live: may be NULL where the cameras had nothing: a frame without a pose. time_s: finite, must not decrease.
 * info->struct_size must be set by the caller. **Whatever the status, what can be written of *info says SGRT_BEAM_HOLD unless the
 * status is SGRT_OK**: after an error its numbers are NaN, so that a loop that looks at info->beam alone is safe.
 * SGRT_E_INVALID_ARGUMENT  a time that runs backwards or is not finite; the session can go on, the beam has to come back
 * statuses 10-19           no pose in this frame: as sgrt_icp_align; the next frame looks for the patient again
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_tracker_push(sgrt_context *context, sgrt_tracker *tracker, const sgrt_surface *live,
                                       double time_s, sgrt_tracker_info *info);
/* Another reference from the next frame on: motion, drift and beam start afresh, the time does not. Errors as
 * sgrt_tracker_create, and then the old reference stays, the beam on hold. since 0.1 */
SGRT_API sgrt_status sgrt_tracker_set_reference(sgrt_context *context, sgrt_tracker *tracker,
                                                const sgrt_surface *reference, const sgrt_roi *roi,
                                                const sgrt_roi *gate_roi);

enum {
  SGRT_TRACKER_VERDICT = 1, /* "ok", "weak: ...", or why the last frame has no pose; "" before the first */
  SGRT_TRACKER_HOLD = 2     /* why the beam holds, in words; "" where it is on */
};
/* Lends a text of the last push, until the next one. NULL where tracker is NULL or the field unknown. since 0.1 */
SGRT_API const char *sgrt_tracker_text(const sgrt_tracker *tracker, int32_t field);

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
  int32_t max_iterations;   /* of each solve; 100 unless set */
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
/* Centres of a laser's stripe in images of a board; with the corners in sgrt_calibration_data. */
typedef struct sgrt_laser_stripes {
  uint32_t struct_size;
  int32_t fixed;       /* 1: a laser without a mirror: one light plane, the readings do not matter; default 0 */
  sgrt_view placement; /* S i32: of the board, as in sgrt_calibration_data */
  sgrt_view angle_rad; /* S: mirror reading */
  sgrt_view pixels;    /* S x 2 */
  sgrt_view sigma_px;  /* S: one sigma along the line on which the centre was found */
} sgrt_laser_stripes;
SGRT_API sgrt_status sgrt_laser_stripes_init(sgrt_laser_stripes *stripes, size_t size);

/* Calibrates a laser unit: fan, mirror axis, offset and angle scale in one solve with the board's placements (docs/theory/laser.md eq.
 * 18-22). data: one camera of the rig, the laser's; its lens stays as it is. Stripe centres off the board do not count. A laser of this id
 * in the rig is the start, else one is found. The result's rig holds the laser in the gauge of docs/formats.md and its covariance in the
 * modes; the report says what the sweep does not fix. SGRT_CALIBRATION_CORNERS are the stripe's centres (point -1, the residual along x
 * in px), SGRT_CALIBRATION_COVARIANCE that of the unit's parameters. Of the options max_iterations, outlier_sigma and noise_px (of a
 * corner) count.
 * SGRT_E_INVALID_ARGUMENT   more than one camera, one that is not in the rig, shape, range
 * SGRT_E_INSUFFICIENT_DATA  fewer than 50 centres on the board, one mirror reading
 * SGRT_E_DEGENERATE         the board stood in one place only, or the light plane does not turn
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_laser(sgrt_context *context, const sgrt_rig *rig, const char *laser_id,
                                            const sgrt_calibration_data *data, const sgrt_laser_stripes *stripes,
                                            const sgrt_calibration_options *options, sgrt_calibration **result);

typedef struct sgrt_calibration_tof_options {
  uint32_t struct_size;
  int32_t amplitude_knots;   /* of the amplitude's term, 0 (none) to 100; default 8. Left out where amplitudes span less than 1.5 */
  double board_mm[4];        /* the part of the board that is flat and bare: left, top, right, bottom in its plane. No default */
  double knot_spacing_mm;    /* of the range correction, 1 to 1e4; default 50 */
  double pixel_sigma_mm;     /* what the offset of a pixel may be; 0: no such term; default 10 */
  const sgrt_tof_options *sensor; /* how the frames are measured; its pixel_offset_mm is not used. NULL, the default: as sgrt_tof_measure does */
} sgrt_calibration_tof_options;
SGRT_API sgrt_status sgrt_calibration_tof_options_init(sgrt_calibration_tof_options *options, size_t size);

/* The range error of a time-of-flight camera from a flat board at known poses (docs/theory/tof.md eq. 13-15): over the measured range
 * (wiggling), over the amplitude, and of each pixel. Corrections that the rig holds are replaced. The lens is calibrated as any camera's.
 * taps: `count` of them, a placement each, as sgrt_tof_measure. room_from_board: count x 4 x 4, the board's plane being z = 0; or absent:
 * then data (NULL otherwise) tells where the rig's cameras saw the board's points in these `count` placements, and the poses come from
 * that (sgrt_calibration_check). A placement without a pose does not count. The result's rig holds the corrections, and names
 * "pixel-offset.npy" for those of the pixels (SGRT_CALIBRATION_PIXEL_OFFSET).
 * SGRT_E_INVALID_ARGUMENT   unknown unit, taps of another shape, no rectangle
 * SGRT_E_INSUFFICIENT_DATA  too few pixels saw the board
 * SGRT_E_CANCELLED. since 0.1 */
SGRT_API sgrt_status sgrt_calibration_tof(sgrt_context *context, const sgrt_rig *rig, const char *tof_id,
                                          const sgrt_view *taps, int32_t count, const sgrt_view *room_from_board,
                                          const sgrt_calibration_data *data,
                                          const sgrt_calibration_tof_options *options, sgrt_calibration **result);
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
  SGRT_CALIBRATION_COVARIANCE = 2, /* f64, P x P, of SGRT_CALIBRATION_PARAMETER 0 to P - 1; of sgrt_calibration_solve only */
  SGRT_CALIBRATION_PIXEL_OFFSET = 3 /* f32, H x W, mm, to be subtracted from the range; of sgrt_calibration_tof only */
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
