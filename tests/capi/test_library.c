/* Version, status words and the last message. */
#define _POSIX_C_SOURCE 200112L
#include <pthread.h>

#include "check.h"

static const struct {
  sgrt_status status;
  const char* word;
} kWords[] = {
    {SGRT_OK, "ok"},
    {SGRT_E_INVALID_ARGUMENT, "invalid_argument"},
    {SGRT_E_FORMAT, "format"},
    {SGRT_E_INSUFFICIENT_DATA, "insufficient_data"},
    {SGRT_E_DEGENERATE, "degenerate"},
    {SGRT_E_NOT_CONVERGED, "not_converged"},
    {SGRT_E_NOT_FOUND, "not_found"},
    {SGRT_E_CANCELLED, "cancelled"},
    {SGRT_E_OUT_OF_MEMORY, "out_of_memory"},
    {SGRT_E_LIMIT, "limit"},
    {SGRT_E_INTERNAL, "internal"},
    {3, "unknown"},
    {-1, "unknown"},
    {INT32_MAX, "unknown"},
    {INT32_MIN, "unknown"},
};

static void test_version(void) {
  char expected[32];
  sprintf(expected, "%d.%d.%d", SGRT_VERSION_MAJOR, SGRT_VERSION_MINOR, SGRT_VERSION_PATCH);
  CHECK(strcmp(sgrt_version(), expected) == 0);
}

/* REQ-ABI-001 */
static void test_status_words(void) {
  size_t i;
  for (i = 0; i < sizeof kWords / sizeof kWords[0]; ++i)
    CHECK(strcmp(sgrt_status_word(kWords[i].status), kWords[i].word) == 0);
}

static void* fail_elsewhere(void* own_message_was_empty) {
  *(int*)own_message_was_empty = sgrt_last_error()[0] == '\0';
  CHECK_INVALID(sgrt_rig_summary(NULL, NULL), "rig: NULL");
  return NULL;
}

/* REQ-ABI-002 */
static void test_the_message_is_the_threads_own(void) {
  pthread_t thread;
  int empty = 0;
  double pose[16];
  CHECK(sgrt_last_error()[0] == '\0'); /* nothing failed yet in this program */
  CHECK_INVALID(sgrt_frame_fixed_from_couch(NAN, pose), "couch_deg: nan, expected");
  CHECK(pthread_create(&thread, NULL, fail_elsewhere, &empty) == 0);
  CHECK(pthread_join(thread, NULL) == 0);
  CHECK(empty);
  CHECK(strstr(sgrt_last_error(), "couch_deg") != NULL);
  CHECK_OK(sgrt_frame_fixed_from_couch(0, pose)); /* success leaves the message of the failure */
  CHECK(strstr(sgrt_last_error(), "couch_deg") != NULL);
}

/* A caller's text in a message: one line, bounded, no half character at the end. */
/* REQ-ABI-003 */
static void test_a_hostile_text_in_a_message(void) {
  static char text[4096];
  sgrt_rig* rig = CANARY(sgrt_rig);
  size_t i;
  strcpy(text, "{\"schema\": \"");
  for (i = strlen(text); i < sizeof text - 8; i += 2) memcpy(text + i, "\xc3\xa4", 2);
  strcpy(text + i, "\"}");
  CHECK_STATUS(sgrt_rig_from_json(text, strlen(text), &rig), SGRT_E_FORMAT, "schema");
  CHECK(rig == CANARY(sgrt_rig));
  CHECK(strlen(sgrt_last_error()) < 512);
  CHECK((sgrt_last_error()[strlen(sgrt_last_error()) - 1] & 0xC0) != 0xC0);
}

/* A camera's id may be any line of text; in a message its last character stays whole. */
/* REQ-ABI-002 */
static void test_an_id_in_a_message(void) {
  static const char format[] =
      "{\"schema\": \"sgrt-rig/1\", \"id\": \"x\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": ["
      "{\"id\": \"%s%s\", \"image_size\": [64, 48], \"model\": \"pinhole\", \"intrinsics\": [60, 60, 32, 24],"
      " \"camera_from_room\": [[1, 0, 0, 50], [0, 1, 0, 0], [0, 0, 1, 900], [0, 0, 0, 1]]},"
      "{\"id\": \"r\", \"image_size\": [64, 48], \"model\": \"pinhole\", \"intrinsics\": [60, 60, 32, 24],"
      " \"camera_from_room\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 900], [0, 0, 0, 1]]}],"
      "\"pairs\": [{\"id\": \"pod\", \"left\": \"%s%s\", \"right\": \"r\"}]}";
  static char text[4096], umlauts[601];
  static const uint8_t pixels[4] = {0};
  const sgrt_view view = sgrt_view_of(pixels, SGRT_U8, 2, 2, 0);
  sgrt_stereo* result = CANARY(sgrt_stereo);
  size_t i, n;
  for (i = 0; i < 600; i += 2) memcpy(umlauts + i, "\xc3\xa4", 2);
  for (i = 0; i < 2; ++i) { /* the buffer ends at either byte of a character */
    const char* start = i ? "b" : "bb";
    sgrt_rig* rig = NULL;
    sprintf(text, format, start, umlauts, start, umlauts);
    CHECK_OK(sgrt_rig_from_json(text, strlen(text), &rig));
    CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &view, &view, NULL, &result), "b\xc3\xa4");
    n = strlen(sgrt_last_error());
    CHECK(n == 510 || n == 511);
    CHECK(n > 2 && !memcmp(sgrt_last_error() + n - 2, "\xc3\xa4", 2));
    sgrt_rig_free(rig);
  }
  CHECK(result == CANARY(sgrt_stereo));
}

int main(void) {
  test_the_message_is_the_threads_own();
  test_version();
  test_status_words();
  test_a_hostile_text_in_a_message();
  test_an_id_in_a_message();
  return check_result();
}
