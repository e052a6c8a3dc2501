// The joystick without a system; a FIFO stands in for the device.

#include <armor_messages.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../src/component.h"
#include "../src/joystick.h"

#define CHECK(condition)                                                                      \
  do {                                                                                        \
    if (!(condition)) {                                                                       \
      fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #condition, armor_last_error()); \
      exit(1);                                                                                \
    }                                                                                         \
  } while (0)
#define CHECK_OK(call) CHECK((call) == ARMOR_ERROR_NONE)

static void test_mapping(void) {
  const joystick_mapping mapping = {
      .forward_axis = 1, .turn_axis = 0, .held_button = 4, .speed = 2.0, .turn = 1.0, .dead_zone = 0.2};
  joystick it;
  joystick_init(&it);
  double forward, turn;
  joystick_handle(&it, 2, 1, -32767);
  joystick_velocity(&it, &mapping, &forward, &turn);
  CHECK(forward == 0.0 && turn == 0.0);
  joystick_handle(&it, 1, 4, 1);
  joystick_velocity(&it, &mapping, &forward, &turn);
  CHECK(forward == 2.0 && turn == 0.0);
  // At the edge of the dead zone, half of the rest, and the lowest value, which is beyond -1.
  joystick_handle(&it, 2, 1, (int16_t)(0.2 * 32767));
  joystick_handle(&it, 2, 0, (int16_t)(0.6 * 32767));
  joystick_velocity(&it, &mapping, &forward, &turn);
  CHECK(forward == 0.0 && fabs(turn + 0.5) < 1e-3);
  joystick_handle(&it, 2, 0, -32768);
  joystick_velocity(&it, &mapping, &forward, &turn);
  CHECK(turn == 1.0);
  // What no joystick has is ignored.
  joystick_handle(&it, 2, 200, 5);
  joystick_handle(&it, 7, 0, 5);
  CHECK(it.axes[0] == -32768);
}

static void write_event(int file, uint8_t type, uint8_t number, int16_t value) {
  unsigned char event[8] = {0};
  memcpy(event + 4, &value, sizeof value);
  event[6] = type;
  event[7] = number;
  // In two parts: an event may arrive in pieces.
  CHECK(write(file, event, 3) == 3 && write(file, event + 3, 5) == 5);
}

static armor_twist last_velocity(armor_test *test, size_t count) {
  armor_twist twist;
  CHECK(armor_test_output_count(test, "velocity") == count);
  CHECK_OK(ARMOR_TEST_OUTPUT(test, "velocity", count - 1, armor_twist, &twist));
  return twist;
}

static void check_event(armor_test *test, size_t index, const char *name) {
  armor_report report;
  CHECK(armor_test_report_count(test) == index + 1);
  CHECK_OK(armor_test_report(test, index, &report));
  CHECK(report.kind == ARMOR_OUTCOME_KIND_EVENT && strcmp(report.text, name) == 0);
}

int main(void) {
  test_mapping();
  char folder[] = "/tmp/armor-joystick-XXXXXX";
  CHECK(mkdtemp(folder) != NULL);
  char path[64];
  snprintf(path, sizeof path, "%s/js0", folder);
  const armor_setting settings[] = {{"device", path}, {"speed", "1m/s"}, {"dead_zone", "0"}};
  armor_test *test = armor_test_build(&component, settings, ARMOR_COUNT(settings));
  CHECK(test != NULL);

  // Without a device it waits, and publishes nothing but that the button is not held.
  CHECK_OK(armor_test_start(test));
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(armor_test_output_count(test, "velocity") == 0 && armor_test_output_count(test, "held") == 1);

  // The device is plugged in: found within a second.
  CHECK(mkfifo(path, 0600) == 0);
  // Opened for both, so that the other end may open it at any time.
  int device = open(path, O_RDWR | O_NONBLOCK);
  CHECK(device >= 0);
  CHECK_OK(armor_test_tick_after(test, 1.0));
  write_event(device, 0x81, 4, 0);
  write_event(device, 0x82, 1, 0);
  write_event(device, 2, 1, -32767);
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(armor_test_output_count(test, "velocity") == 0);

  // The button is pressed: a velocity at every tick.
  write_event(device, 1, 4, 1);
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(last_velocity(test, 1).linear.x == 1.0);
  check_event(test, 0, "held");
  CHECK_OK(armor_test_set_parameter(test, "speed", "0.5m/s"));
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(last_velocity(test, 2).linear.x == 0.5);

  // It is released: one velocity of 0, then none.
  write_event(device, 1, 4, 0);
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(last_velocity(test, 3).linear.x == 0.0);
  check_event(test, 1, "released");
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(armor_test_output_count(test, "velocity") == 3);

  // The device is pulled out while the button is held: the robot stops at the next tick.
  write_event(device, 1, 4, 1);
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(last_velocity(test, 4).linear.x == 0.5);
  close(device);
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(last_velocity(test, 5).linear.x == 0.0);
  check_event(test, 3, "released");

  // It is plugged in again: the button must be pressed again.
  device = open(path, O_RDWR | O_NONBLOCK);
  CHECK_OK(armor_test_tick_after(test, 1.0));
  CHECK(armor_test_output_count(test, "velocity") == 5);
  write_event(device, 1, 4, 1);
  write_event(device, 2, 0, 32767);
  CHECK_OK(armor_test_tick_after(test, 0.05));
  CHECK(last_velocity(test, 6).angular.z == -1.0);

  // Frozen while the button is held: the last velocity is 0.
  CHECK_OK(armor_test_stop(test));
  CHECK(last_velocity(test, 7).angular.z == 0.0);
  armor_test_free(test);
  close(device);
  unlink(path);
  rmdir(folder);
  puts("joystick: passed");
  return 0;
}
