// Messages of any type: passed on when they arrive, and later.

#include <armor_messages.h>

#include "check.h"

typedef struct self {
  const armor_handle *armor;
  armor_any *first;
  uint64_t received;
} self;

// The messages before this one have their type, too.
static void check_past(const armor_data *data, uint64_t received) {
  for (size_t age = 0; age < received; ++age) {
    armor_any *past = armor_history_any(data, NULL, NULL, age);
    CHECK(past != NULL && strcmp(armor_any_schema(past), "Count{count:u64}") == 0);
    armor_past header;
    CHECK_OK(armor_history_get(data, NULL, NULL, age, &header));
    CHECK(armor_any_stamp(past) == header.stamp_s);
    size_t len = 0;
    CHECK(armor_any_bytes(past, &len)[0] == received - age && len == 8);
    armor_any_free(past);
  }
  CHECK(armor_history_any(data, NULL, NULL, received) == NULL);
  CHECK(strstr(armor_last_error(), "none of the age") != NULL);
  CHECK(armor_history_any(NULL, NULL, NULL, 0) == NULL);
}

static int create(const armor_handle *armor, void *user) {
  self *it = user;
  it->armor = armor;
  ARMOR_TRY(armor_subscribe_schema(armor, "in", ARMOR_ANY, ARMOR_MANY));
  ARMOR_TRY(ARMOR_SUBSCRIBE(armor, "typed", armor_count, ARMOR_OPTIONAL));
  ARMOR_TRY(armor_provide_schema(armor, "out", ARMOR_ANY, 0));
  return armor_provide_schema(armor, "first", ARMOR_ANY, ARMOR_LATCHED);
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  self *it = user;
  armor_any *any = armor_any_received(data);
  if (strcmp(header->id, "typed") == 0) {
    CHECK(any == NULL && strstr(armor_last_error(), "declared as Count, but was decoded as Any") != NULL);
    CHECK(armor_history_any(data, NULL, NULL, 0) == NULL);
    CHECK(strstr(armor_last_error(), "declared as Count, but was decoded as Any") != NULL);
    return ARMOR_ERROR_NONE;
  }
  CHECK(any != NULL && armor_any_stamp(any) == header->stamp_s);
  CHECK(strcmp(armor_any_type(any), "Count") == 0);
  CHECK(strcmp(armor_any_schema(any), "Count{count:u64}") == 0);
  size_t len = 0, data_len = 0;
  const uint8_t *bytes = armor_any_bytes(any, &len);
  CHECK(memcmp(bytes, armor_data_bytes(data, &data_len), 8) == 0 && len == 8 && data_len == 8);
  check_past(data, ++it->received);
  const int sent = armor_send_any(it->armor, "out", any);
  if (it->first == NULL) it->first = any;
  else armor_any_free(any);
  return sent;
}

static armor_outcome exec(void *user, int call) {
  self *it = user;
  if (call != ARMOR_CALL_TICK) return armor_carry_on();
  CHECK_OK(armor_send_any(it->armor, "first", it->first));
  const armor_count count = {1};
  CHECK_FAILS(ARMOR_SEND(it->armor, "out", armor_count, &count), ARMOR_ERROR_OTHER_TYPE, "out` is declared as");
  CHECK_FAILS(armor_send_any(it->armor, "none", it->first), ARMOR_ERROR_UNKNOWN_PORT, "no output `none`");
  CHECK_FAILS(armor_send_any(it->armor, "out", NULL), ARMOR_ERROR_NULL, "any is NULL");
  return armor_carry_on();
}

int main(void) {
  self it = {0};
  armor_component component = {0};
  component.kind = "passer";
  component.summary = "Passes messages on.";
  component.user = &it;
  component.create = create;
  component.data_received = data_received;
  component.exec = exec;
  armor_test *test = armor_test_build(&component, NULL, 0);
  CHECK(test != NULL);
  CHECK_OK(armor_test_start(test));
  armor_count count;
  for (uint64_t step = 1; step <= 3; ++step) {
    count.count = step;
    CHECK_OK(ARMOR_TEST_SEND(test, "in", armor_count, &count));
  }
  CHECK_OK(ARMOR_TEST_SEND(test, "typed", armor_count, &count));
  CHECK_OK(armor_test_tick_after(test, 0.1));
  CHECK(armor_test_output_count(test, "out") == 3 && armor_test_output_count(test, "first") == 1);
  for (size_t index = 0; index < 3; ++index) {
    CHECK_OK(ARMOR_TEST_OUTPUT(test, "out", index, armor_count, &count));
    CHECK(count.count == index + 1);
  }
  CHECK_OK(ARMOR_TEST_OUTPUT(test, "first", 0, armor_count, &count));
  CHECK(count.count == 1);
  const armor_flag flag = {true};
  CHECK_FAILS(ARMOR_TEST_SEND(test, "in", armor_flag, &flag), ARMOR_ERROR_TEST, "which input `in` does not take");
  CHECK(armor_any_type(NULL) == NULL && armor_any_schema(NULL) == NULL && armor_any_received(NULL) == NULL);
  armor_any_free(NULL);
  armor_any_free(it.first);
  armor_test_free(test);
  return 0;
}
