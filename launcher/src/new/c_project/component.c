// {{Type}}: counts its steps and publishes the count.

#include "component.h"

#include <armor_messages.h>

typedef struct counter {
  const armor_handle *armor;
  int64_t step;
  uint64_t count;
} counter;

static counter state;

// Declares the ports and requests the parameters. Runs for --describe too, so it opens no hardware or
// files: `execute` does, at ARMOR_CALL_STARTED.
static int create(const armor_handle *armor, void *user) {
  counter *self = user;
  *self = (counter){.armor = armor};
  ARMOR_TRY(ARMOR_PROVIDE(armor, "count", armor_count, 0));
  return armor_get_parameter(armor, "step");
}

static int parameter_received(void *user, const char *name, const armor_value *value) {
  counter *self = user;
  if (strcmp(name, "step") == 0) {
    return armor_value_integer(value, &self->step);
  }
  return armor_fail("there is no parameter %s", name);
}

static armor_outcome execute(void *user, int call) {
  counter *self = user;
  if (call == ARMOR_CALL_TICK) {
    self->count += (uint64_t)self->step;
    armor_count message = {.count = self->count};
    if (ARMOR_SEND(self->armor, "count", armor_count, &message) != ARMOR_ERROR_NONE) {
      return armor_failed_with_last_error();
    }
  }
  return armor_carry_on();
}

static const armor_parameter parameters[] = {
    {.name = "step",
     .kind = ARMOR_PARAMETER_TYPE_INTEGER,
     .default_value = "1",
     .minimum = 1,
     .maximum = 1000,
     .doc = "added at each step"},
};

static const armor_port_text ports[] = {{.port = "count", .doc = "the sum so far"}};

const armor_component component = {
    .kind = "{{name}}",
    .summary = "Counts its steps.",
    .parameters = parameters,
    .parameter_count = ARMOR_COUNT(parameters),
    .ports = ports,
    .port_count = ARMOR_COUNT(ports),
    .user = &state,
    .create = create,
    .parameter_received = parameter_received,
    .exec = execute,
};
