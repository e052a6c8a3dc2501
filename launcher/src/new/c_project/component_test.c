// The component without a system: its time passes only in armor_test_tick_after.

#include <stdio.h>

#include <armor_messages.h>

#include "component.h"

#define CHECK(condition)                                                                      \
  do {                                                                                        \
    if (!(condition)) {                                                                       \
      fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #condition, armor_last_error()); \
      return 1;                                                                               \
    }                                                                                         \
  } while (0)

int main(void) {
  const armor_setting settings[] = {{"step", "2"}};
  armor_test *test = armor_test_build(&component, settings, ARMOR_COUNT(settings));
  CHECK(test != NULL);
  CHECK(armor_test_start(test) == ARMOR_ERROR_NONE);
  for (int tick = 0; tick < 3; ++tick) {
    CHECK(armor_test_tick_after(test, 0.1) == ARMOR_ERROR_NONE);
  }
  CHECK(armor_test_output_count(test, "count") == 3);
  armor_count last;
  CHECK(ARMOR_TEST_OUTPUT(test, "count", 2, armor_count, &last) == ARMOR_ERROR_NONE);
  CHECK(last.count == 6);
  CHECK(armor_test_report_count(test) == 0);
  armor_test_free(test);
  return 0;
}
