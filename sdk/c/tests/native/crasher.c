// Crashes at its fifth tick, as a driver with a wrong pointer does.

#include <armor_messages.h>
#include <signal.h>

static const armor_handle *armor;
static uint64_t ticks;

static int create(const armor_handle *handle, void *user) {
  (void)user;
  armor = handle;
  return ARMOR_PROVIDE(handle, "ticks", armor_count, 0);
}

static armor_outcome execute(void *user, int call) {
  (void)user;
  if (call != ARMOR_CALL_TICK) return armor_carry_on();
  if (++ticks == 5) raise(SIGSEGV);
  const armor_count message = {ticks};
  if (ARMOR_SEND(armor, "ticks", armor_count, &message) != ARMOR_ERROR_NONE) {
    return armor_failed_with_last_error();
  }
  return armor_carry_on();
}

static const armor_component component = {
    .kind = "crasher", .summary = "Crashes.", .never_done = true, .create = create, .exec = execute};

int main(int argc, char **argv) { return armor_run(argc, argv, &component); }
