// The peer of measure.sh and memory.sh in C.

#define _POSIX_C_SOURCE 200809L
#include <armor_messages.h>
#include <stdlib.h>
#include <time.h>

// The first trips of each are not counted: memory that is touched for the first time, and caches.
enum { ROUND_TRIPS = 20000, IMAGE_TRIPS = 2000, WARM_UP = 200 };

// 100 bytes on the wire.
typedef struct small {
  uint64_t number;
  uint8_t payload[92];
} small;
ARMOR_STRUCT(small, "Small", ARMOR_FIELD(small, number, ""), ARMOR_ARRAY(small, payload, ""));

static const armor_handle *armor;
static char role[16];
static uint64_t count;
// Messages of a flood, and bytes of an image.
static int64_t flood, image_len;
static double sent_s, times_us[ROUND_TRIPS];
static size_t time_count;
static uint8_t *pixels;

static double now_s(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static bool is_role(const char *name) { return strcmp(role, name) == 0; }

static int create(const armor_handle *handle, void *user) {
  (void)user;
  armor = handle;
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "small-in", small, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_PROVIDE(handle, "small-out", small, 0));
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "image-in", armor_image, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_PROVIDE(handle, "image-out", armor_image, 0));
  ARMOR_TRY(armor_get_parameter(handle, "flood"));
  ARMOR_TRY(armor_get_parameter(handle, "image"));
  return armor_get_parameter(handle, "role");
}

static int parameter_received(void *user, const char *name, const armor_value *value) {
  (void)user;
  if (strcmp(name, "flood") == 0) return armor_value_integer(value, &flood);
  if (strcmp(name, "image") == 0) return armor_value_integer(value, &image_len);
  snprintf(role, sizeof role, "%s", armor_value_text(value));
  return ARMOR_ERROR_NONE;
}

static int send_small(uint64_t number) {
  small message = {.number = number};
  if (is_role("ask")) sent_s = now_s();
  return ARMOR_SEND(armor, "small-out", small, &message);
}

static int send_image(uint32_t number) {
  armor_image image = {.width = number, .height = 1};
  image.data.data = pixels, image.data.len = (size_t)image_len;
  sent_s = now_s();
  return ARMOR_SEND(armor, "image-out", armor_image, &image);
}

// Resident memory of this process.
static long resident_kb(void) {
  char line[128];
  long kb = -1;
  FILE *status = fopen("/proc/self/status", "r");
  while (status != NULL && fgets(line, sizeof line, status) != NULL) sscanf(line, "VmRSS: %ld", &kb);
  if (status != NULL) fclose(status);
  return kb;
}

static void take_time(void) { times_us[time_count++] = (now_s() - sent_s) * 1e6; }

static int compare(const void *a, const void *b) {
  const double left = *(const double *)a, right = *(const double *)b;
  return (left > right) - (left < right);
}

static void log_times(const char *what) {
  double *counted = times_us + WARM_UP;
  const size_t len = time_count - WARM_UP;
  qsort(counted, len, sizeof counted[0], compare);
  armor_write_log(20, "measured: %s: %.1f us p50, %.1f us p99", what, counted[len / 2], counted[len * 99 / 100]);
  time_count = 0;
}

static int take_image(const armor_data *data) {
  armor_image view;
  ARMOR_TRY(ARMOR_DECODE(data, armor_image, &view));
  if (is_role("answer")) {
    const uint32_t sum = view.data.data[0] + view.data.data[view.data.len - 1];
    armor_image image = {.width = view.width, .height = sum};
    return ARMOR_SEND(armor, "image-out", armor_image, &image);
  }
  take_time();
  if (view.width + 1 < IMAGE_TRIPS) return send_image(view.width + 1);
  char what[64];
  snprintf(what, sizeof what, "%lld B image and answer", (long long)image_len);
  log_times(what);
  armor_write_log(20, "measured: end");
  return ARMOR_ERROR_NONE;
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  (void)user;
  if (strcmp(header->id, "image-in") == 0) return take_image(data);
  small message;
  ARMOR_TRY(ARMOR_DECODE(data, small, &message));
  if (is_role("answer")) return ARMOR_SEND(armor, "small-out", small, &message);
  if (is_role("ask")) {
    take_time();
    if (message.number + 1 < ROUND_TRIPS) return send_small(message.number + 1);
    log_times("round trip 100 B");
    pixels = malloc((size_t)image_len);
    if (pixels == NULL) return armor_fail("no memory for an image");
    memset(pixels, 7, (size_t)image_len);
    return send_image(0);
  }
  if (count++ == 0) sent_s = now_s();
  const uint64_t messages = (uint64_t)flood;
  if (count % (messages / 10) == 0) {
    armor_write_log(20, "measured: %llu messages, %ld kB resident", (unsigned long long)count, resident_kb());
  }
  if (count == messages) {
    armor_write_log(20, "measured: flood 100 B: %.3f M msg/s", (double)messages / (now_s() - sent_s) / 1e6);
  }
  return ARMOR_ERROR_NONE;
}

static armor_outcome execute(void *user, int call) {
  (void)user;
  const bool is_first = is_role("ask") || is_role("flood");
  // At the second tick the links are up.
  if (call != ARMOR_CALL_TICK || !is_first || ++count != 2) return armor_carry_on();
  const uint64_t messages = is_role("ask") ? 1 : (uint64_t)flood;
  for (uint64_t number = 0; number < messages; ++number) {
    if (send_small(number) != ARMOR_ERROR_NONE) return armor_failed_with_last_error();
  }
  return armor_carry_on();
}

static const armor_parameter parameters[] = {{.name = "role",
                                              .kind = ARMOR_PARAMETER_TYPE_TEXT,
                                              .default_value = "answer",
                                              .doc = "ask, answer, flood or count"},
                                             {.name = "flood",
                                              .kind = ARMOR_PARAMETER_TYPE_INTEGER,
                                              .default_value = "2000000",
                                              .minimum = 10,
                                              .maximum = 1e12,
                                              .doc = "messages of a flood"},
                                             {.name = "image",
                                              .kind = ARMOR_PARAMETER_TYPE_INTEGER,
                                              .default_value = "8388608",
                                              .minimum = 1,
                                              .maximum = 6e7,
                                              .doc = "bytes of an image"}};
static const armor_component component = {.kind = "c-peer",
                                          .summary = "Measures links.",
                                          .parameters = parameters,
                                          .parameter_count = ARMOR_COUNT(parameters),
                                          .create = create,
                                          .parameter_received = parameter_received,
                                          .data_received = data_received,
                                          .exec = execute};

int main(int argc, char **argv) { return armor_run(argc, argv, &component); }
