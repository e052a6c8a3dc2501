// The history of an input: newest first, nearest, around, and what is refused.

#include <armor_messages.h>

#include "check.h"

typedef struct self {
  const armor_handle *armor;
  int received;
} self;

static int create(const armor_handle *armor, void *user) {
  ((self *)user)->armor = armor;
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "steps", armor_count, 0));
  return ARMOR_SUBSCRIBE(armor, "scan", armor_laser_scan, 0);
}

static void check_steps(const armor_data *data) {
  size_t len = 0;
  CHECK_OK(armor_history_len(data, NULL, NULL, &len));
  CHECK(len == 3);
  armor_past past;
  armor_count count;
  for (size_t age = 0; age < len; ++age) {
    CHECK_OK(ARMOR_HISTORY_DECODE(data, "steps", NULL, age, armor_count, &count));
    CHECK(count.count == 3 - age);
    CHECK_OK(armor_history_get(data, "steps", "test.steps", age, &past));
    CHECK(past.sequence == 2 - age && past.stamp_s == 1002.0 - (double)age && !past.follows_gap);
  }
  CHECK_FAILS(armor_history_get(data, NULL, NULL, 3, &past), ARMOR_ERROR_NO_MESSAGE, "has 3 messages");
  CHECK(armor_history_bytes(data, NULL, NULL, 3, &len) == NULL);
  CHECK(armor_history_bytes(data, NULL, NULL, 2, &len)[0] == 1 && len == 8);
  CHECK(armor_history_nearest(data, NULL, NULL, 1000.9) == 1);
  size_t earlier = 0;
  CHECK(armor_history_around(data, NULL, NULL, 1000.5, &earlier) == 1 && earlier == 2);
  CHECK(armor_history_around(data, NULL, NULL, 1001.0, &earlier) == 1 && earlier == 1);
  CHECK(armor_history_around(data, NULL, NULL, 999.0, &earlier) == ARMOR_NO_AGE && earlier == ARMOR_NO_AGE);
  // Of another input, which has not received anything.
  CHECK_OK(armor_history_len(data, "scan", NULL, &len));
  CHECK(len == 0 && armor_history_nearest(data, "scan", NULL, 1000.0) == ARMOR_NO_AGE);
  CHECK_FAILS(armor_history_len(data, "none", NULL, &len), ARMOR_ERROR_UNKNOWN_PORT, "no input `none`");
  CHECK_FAILS(armor_history_len(data, "steps", "a.b", &len), ARMOR_ERROR_UNKNOWN_PORT, "`a.b` does not feed");
  CHECK_FAILS(armor_history_len(NULL, NULL, NULL, &len), ARMOR_ERROR_NULL, "data is NULL");
  armor_flag flag;
  CHECK_FAILS(ARMOR_HISTORY_DECODE(data, NULL, NULL, 0, armor_flag, &flag), ARMOR_ERROR_OTHER_TYPE,
              "declared as Count");
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  self *it = user;
  CHECK(strcmp(header->id, "steps") == 0);
  if (++it->received == 3) check_steps(data);
  return ARMOR_ERROR_NONE;
}

int main(void) {
  self it = {0};
  armor_component component = {0};
  component.kind = "stepper";
  component.summary = "Reads a history.";
  component.user = &it;
  component.create = create;
  component.data_received = data_received;
  armor_test *test = armor_test_build(&component, NULL, 0);
  CHECK(test != NULL);
  CHECK_OK(armor_test_start(test));
  for (uint64_t step = 1; step <= 3; ++step) {
    armor_count count = {step};
    CHECK_OK(ARMOR_TEST_SEND(test, "steps", armor_count, &count));
    CHECK_OK(armor_test_pass_time(test, 1.0));
  }
  CHECK(it.received == 3);
  armor_test_free(test);
  return 0;
}
