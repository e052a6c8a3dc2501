// The probe of the conformance test in C; see probe.rs.

#include <armor_messages.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define IMAGE_LEN (1 << 20)

typedef enum armor_side { ARMOR_SIDE_LEFT, ARMOR_SIDE_RIGHT } armor_side;
ARMOR_ENUM(armor_side, "Side", "Left", "Right");

typedef struct armor_part {
  int32_t id;
  armor_string name;
} armor_part;
ARMOR_STRUCT(armor_part, "Part", ARMOR_FIELD(armor_part, id, ""), ARMOR_FIELD(armor_part, name, ""));

typedef struct armor_mixed {
  bool flag;
  int8_t small;
  uint64_t wide;
  double number;
  float single;
  armor_string text;
  struct {
    bool is_present;
    double value;
  } maybe;
  armor_side side;
  armor_pose2d pose;
  ARMOR_LIST_OF(armor_part) parts;
  armor_f64_list numbers;
  double fixed[3];
} armor_mixed;
ARMOR_STRUCT(armor_mixed, "Mixed", ARMOR_FIELD(armor_mixed, flag, ""), ARMOR_FIELD(armor_mixed, small, ""),
             ARMOR_FIELD(armor_mixed, wide, ""), ARMOR_FIELD(armor_mixed, number, "m"),
             ARMOR_FIELD(armor_mixed, single, ""), ARMOR_FIELD(armor_mixed, text, ""),
             ARMOR_OPTIONAL_FIELD(armor_mixed, maybe, ""), ARMOR_NESTED(armor_mixed, side, armor_side, ""),
             ARMOR_NESTED(armor_mixed, pose, armor_pose2d, ""),
             ARMOR_NESTED_LIST(armor_mixed, parts, armor_part), ARMOR_LIST(armor_mixed, numbers, ""),
             ARMOR_ARRAY(armor_mixed, fixed, ""));

typedef struct self {
  const armor_handle *armor;
  // The behaviour of this process is the name of the component.
  const char *behaviour;
  double number;
  char file[512];
  int ticks, received, images, mixed;
  uint64_t published;
  armor_kept *kept;
  armor_any *any;
  // Of the data of `in`, by their count.
  double stamps[64];
  double since_s;
} self;

// Writes what the test looks for into the log.
ARMOR_PRINTF(1, 2) static void note(const char *format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  armor_write_log(20, "seen: %s", text);
}

static bool is(const self *it, const char *behaviour) { return strcmp(it->behaviour, behaviour) == 0; }
static const char *word(bool flag) { return flag ? "true" : "false"; }
static const char *or_none(const char *text) { return text == NULL ? "none" : text; }

static void refusal(int code) {
  if (code == ARMOR_ERROR_NONE) note("nothing is refused");
  else note("refused: %s", armor_last_error());
}

static void sleep_ms(long ms) {
  const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
  nanosleep(&time, NULL);
}

static int create(const armor_handle *armor, void *user) {
  self *it = user;
  it->armor = armor;
  ARMOR_TRY(ARMOR_PROVIDE(armor, "out", armor_count, 0));
  ARMOR_TRY(ARMOR_PROVIDE(armor, "state", armor_count, ARMOR_LATCHED));
  ARMOR_TRY(ARMOR_PROVIDE(armor, "mixed", armor_mixed, 0));
  ARMOR_TRY(ARMOR_PROVIDE(armor, "image", armor_image, 0));
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "in", armor_count, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "other", armor_count, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "many", armor_count, ARMOR_OPTIONAL | ARMOR_MANY));
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "mixed_in", armor_mixed, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "image_in", armor_image, ARMOR_OPTIONAL));
  ARMOR_TRY(armor_subscribe_schema(armor, "any_in", ARMOR_ANY, ARMOR_OPTIONAL | ARMOR_MANY));
  ARMOR_TRY(armor_provide_schema(armor, "any_out", ARMOR_ANY, 0));
  ARMOR_TRY(armor_provide_schema(armor, "any_last", ARMOR_ANY, ARMOR_LATCHED));
  if (is(it, "declare-twice")) ARMOR_TRY(ARMOR_PROVIDE(armor, "out", armor_count, 0));
  if (is(it, "declare-bad-name")) ARMOR_TRY(ARMOR_PROVIDE(armor, "7 up", armor_count, 0));
  if (is(it, "construct-fails")) return armor_fail("no hardware");
  const char *names[] = {"number", "whole", "flag", "text", "file"};
  for (size_t index = 0; index < ARMOR_COUNT(names); ++index) ARMOR_TRY(armor_get_parameter(armor, names[index]));
  return ARMOR_ERROR_NONE;
}

static int parameter_received(void *user, const char *name, const armor_value *value) {
  self *it = user;
  if (strcmp(name, "number") == 0) {
    double number = 0.0;
    ARMOR_TRY(armor_value_number(value, &number));
    if (number == 0.9) return armor_fail("0.9 is not for this probe");
    it->number = number;
    note("parameter number=%g", number);
  } else if (strcmp(name, "whole") == 0) {
    int64_t whole = 0;
    ARMOR_TRY(armor_value_integer(value, &whole));
    note("parameter whole=%lld", (long long)whole);
  } else if (strcmp(name, "flag") == 0) {
    bool flag = false;
    ARMOR_TRY(armor_value_flag(value, &flag));
    note("parameter flag=%s", word(flag));
  } else if (strcmp(name, "text") == 0) {
    note("parameter text=%s", armor_value_text(value));
  } else {
    snprintf(it->file, sizeof it->file, "%s", armor_value_path(value));
    note("parameter file=%s", it->file);
  }
  return ARMOR_ERROR_NONE;
}

static bool is_even(const armor_image *image) {
  for (size_t index = 0; index < image->data.len; ++index) {
    if (image->data.data[index] != image->data.data[0]) return false;
  }
  return true;
}

static int receive_mixed(self *it, const armor_data *data) {
  armor_mixed mixed;
  ARMOR_TRY(ARMOR_DECODE(data, armor_mixed, &mixed));
  if (++it->mixed == 1) {
    note("mixed wide=%llu small=%d text=%s", (unsigned long long)mixed.wide, mixed.small, mixed.text.data);
    char maybe[32] = "none";
    if (mixed.maybe.is_present) snprintf(maybe, sizeof maybe, "%g", mixed.maybe.value);
    note("mixed maybe=%s parts=%zu numbers=%zu", maybe, mixed.parts.len, mixed.numbers.len);
  }
  mixed.maybe.is_present = false;
  return ARMOR_SEND(it->armor, "mixed", armor_mixed, &mixed);
}

static int receive_image(self *it, const armor_data *data) {
  armor_image image;
  ARMOR_TRY(ARMOR_DECODE(data, armor_image, &image));
  it->images += 1;
  if (it->images == 1) note("image whole=%s", word(image.data.len == IMAGE_LEN && is_even(&image)));
  ARMOR_TRY(ARMOR_SEND(it->armor, "image", armor_image, &image));
  if (it->kept == NULL) {
    it->kept = armor_keep(data);
  } else if (it->images == 4) {
    armor_image kept;
    ARMOR_TRY(ARMOR_DECODE_KEPT(it->kept, armor_image, &kept));
    note("kept unchanged=%s", word(is_even(&kept)));
  }
  return ARMOR_ERROR_NONE;
}

static int show_history(self *it, const armor_data *data) {
  size_t len = 0;
  ARMOR_TRY(armor_history_len(data, "in", NULL, &len));
  uint64_t counts[8] = {0};
  double stamps[8] = {0};
  for (size_t age = 0; age < len && age < 8; ++age) {
    armor_count count;
    armor_past past;
    ARMOR_TRY(ARMOR_HISTORY_DECODE(data, "in", NULL, age, armor_count, &count));
    ARMOR_TRY(armor_history_get(data, "in", NULL, age, &past));
    counts[age] = count.count;
    stamps[age] = past.stamp_s;
  }
  char text[128] = "";
  for (size_t age = 0; age < len && age < 8; ++age) {
    char one[16];
    snprintf(one, sizeof one, " %d", (int)(counts[age] - counts[len - 1]));
    strcat(text, one);
  }
  note("history%s", text);
  if (it->received == 4) {
    size_t earlier = 0;
    const size_t later = armor_history_around(data, "in", NULL, (stamps[0] + stamps[1]) / 2.0, &earlier);
    const size_t nearest = armor_history_nearest(data, "in", NULL, stamps[2] + 1e-4);
    note("around %zu %zu nearest %zu", earlier, later, nearest);
    const size_t none = armor_history_around(data, "in", NULL, stamps[2] - 10.0, NULL);
    note("around nothing=%s", word(none == ARMOR_NO_AGE));
  }
  return ARMOR_ERROR_NONE;
}

static int pass_on(self *it, const armor_header *header, const armor_data *data) {
  armor_any *any = armor_any_received(data);
  if (any == NULL) return ARMOR_ERROR_OTHER_TYPE;
  const int sent = armor_send_any(it->armor, "any_out", any);
  if (it->any != NULL) {
    armor_any_free(any);
    return sent;
  }
  it->any = any;
  size_t len = 0;
  armor_any_bytes(any, &len);
  note("any type=%s schema=%s len=%zu stamp=%s", armor_any_type(any), armor_any_schema(any), len,
       word(armor_any_stamp(any) == header->stamp_s));
  return sent;
}

static void compare_stamps(self *it, const armor_header *header, uint64_t count) {
  double *stamp_s = &it->stamps[count % ARMOR_COUNT(it->stamps)];
  if (strcmp(header->id, "in") == 0) *stamp_s = header->stamp_s;
  else if (*stamp_s == header->stamp_s) note("passed on with its stamp=true");
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  self *it = user;
  it->received += 1;
  if (strcmp(header->id, "mixed_in") == 0) return receive_mixed(it, data);
  if (strcmp(header->id, "image_in") == 0) return receive_image(it, data);
  if (strcmp(header->id, "any_in") == 0) return pass_on(it, header, data);
  armor_count count;
  ARMOR_TRY(ARMOR_DECODE(data, armor_count, &count));
  if (is(it, "any-receiver")) compare_stamps(it, header, count.count);
  if (it->received <= 40) {
    note("data %s count=%llu lost=%llu from=%s", header->id, (unsigned long long)count.count,
         (unsigned long long)header->lost, header->data);
  }
  if (it->received == 1) {
    const bool recent = fabs(armor_timestamp(it->armor) - header->stamp_s) < 5.0;
    note("stamp recent=%s instance=%s", word(recent), word(header->instance != 0));
  }
  if (is(it, "data-failure")) return armor_fail("the data are spoilt");
  if ((is(it, "history") || is(it, "history-forgotten")) && it->received <= 4) return show_history(it, data);
  if (is(it, "history-none") && it->received == 1) {
    size_t len = 0;
    refusal(armor_history_len(data, "in", NULL, &len));
    refusal(armor_history_len(data, "none", NULL, &len));
  }
  return ARMOR_ERROR_NONE;
}

static void begin(self *it) {
  const armor_count one = {1};
  const armor_number number = {1.0};
  it->since_s = armor_timestamp(it->armor);
  if (is(it, "declare-late")) refusal(ARMOR_PROVIDE(it->armor, "late", armor_count, 0));
  if (is(it, "forbid-late")) refusal(armor_set_non_controllable(it->armor));
  if (is(it, "send-unknown")) refusal(ARMOR_SEND(it->armor, "nothing", armor_count, &one));
  if (is(it, "send-wrong-type")) refusal(ARMOR_SEND(it->armor, "out", armor_number, &number));
  if (is(it, "names")) {
    note("provided %s", or_none(armor_provided_data(it->armor, "out")));
    note("provided %s", or_none(armor_provided_data(it->armor, "nothing")));
    note("subscribed %s", or_none(armor_subscribed_data(it->armor, "in")));
    note("subscribed %s", or_none(armor_subscribed_data(it->armor, "other")));
  }
}

static armor_outcome work(self *it) {
  if (is(it, "failed") && it->ticks == 2) return armor_failed("no power");
  if (is(it, "failed-silently") && it->ticks == 2) return armor_failed("%s", "");
  if (is(it, "exception") && it->ticks == 2) {
    armor_fail("no power at all");
    return armor_failed_with_last_error();
  }
  if (is(it, "done") && it->ticks == 2) return armor_done();
  if (is(it, "event") && it->ticks == 3) return armor_report_event("near", 0.5);
  if (is(it, "event-undeclared") && it->ticks == 2) return armor_report_event("far", 0.5);
  if (is(it, "crash") && it->ticks == 2 && access(it->file, F_OK) != 0) {
    FILE *mark = fopen(it->file, "w");
    if (mark != NULL) fclose(mark);
    abort();
  }
  if (is(it, "hang") && it->ticks == 2) sleep_ms(600000);
  if (is(it, "busy") && it->ticks == 2) sleep_ms(2600);
  if ((is(it, "slow") || is(it, "slow-all")) && it->ticks <= 6) sleep_ms(300);
  if (is(it, "freeze-in-exec") && it->ticks == 2) {
    sleep_ms(1500);
    note("the call ends");
  }
  if (is(it, "print") && it->ticks == 1) printf("printed on stdout\n");
  if (is(it, "synchronize") && it->ticks == 2) {
    if (armor_get_parameter(it->armor, "number") || armor_synchronize(it->armor)) {
      return armor_failed_with_last_error();
    }
    note("synchronized");
  }
  if (is(it, "time") && it->ticks == 3) {
    const double now_s = armor_timestamp(it->armor);
    struct timespec wall;
    clock_gettime(CLOCK_REALTIME, &wall);
    const bool right = fabs(now_s - ((double)wall.tv_sec + (double)wall.tv_nsec / 1e9)) < 5.0;
    note("time right=%s passes=%s", word(right), word(now_s > it->since_s));
  }
  if (is(it, "any") && it->ticks == 5 && it->any != NULL) {
    if (armor_send_any(it->armor, "any_last", it->any)) return armor_failed_with_last_error();
  }
  if (is(it, "sender")) {
    const armor_count count = {++it->published};
    if (ARMOR_SEND(it->armor, "out", armor_count, &count)) return armor_failed_with_last_error();
  }
  return armor_carry_on();
}

static armor_outcome exec(void *user, int call) {
  self *it = user;
  static const char *const words[] = {"started", "tick", "data", "stopping"};
  if (call == ARMOR_CALL_STARTED) it->ticks = it->received = 0;
  else if (call != ARMOR_CALL_STOPPING) it->ticks += 1;
  if (it->ticks <= 5 || call == ARMOR_CALL_STOPPING) note("call %s", words[call]);
  if (call == ARMOR_CALL_STARTED) begin(it);
  else if (call != ARMOR_CALL_STOPPING) return work(it);
  return armor_carry_on();
}

static const char *read_behaviour(int argc, char **argv) {
  for (int index = 1; index + 1 < argc; ++index) {
    if (strcmp(argv[index], "--name") == 0) return argv[index + 1];
  }
  return "";
}

int main(int argc, char **argv) {
  static self it;
  it.behaviour = read_behaviour(argc, argv);
  armor_parameter parameters[5] = {
      {.name = "number", .kind = ARMOR_PARAMETER_TYPE_NUMBER, .unit = "m/s", .default_value = "0.3m/s",
       .minimum = 0.0, .maximum = 1.0, .live = true, .doc = "A speed."},
      {.name = "whole", .kind = ARMOR_PARAMETER_TYPE_INTEGER, .default_value = "7", .doc = "A whole number."},
      {.name = "flag", .kind = ARMOR_PARAMETER_TYPE_FLAG, .default_value = "false", .doc = "A flag."},
      {.name = "text", .kind = ARMOR_PARAMETER_TYPE_TEXT, .default_value = "none", .doc = "A text."},
      {.name = "file", .kind = ARMOR_PARAMETER_TYPE_PATH, .default_value = "mark", .doc = "A file."},
  };
  const armor_event events[] = {{"near", "something is near", true, "m"}, {"over", "it is over", false, NULL}};
  armor_component component = {0};
  component.kind = "probe";
  component.summary = "Shows how a component behaves.";
  component.parameters = parameters;
  component.parameter_count = ARMOR_COUNT(parameters);
  component.events = events;
  component.event_count = ARMOR_COUNT(events);
  component.reads_all = true;
  component.user = &it;
  component.create = create;
  component.parameter_received = parameter_received;
  component.data_received = data_received;
  component.exec = exec;
  return armor_run(argc, argv, &component);
}
