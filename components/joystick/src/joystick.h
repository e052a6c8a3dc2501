// What a joystick of Linux reports, and the velocity that it asks for: no ports, no clock.

#ifndef JOYSTICK_H
#define JOYSTICK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Most axes and buttons that are kept; those above are ignored.
#define JOYSTICK_PARTS 32

// How a device is read.
typedef enum joystick_state {
  // There is no device, or it is gone.
  JOYSTICK_ABSENT,
  // It is open, and has not reported anything yet.
  JOYSTICK_SILENT,
  // It has reported its axes and buttons.
  JOYSTICK_PRESENT,
} joystick_state;

typedef struct joystick {
  int file;
  joystick_state state;
  int16_t axes[JOYSTICK_PARTS];
  bool buttons[JOYSTICK_PARTS];
  // The beginning of an event whose end has not arrived yet.
  unsigned char partial[8];
  size_t partial_len;
} joystick;

// What the position of a stick means.
typedef struct joystick_mapping {
  int forward_axis, turn_axis;
  int held_button;
  // m/s and rad/s at the end of the stick.
  double speed, turn;
  // The share of the stick's way in which it counts as released, 0 to 1.
  double dead_zone;
} joystick_mapping;

// A joystick without a device.
void joystick_init(joystick *it);

// Opens a device, if none is open. Returns 0, or the error number of the system.
int joystick_open(joystick *it, const char *path);

// Closes the device, if one is open, and forgets its axes and buttons.
void joystick_close(joystick *it);

// Reads all that has arrived, without waiting. A device that is gone is closed, and its buttons are
// released. Returns 0, or the error number of the system.
int joystick_read(joystick *it);

// Handles one event of the kernel: `type` 1 is a button, 2 an axis; with 0x80 its value at the start.
void joystick_handle(joystick *it, uint8_t type, uint8_t number, int16_t value);

// Whether the dead man's button is held.
bool joystick_is_held(const joystick *it, const joystick_mapping *mapping);

// Writes the velocity that the stick asks for; 0 unless the dead man's button is held.
void joystick_velocity(const joystick *it, const joystick_mapping *mapping, double *forward_mps,
                       double *turn_radps);

#endif
