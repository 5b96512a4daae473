/* Frames without end through a stereo session, a temporal filter and a tracker, with lost, blank and cancelled ones
 * between: the bytes in use on the heap are the same after every round, and the resident memory does not grow.
 * `capi_test_soak 1000000` for a campaign (scripts/verify); prints what it measured as JSON. */
#include "../sanitizers.h"

#include "check.h"

#ifdef __GLIBC__
#include <malloc.h>
#include <unistd.h>
#endif

enum { kWidth = 64, kHeight = 48, kScenes = 10, kMaxSamples = 4096 };

static const char kRig[] =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"soak\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": ["
    "{\"id\": \"l\", \"image_size\": [64, 48], \"model\": \"pinhole\", \"intrinsics\": [120, 120, 31.5, 23.5],"
    " \"camera_from_room\": [[1, 0, 0, 60], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]},"
    "{\"id\": \"r\", \"image_size\": [64, 48], \"model\": \"pinhole\", \"intrinsics\": [120, 120, 31.5, 23.5],"
    " \"camera_from_room\": [[1, 0, 0, -60], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]}],"
    "\"pairs\": [{\"id\": \"pod\", \"left\": \"l\", \"right\": \"r\"}]}";

static uint8_t left[kScenes][kHeight][kWidth], right[kScenes][kHeight][kWidth], blank[kHeight][kWidth];
static double resident[kMaxSamples];

/* A number in [0, 1) of a lattice point. */
static double lattice(int i, int j) {
  uint32_t h = (uint32_t)i * 73856093u ^ (uint32_t)j * 19349663u;
  h ^= h >> 13, h *= 0x5bd1e995u, h ^= h >> 15, h *= 0x27d4eb2du;
  return (h ^ h >> 13) / 4294967296.0;
}

static double speckle(double x, double y) {
  const double u = x / 22, v = y / 22, a = u - floor(u), b = v - floor(v);
  const int i = (int)floor(u), j = (int)floor(v);
  return (lattice(i, j) * (1 - a) + lattice(i + 1, j) * a) * (1 - b) +
         (lattice(i, j + 1) * (1 - a) + lattice(i + 1, j + 1) * a) * b;
}

static double height(double x, double y, double lift) {
  return lift + 40 * cos(x / 70) * sin(0.7 + y / 60) - x * y / 900;
}

/* What the camera at (x0, 0, 1000) sees of the body, lifted. */
static void render(double x0, double lift, uint8_t image[kHeight][kWidth]) {
  int i, j, k;
  for (i = 0; i < kHeight; ++i) {
    for (j = 0; j < kWidth; ++j) {
      const double u = (j - 31.5) / 120, v = -(i - 23.5) / 120;
      double s = 1000;
      for (k = 0; k < 30; ++k) s = 1000 - height(x0 + s * u, s * v, lift);
      image[i][j] = (uint8_t)(20.5 + 200 * speckle(x0 + s * u, s * v));
    }
  }
}

typedef struct Sessions {
  sgrt_context* context;
  sgrt_stereo_session* stereo;
  sgrt_filter_session* filter;
  sgrt_tracker* tracker;
  long count[32]; /* frames by status of the tracker */
} Sessions;

static sgrt_view view_of(uint8_t image[kHeight][kWidth]) {
  return sgrt_view_of(image, SGRT_U8, kHeight, kWidth, 0);
}

/* One frame; its status of the tracker. Every 20th is blank, every 50th without a surface. */
static sgrt_status frame(Sessions* s, long n) {
  const int scene = (int)(n % kScenes);
  const sgrt_view l = view_of(n % 20 == 7 ? blank : left[scene]), r = view_of(right[scene]);
  const sgrt_stereo* lent = NULL;
  sgrt_surface* surface = NULL;
  sgrt_tracker_info info;
  sgrt_status status;
  sgrt_stereo_session_push(s->context, s->stereo, &l, &r, 0.05 * (double)n, &lent);
  if (lent && sgrt_stereo_surface(lent, &surface) == SGRT_OK) {
    sgrt_filter_session_push(s->context, s->filter, surface, 0.05 * (double)n, NULL);
  }
  info.struct_size = sizeof info;
  status = sgrt_tracker_push(s->context, s->tracker, n % 50 == 31 ? NULL : surface, 0.05 * (double)n, &info);
  if (status != SGRT_OK) CHECK(info.beam == SGRT_BEAM_HOLD);
  sgrt_surface_free(surface);
  ++s->count[status];
  return status;
}

static void open_sessions(Sessions* s) {
  const double isocentre[3] = {0, 0, 0};
  sgrt_rig* rig = NULL;
  sgrt_surface* reference = NULL;
  const sgrt_stereo* lent = NULL;
  sgrt_stereo_options stereo;
  sgrt_tracker_options tracking;
  const sgrt_view l = view_of(left[0]), r = view_of(right[0]);
  s->context = context_of(1, NULL, NULL);
  CHECK_OK(sgrt_rig_from_json(kRig, strlen(kRig), &rig));
  CHECK_OK(sgrt_stereo_options_init(&stereo, sizeof stereo));
  stereo.window_px = 9;
  stereo.stride_px = 3;
  stereo.min_component = 10;
  stereo.max_sigma_px = 0.5;
  CHECK_OK(sgrt_stereo_session_create(s->context, rig, "pod", &stereo, &s->stereo));
  CHECK_OK(sgrt_stereo_session_push(s->context, s->stereo, &l, &r, 0, &lent));
  CHECK_OK(sgrt_stereo_surface(lent, &reference));
  CHECK_OK(sgrt_tracker_options_init(&tracking, sizeof tracking));
  tracking.search = 0;
  CHECK_OK(sgrt_tracker_create(s->context, reference, isocentre, NULL, NULL, &tracking, NULL, &s->tracker));
  CHECK_OK(sgrt_filter_session_create(NULL, &s->filter));
  sgrt_surface_free(reference);
  sgrt_rig_free(rig);
  if (!s->stereo || !s->tracker) exit(2);
}

static void close_sessions(Sessions* s) {
  sgrt_stereo_session_free(s->stereo);
  sgrt_filter_session_free(s->filter);
  sgrt_tracker_free(s->tracker);
  sgrt_context_free(s->context);
}

/* Bytes that the program holds in memory, and that it has asked for; 0 where that is not known. */
static double resident_bytes(void) {
  double pages = 0;
#ifdef __GLIBC__
  FILE* file = fopen("/proc/self/statm", "r");
  if (file && fscanf(file, "%*f %lf", &pages) != 1) pages = 0;
  if (file) fclose(file);
  pages *= (double)sysconf(_SC_PAGESIZE);
#endif
  return pages;
}

static size_t heap_bytes(void) {
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  return mallinfo2().uordblks;
#else
  return 0;
#endif
}

/* Least-squares slope of the second half of the samples, one a round, over a frame. */
static double slope(int samples, long round) {
  const int first = samples / 2;
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0, n = samples - first;
  int i;
  for (i = first; i < samples; ++i) {
    const double x = (double)i * (double)round;
    sum_x += x, sum_y += resident[i], sum_xx += x * x, sum_xy += x * resident[i];
  }
  return n < 2 ? 0 : (n * sum_xy - sum_x * sum_y) / (n * sum_xx - sum_x * sum_x);
}

/* REQ-REL-002 */
static void soak(long frames) {
  const long period = 700; /* 20, 50 and the scenes begin alike */
  const long rounds = frames / period > 4 ? frames / period : 4, step = (rounds + kMaxSamples - 1) / kMaxSamples;
  Sessions s;
  size_t first = 0, now = 0;
  long round, n;
  int samples = 0;
  memset(&s, 0, sizeof s);
  open_sessions(&s);
  for (round = 0; round < rounds; ++round) {
    for (n = 0; n < period; ++n) frame(&s, round * period + n + 1);
    now = heap_bytes();
    if (round < 2) first = now; /* buffers grow to what the largest frame needs */
    if (now != first) {
      CHECK(!"the heap holds the same bytes after every round");
      break;
    }
    if (round % step == 0) resident[samples++] = resident_bytes();
  }
  CHECK(s.count[SGRT_OK] > rounds * period / 2);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) /* which keep what was freed for a while */
  CHECK(resident[samples - 1] - resident[samples / 2] <= 65536);
#endif
  printf(
      "{\"frames\": %ld, \"with_pose\": %ld, \"heap_bytes\": [%zu, %zu], \"resident_bytes\": "
      "[%.0f, %.0f], "
      "\"resident_slope_bytes_per_frame\": %.6g}\n",
      rounds * period, s.count[SGRT_OK], first, now, resident[0], resident[samples - 1], slope(samples, period * step));
  close_sessions(&s);
}

int main(int argc, char** argv) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  const long usual = 2800;
#else
  const long usual = 10500;
#endif
  int i;
  for (i = 0; i < kScenes; ++i) {
    const double lift = 1.5 * sin(2 * 3.14159265358979 * i / kScenes);
    render(-60, lift, left[i]);
    render(60, lift, right[i]);
  }
  soak(argc > 1 ? atol(argv[1]) : usual);
  return check_result();
}
