// The joystick as a component: the device in, velocities out while the dead man's button is held.

#include <armor_messages.h>
#include <string.h>

#include "component.h"
#include "joystick.h"

// How long it waits until it looks for an absent device again, in seconds.
#define LOOK_PERIOD_S 1.0

typedef struct ports {
  const armor_handle *armor;
  joystick device;
  joystick_mapping mapping;
  char path[4096];
  double look_at_s;
  bool is_held;
  bool was_absent;
} ports;

static ports state;

static int create(const armor_handle *armor, void *user) {
  ports *it = user;
  joystick_close(&it->device);
  it->armor = armor;
  ARMOR_TRY(ARMOR_PROVIDE(armor, "velocity", armor_twist, 0));
  ARMOR_TRY(ARMOR_PROVIDE(armor, "held", armor_flag, ARMOR_LATCHED));
  const char *names[] = {"device", "forward_axis", "turn_axis", "button", "speed", "turn", "dead_zone"};
  for (size_t index = 0; index < ARMOR_COUNT(names); ++index) {
    ARMOR_TRY(armor_get_parameter(armor, names[index]));
  }
  return ARMOR_ERROR_NONE;
}

static int read_index(const armor_value *value, int *index) {
  int64_t number = 0;
  ARMOR_TRY(armor_value_integer(value, &number));
  *index = (int)number;
  return ARMOR_ERROR_NONE;
}

static int parameter_received(void *user, const char *name, const armor_value *value) {
  ports *it = user;
  if (strcmp(name, "device") == 0) {
    const char *path = armor_value_path(value);
    if (path == NULL || strlen(path) >= sizeof it->path) {
      return armor_fail("device: the path is too long");
    }
    strcpy(it->path, path);
    return ARMOR_ERROR_NONE;
  }
  if (strcmp(name, "forward_axis") == 0) return read_index(value, &it->mapping.forward_axis);
  if (strcmp(name, "turn_axis") == 0) return read_index(value, &it->mapping.turn_axis);
  if (strcmp(name, "button") == 0) return read_index(value, &it->mapping.held_button);
  if (strcmp(name, "speed") == 0) return armor_value_number(value, &it->mapping.speed);
  if (strcmp(name, "turn") == 0) return armor_value_number(value, &it->mapping.turn);
  return armor_value_number(value, &it->mapping.dead_zone);
}

static int send_velocity(const ports *it) {
  armor_twist twist = {0};
  joystick_velocity(&it->device, &it->mapping, &twist.linear.x, &twist.angular.z);
  return ARMOR_SEND(it->armor, "velocity", armor_twist, &twist);
}

static int send_held(const ports *it) {
  const armor_flag flag = {it->is_held};
  return ARMOR_SEND(it->armor, "held", armor_flag, &flag);
}

// Opens the device if it is absent, and reads it. What changes is logged once.
static void update_device(ports *it) {
  if (it->device.file < 0) {
    const double now_s = armor_timestamp(it->armor);
    if (now_s < it->look_at_s) {
      return;
    }
    it->look_at_s = now_s + LOOK_PERIOD_S;
    const int error = joystick_open(&it->device, it->path);
    if (error != 0) {
      if (!it->was_absent) {
        armor_write_log(30, "%s: %s; waiting for it", it->path, strerror(error));
      }
      it->was_absent = true;
      return;
    }
    armor_write_log(20, "%s is open", it->path);
    it->was_absent = false;
  }
  const bool was_present = it->device.state == JOYSTICK_PRESENT;
  const int error = joystick_read(&it->device);
  if (error != 0) {
    if (was_present) {
      armor_write_log(30, "%s is gone: %s; waiting for it", it->path, strerror(error));
    }
    it->was_absent = true;
    it->look_at_s = armor_timestamp(it->armor) + LOOK_PERIOD_S;
  }
}

static armor_outcome step(ports *it) {
  update_device(it);
  const bool is_held = joystick_is_held(&it->device, &it->mapping);
  const bool has_changed = is_held != it->is_held;
  it->is_held = is_held;
  // After the button is released one velocity of 0 follows; then other writers have the robot.
  if ((is_held || has_changed) && send_velocity(it) != ARMOR_ERROR_NONE) {
    return armor_failed_with_last_error();
  }
  if (!has_changed) {
    return armor_carry_on();
  }
  if (send_held(it) != ARMOR_ERROR_NONE) {
    return armor_failed_with_last_error();
  }
  return armor_report_event(is_held ? "held" : "released", 0.0);
}

static armor_outcome execute(void *user, int call) {
  ports *it = user;
  switch (call) {
    case ARMOR_CALL_STARTED:
      it->is_held = false;
      it->look_at_s = 0.0;
      it->was_absent = false;
      update_device(it);
      return send_held(it) == ARMOR_ERROR_NONE ? armor_carry_on() : armor_failed_with_last_error();
    case ARMOR_CALL_TICK:
      return step(it);
    case ARMOR_CALL_STOPPING:
      joystick_close(&it->device);
      if (it->is_held && send_velocity(it) != ARMOR_ERROR_NONE) {
        return armor_failed_with_last_error();
      }
      it->is_held = false;
      return armor_carry_on();
    default:
      return armor_carry_on();
  }
}

static const armor_parameter parameters[] = {
    {.name = "device", .kind = ARMOR_PARAMETER_TYPE_PATH, .default_value = "/dev/input/js0",
     .doc = "the joystick; it may be plugged in later"},
    {.name = "forward_axis", .kind = ARMOR_PARAMETER_TYPE_INTEGER, .default_value = "1", .minimum = 0,
     .maximum = JOYSTICK_PARTS - 1, .doc = "axis for ahead (up) and back"},
    {.name = "turn_axis", .kind = ARMOR_PARAMETER_TYPE_INTEGER, .default_value = "0", .minimum = 0,
     .maximum = JOYSTICK_PARTS - 1, .doc = "axis for the turn, to the left and to the right"},
    {.name = "button", .kind = ARMOR_PARAMETER_TYPE_INTEGER, .default_value = "4", .minimum = 0,
     .maximum = JOYSTICK_PARTS - 1, .doc = "dead man's button: the robot obeys while it is held"},
    {.name = "speed", .kind = ARMOR_PARAMETER_TYPE_NUMBER, .unit = "m/s", .default_value = "0.5m/s",
     .minimum = 0, .maximum = 5, .live = true, .doc = "speed at the end of the stick"},
    {.name = "turn", .kind = ARMOR_PARAMETER_TYPE_NUMBER, .unit = "rad/s", .default_value = "1rad/s",
     .minimum = 0, .maximum = 10, .live = true, .doc = "turn rate at the end of the stick"},
    {.name = "dead_zone", .kind = ARMOR_PARAMETER_TYPE_NUMBER, .default_value = "0.1", .minimum = 0,
     .maximum = 0.9, .live = true, .doc = "share of the stick's way in which it counts as released"},
};

static const armor_port_text texts[] = {
    {.port = "velocity", .doc = "speed and turn rate, at every tick while the button is held"},
    {.port = "held", .doc = "whether the button is held"},
};

static const armor_event events[] = {
    {.name = "held", .doc = "the dead man's button is pressed"},
    {.name = "released", .doc = "the dead man's button is released, or the device is gone"},
};

const armor_component component = {
    .kind = "joystick",
    .summary = "Drives a robot by a joystick while its dead man's button is held.",
    .parameters = parameters,
    .parameter_count = ARMOR_COUNT(parameters),
    .ports = texts,
    .port_count = ARMOR_COUNT(texts),
    .events = events,
    .event_count = ARMOR_COUNT(events),
    .never_done = true,
    .needs_rate = true,
    .user = &state,
    .create = create,
    .parameter_received = parameter_received,
    .exec = execute,
};
