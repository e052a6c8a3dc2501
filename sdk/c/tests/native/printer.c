// Prints in `create`, where only the manifest may be on stdout.

#include <armor_messages.h>
#include <stdio.h>

static int create(const armor_handle *handle, void *user) {
  (void)user;
  printf("opening the printer\n");
  return ARMOR_PROVIDE(handle, "count", armor_count, 0);
}

static const armor_component component = {.kind = "printer", .summary = "Prints.", .create = create};

int main(int argc, char **argv) { return armor_run(argc, argv, &component); }
