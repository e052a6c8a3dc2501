#include "joystick.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

// An event of the kernel (linux/joystick.h): a time of 4 bytes, a value of 2, a type and a number of 1.
#define EVENT_LEN 8
#define TYPE_BUTTON 1
#define TYPE_AXIS 2
#define TYPE_INITIAL 0x80

void joystick_init(joystick *it) {
  memset(it, 0, sizeof *it);
  it->file = -1;
}

int joystick_open(joystick *it, const char *path) {
  if (it->file >= 0) {
    return 0;
  }
  const int file = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) {
    return errno;
  }
  joystick_init(it);
  it->file = file;
  it->state = JOYSTICK_SILENT;
  return 0;
}

void joystick_close(joystick *it) {
  if (it->file >= 0) {
    close(it->file);
  }
  joystick_init(it);
}

void joystick_handle(joystick *it, uint8_t type, uint8_t number, int16_t value) {
  if (number >= JOYSTICK_PARTS) {
    return;
  }
  switch (type & ~TYPE_INITIAL) {
    case TYPE_BUTTON:
      it->buttons[number] = value != 0;
      break;
    case TYPE_AXIS:
      it->axes[number] = value;
      break;
    default:
      return;
  }
  it->state = JOYSTICK_PRESENT;
}

// Handles the events in these bytes; keeps the beginning of one that is not complete.
static void handle_bytes(joystick *it, const unsigned char *bytes, size_t len) {
  for (size_t index = 0; index < len; ++index) {
    it->partial[it->partial_len++] = bytes[index];
    if (it->partial_len == EVENT_LEN) {
      int16_t value;
      memcpy(&value, it->partial + 4, sizeof value);
      joystick_handle(it, it->partial[6], it->partial[7], value);
      it->partial_len = 0;
    }
  }
}

int joystick_read(joystick *it) {
  unsigned char bytes[64 * EVENT_LEN];
  while (it->file >= 0) {
    struct pollfd ready = {.fd = it->file, .events = POLLIN};
    const int count = poll(&ready, 1, 0);
    if (count == 0) {
      return 0;
    }
    const ssize_t len = count < 0 ? -1 : read(it->file, bytes, sizeof bytes);
    if (len > 0) {
      handle_bytes(it, bytes, (size_t)len);
    } else if (len == 0) {
      // The other end of a pipe, which stands in for a device, is closed; nothing has come from one that
      // has not been opened yet.
      joystick_close(it);
      return ENODEV;
    } else if (errno == EAGAIN) {
      return 0;
    } else if (errno != EINTR) {
      const int error = errno;
      joystick_close(it);
      return error;
    }
  }
  return 0;
}

bool joystick_is_held(const joystick *it, const joystick_mapping *mapping) {
  return it->state == JOYSTICK_PRESENT && it->buttons[mapping->held_button];
}

// The position of an axis, -1 to 1, 0 within the dead zone and without a step at its end.
static double position(int16_t value, double dead_zone) {
  double share = value / 32767.0;
  share = share < -1.0 ? -1.0 : share;
  const double size = share < 0.0 ? -share : share;
  if (size <= dead_zone) {
    return 0.0;
  }
  const double beyond = (size - dead_zone) / (1.0 - dead_zone);
  return share < 0.0 ? -beyond : beyond;
}

void joystick_velocity(const joystick *it, const joystick_mapping *mapping, double *forward_mps,
                       double *turn_radps) {
  *forward_mps = 0.0;
  *turn_radps = 0.0;
  if (!joystick_is_held(it, mapping)) {
    return;
  }
  // The kernel counts down and right as positive; REP-103 ahead and left. Adding 0 avoids -0.
  *forward_mps = -position(it->axes[mapping->forward_axis], mapping->dead_zone) * mapping->speed + 0.0;
  *turn_radps = -position(it->axes[mapping->turn_axis], mapping->dead_zone) * mapping->turn + 0.0;
}
