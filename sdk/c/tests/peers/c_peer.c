// The peer of measure.sh and memory.sh in C.

#define _POSIX_C_SOURCE 200809L
#include <armor_messages.h>
#include <stdlib.h>
#include <time.h>

// The first trips of each are not counted: memory that is touched for the first time, and caches.
enum { ROUND_TRIPS = 5000, IMAGE_TRIPS = 1000, WARM_UP = 100, SIZES = 3 };
static const size_t image_lens[SIZES] = {64 << 10, 1 << 20, 8 << 20};

// 100 bytes on the wire.
typedef struct small {
  uint64_t number;
  uint8_t payload[92];
} small;
ARMOR_STRUCT(small, "Small", ARMOR_FIELD(small, number, ""), ARMOR_ARRAY(small, payload, ""));

static const armor_handle *armor;
static enum { ASK, ANSWER, FLOOD, COUNT } role;
// Messages that were counted, or ticks, and the count at which the memory is logged next.
static uint64_t count, next_log;
// Messages of a flood.
static int64_t flood;
static double sent_s, *times_us;
static size_t time_count;
static uint8_t *images[SIZES];
// The size that is measured.
static int size_at;

static double now_s(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static int create(const armor_handle *handle, void *user) {
  (void)user;
  armor = handle;
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "small-in", small, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_PROVIDE(handle, "small-out", small, 0));
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "image-in", armor_image, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_PROVIDE(handle, "image-out", armor_image, 0));
  ARMOR_TRY(armor_get_parameter(handle, "flood"));
  return armor_get_parameter(handle, "role");
}

static int parameter_received(void *user, const char *name, const armor_value *value) {
  (void)user;
  if (strcmp(name, "flood") == 0) return armor_value_integer(value, &flood);
  const char *names[] = {"ask", "answer", "flood", "count"}, *text = armor_value_text(value);
  for (int at = ASK; at <= COUNT; ++at) {
    if (strcmp(text, names[at]) == 0) role = at;
  }
  return ARMOR_ERROR_NONE;
}

// Touches all memory of the measurement.
static int make_ready(void) {
  times_us = malloc(ROUND_TRIPS * sizeof times_us[0]);
  if (times_us == NULL) return armor_fail("no memory for the times");
  for (size_t index = 0; index < ROUND_TRIPS; ++index) times_us[index] = 1;
  // The largest first, as in the other languages.
  for (int at = SIZES - 1; at >= 0; --at) {
    images[at] = malloc(image_lens[at]);
    if (images[at] == NULL) return armor_fail("no memory for an image");
    memset(images[at], 7, image_lens[at]);
  }
  return ARMOR_ERROR_NONE;
}

static int send_small(uint64_t number) {
  small message = {.number = number};
  if (role == ASK) sent_s = now_s();
  return ARMOR_SEND(armor, "small-out", small, &message);
}

static int send_image(uint32_t number) {
  armor_image image = {.width = number, .height = 1};
  image.data.data = images[size_at], image.data.len = image_lens[size_at];
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
  armor_write_log(20, "measured: %s: %.2f us p50, %.2f us p99", what, counted[len / 2], counted[len * 99 / 100]);
  time_count = 0;
}

static int take_image(const armor_data *data) {
  armor_image view;
  ARMOR_TRY(ARMOR_DECODE(data, armor_image, &view));
  if (role == ANSWER) {
    const uint32_t sum = view.data.data[0] + view.data.data[view.data.len - 1];
    armor_image image = {.width = view.width, .height = sum};
    return ARMOR_SEND(armor, "image-out", armor_image, &image);
  }
  take_time();
  if (view.width + 1 < IMAGE_TRIPS) return send_image(view.width + 1);
  char what[64];
  snprintf(what, sizeof what, "image of %zu KiB and answer", image_lens[size_at] >> 10);
  log_times(what);
  if (++size_at < SIZES) return send_image(0);
  armor_write_log(20, "measured: end");
  return ARMOR_ERROR_NONE;
}

static void count_flood(void) {
  const uint64_t messages = (uint64_t)flood;
  if (count++ == 0) sent_s = now_s(), next_log = messages / 10;
  if (count == next_log) {
    armor_write_log(20, "measured: %llu messages, %ld kB resident", (unsigned long long)count, resident_kb());
    next_log += messages / 10;
  }
  if (count == messages) {
    armor_write_log(20, "measured: flood 100 B: %.3f M msg/s", (double)messages / (now_s() - sent_s) / 1e6);
  }
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  (void)user;
  if (strcmp(header->id, "image-in") == 0) return take_image(data);
  small message;
  ARMOR_TRY(ARMOR_DECODE(data, small, &message));
  if (role == ANSWER) return ARMOR_SEND(armor, "small-out", small, &message);
  if (role == ASK) {
    take_time();
    if (message.number + 1 < ROUND_TRIPS) return send_small(message.number + 1);
    log_times("round trip 100 B");
    return send_image(0);
  }
  count_flood();
  return ARMOR_ERROR_NONE;
}

static armor_outcome execute(void *user, int call) {
  (void)user;
  const bool is_first = role == ASK || role == FLOOD;
  if (call != ARMOR_CALL_TICK || !is_first || count == 2) return armor_carry_on();
  ++count;
  if (count == 1) return role == ASK && make_ready() != 0 ? armor_failed_with_last_error() : armor_carry_on();
  // At the second tick the links are up.
  const uint64_t messages = role == ASK ? 1 : (uint64_t)flood;
  for (uint64_t number = 0; number < messages; ++number) {
    if (send_small(number) != ARMOR_ERROR_NONE) return armor_failed_with_last_error();
  }
  return armor_carry_on();
}

static const armor_parameter parameters[] = {{.name = "role",
                                              .kind = ARMOR_PARAMETER_TYPE_CHOICE,
                                              .default_value = "answer",
                                              .choices = "ask answer flood count",
                                              .doc = "what is measured"},
                                             {.name = "flood",
                                              .kind = ARMOR_PARAMETER_TYPE_INTEGER,
                                              .default_value = "2000000",
                                              .minimum = 10,
                                              .maximum = 1e12,
                                              .doc = "messages of a flood"}};
static const armor_component component = {.kind = "c-peer",
                                          .summary = "Measures links.",
                                          .parameters = parameters,
                                          .parameter_count = ARMOR_COUNT(parameters),
                                          .create = create,
                                          .parameter_received = parameter_received,
                                          .data_received = data_received,
                                          .exec = execute};

int main(int argc, char **argv) { return armor_run(argc, argv, &component); }
