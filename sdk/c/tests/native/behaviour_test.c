// Components of C: parameters, events, failures, and calls that are wrong.

#include <armor_messages.h>

#include "check.h"

typedef struct self {
  const armor_handle *armor;
  double speed;
  int64_t count;
  bool is_loud;
  char name[32];
  char file[64];
  char calls[32];
  const char *wrong;
} self;

static int create(const armor_handle *armor, void *user) {
  self *it = user;
  it->armor = armor;
  CHECK_OK(ARMOR_PROVIDE(armor, "out", armor_count, 0));
  CHECK_FAILS(ARMOR_PROVIDE(armor, "out", armor_count, 0), ARMOR_ERROR_DECLARATION, "declared twice");
  CHECK_FAILS(ARMOR_PROVIDE(armor, "7 up", armor_count, 0), ARMOR_ERROR_NAME, "not a name");
  CHECK_FAILS(armor_provide(armor, "x", NULL, 0), ARMOR_ERROR_NULL, "NULL");
  CHECK_FAILS(armor_provide(NULL, "x", &armor_count_type, 0), ARMOR_ERROR_NULL, "handle is NULL");
  CHECK_FAILS(armor_provide_schema(armor, "x", "Count{", 0), ARMOR_ERROR_TABLE, "schema text");
  const armor_field outside[] = {{"x", "", ARMOR_FIELD_KIND_F64, ARMOR_FIELD_FORM_ONE, 4, 0, NULL, false, 0}};
  const armor_type bad = {"Bad", 8, 8, outside, 1, NULL, 0};
  CHECK_FAILS(armor_provide(armor, "x", &bad, 0), ARMOR_ERROR_TABLE, "field x: it ends after the 8 bytes");
  const armor_field old[] = {{"x", "furlong", ARMOR_FIELD_KIND_F64, ARMOR_FIELD_FORM_ONE, 0, 0, NULL, false, 0}};
  const armor_type no_unit = {"Old", 8, 8, old, 1, NULL, 0};
  CHECK_FAILS(armor_provide(armor, "x", &no_unit, 0), ARMOR_ERROR_TABLE, "there is no unit `furlong`; the units are");
  armor_type loop = {"Loop", 8, 8, NULL, 1, NULL, 0};
  const armor_field itself[] = {{"x", "", ARMOR_FIELD_KIND_NESTED, ARMOR_FIELD_FORM_ONE, 0, 0, &loop, false, 0}};
  loop.fields = itself;
  CHECK_FAILS(armor_provide(armor, "x", &loop, 0), ARMOR_ERROR_TABLE, "does one contain itself?");
  CHECK_FAILS(armor_get_parameter(armor, "7 up"), ARMOR_ERROR_NAME, "not a name");
  CHECK(strcmp(armor_provided_data(armor, "out"), "speaker.out") == 0);
  CHECK(armor_provided_data(armor, "none") == NULL && armor_subscribed_data(armor, "out") == NULL);
  const char *names[] = {"speed", "count", "loud", "name", "file"};
  for (size_t index = 0; index < ARMOR_COUNT(names); ++index) {
    ARMOR_TRY(armor_get_parameter(armor, names[index]));
  }
  return armor_synchronize(armor);
}

static int parameter_received(void *user, const char *name, const armor_value *value) {
  self *it = user;
  if (strcmp(name, "speed") == 0) {
    double speed = 0.0;
    bool flag;
    CHECK_FAILS(armor_value_flag(value, &flag), ARMOR_ERROR_PARAMETER, "is not a flag");
    CHECK(armor_value_text(value) == NULL);
    ARMOR_TRY(armor_value_number(value, &speed));
    if (speed == 0.5) return armor_fail("%s is not %g m/s", name, speed);
    it->speed = speed;
  } else if (strcmp(name, "count") == 0) {
    return armor_value_integer(value, &it->count);
  } else if (strcmp(name, "loud") == 0) {
    return armor_value_flag(value, &it->is_loud);
  } else if (strcmp(name, "file") == 0) {
    snprintf(it->file, sizeof it->file, "%s", armor_value_path(value));
  } else {
    snprintf(it->name, sizeof it->name, "%s", armor_value_text(value));
  }
  return ARMOR_ERROR_NONE;
}

static armor_outcome execute(void *user, int call) {
  self *it = user;
  strncat(it->calls, &"STDX"[call], 1);
  if (call != ARMOR_CALL_TICK) return armor_carry_on();
  armor_count message = {7};
  armor_pose2d pose = {0};
  CHECK_FAILS(ARMOR_SEND(it->armor, "out", armor_pose2d, &pose), ARMOR_ERROR_OTHER_TYPE, "declared as Count");
  CHECK_FAILS(ARMOR_SEND(it->armor, "none", armor_count, &message), ARMOR_ERROR_UNKNOWN_PORT, "no output `none`");
  CHECK_OK(ARMOR_SEND(it->armor, "out", armor_count, &message));
  CHECK(armor_timestamp(it->armor) > 1000.0);
  if (it->wrong == NULL) return armor_report_event("spoken", 0.25);
  if (strcmp(it->wrong, "done") == 0) return armor_done();
  if (strcmp(it->wrong, "kind") == 0) return (armor_outcome){.kind = 9};
  if (strcmp(it->wrong, "event") == 0) return armor_report_event(NULL, 0.0);
  if (strcmp(it->wrong, "undeclared") == 0) return armor_report_event("sung", 0.0);
  if (strcmp(it->wrong, "last") == 0) {
    armor_fail("the last error");
    return armor_failed_with_last_error();
  }
  return armor_failed("it is %s", it->wrong);
}

static const armor_parameter parameters[] = {
    {.name = "speed", .kind = ARMOR_PARAMETER_TYPE_NUMBER, .unit = "m/s", .default_value = "0.1m/s",
     .minimum = 0, .maximum = 1, .live = true},
    {.name = "count", .kind = ARMOR_PARAMETER_TYPE_INTEGER, .default_value = "3"},
    {.name = "loud", .kind = ARMOR_PARAMETER_TYPE_FLAG, .default_value = "true"},
    {.name = "name", .kind = ARMOR_PARAMETER_TYPE_CHOICE, .default_value = "b", .choices = "a b"},
    {.name = "file", .kind = ARMOR_PARAMETER_TYPE_PATH, .default_value = "/tmp/x"},
};
static const armor_event events[] = {{.name = "spoken", .doc = "it has spoken", .has_value = true}};

static armor_component speaker(self *it) {
  return (armor_component){.kind = "speaker",
                           .summary = "Speaks.",
                           .parameters = parameters,
                           .parameter_count = ARMOR_COUNT(parameters),
                           .events = events,
                           .event_count = ARMOR_COUNT(events),
                           .user = it,
                           .create = create,
                           .parameter_received = parameter_received,
                           .exec = execute};
}

// A tick that fails, with this reason.
static void check_failure(const char *wrong, const char *reason) {
  self it = {.wrong = wrong};
  const armor_component component = speaker(&it);
  armor_test *test = armor_test_build(&component, NULL, 0);
  CHECK(test != NULL);
  CHECK_OK(armor_test_start(test));
  CHECK_FAILS(armor_test_tick_after(test, 0.1), ARMOR_ERROR_FAILED, reason);
  CHECK(armor_test_state(test) == ARMOR_STATE_FAILED);
  armor_report report;
  CHECK_OK(armor_test_report(test, armor_test_report_count(test) - 1, &report));
  CHECK(report.kind == ARMOR_OUTCOME_KIND_FAILED && strstr(report.text, reason) != NULL);
  armor_test_free(test);
}

int main(void) {
  self it = {0};
  const armor_component component = speaker(&it);
  const armor_setting settings[] = {{"speed", "20cm/s"}, {"name", "a"}};
  armor_test *test = armor_test_build(&component, settings, ARMOR_COUNT(settings));
  CHECK(test != NULL);
  CHECK(it.speed == 0.2 && it.count == 3 && it.is_loud && strcmp(it.name, "a") == 0);
  CHECK(strcmp(it.file, "/tmp/x") == 0);
  CHECK_OK(armor_test_start(test));
  CHECK_OK(armor_test_tick_after(test, 0.1));
  CHECK_FAILS(armor_test_set_parameter(test, "speed", "0.5m/s"), ARMOR_ERROR_TEST, "speed is not 0.5 m/s");
  CHECK_FAILS(armor_test_set_parameter(test, "speed", "2m/s"), ARMOR_ERROR_PARAMETER, "out of range");
  CHECK_FAILS(armor_test_set_parameter(test, "count", "4"), ARMOR_ERROR_PARAMETER, "not live");
  CHECK_OK(armor_test_set_parameter(test, "speed", "1m/s"));
  CHECK(it.speed == 1.0);
  armor_report report;
  CHECK_OK(armor_test_report(test, 0, &report));
  CHECK(report.kind == ARMOR_OUTCOME_KIND_EVENT && report.value == 0.25);
  CHECK(strcmp(report.text, "spoken") == 0);
  CHECK_FAILS(armor_test_report(test, 99, &report), ARMOR_ERROR_TEST, "index 99");
  armor_count count;
  CHECK_FAILS(ARMOR_TEST_OUTPUT(test, "out", 9, armor_count, &count), ARMOR_ERROR_TEST, "index 9");
  CHECK_FAILS(ARMOR_TEST_OUTPUT(test, "none", 0, armor_count, &count), ARMOR_ERROR_UNKNOWN_PORT, "only: out");
  it.wrong = "done";
  CHECK_OK(armor_test_tick_after(test, 0.1));
  CHECK(armor_test_state(test) == ARMOR_STATE_DONE);
  CHECK_OK(armor_test_stop(test));
  CHECK(strcmp(it.calls, "STTX") == 0);
  armor_test_free(test);

  check_failure("hoarse", "it is hoarse");
  check_failure("last", "the last error");
  check_failure("kind", "returned 9, which is no armor_outcome_kind");
  check_failure("event", "the name of an event is NULL");
  check_failure("undeclared", "sung");

  const armor_setting unknown[] = {{"volume", "1"}};
  CHECK(armor_test_build(&component, unknown, 1) == NULL);
  CHECK(strstr(armor_last_error(), "volume") != NULL);
  CHECK(armor_test_build(NULL, NULL, 0) == NULL);
  CHECK_FAILS(armor_test_start(NULL), ARMOR_ERROR_NULL, "test is NULL");
  for (int code = ARMOR_ERROR_NONE; code <= ARMOR_ERROR_INTERNAL; ++code) {
    CHECK(strlen(armor_error_text(code)) > 5);
  }
  puts("behaviour of C: passed");
  return 0;
}
