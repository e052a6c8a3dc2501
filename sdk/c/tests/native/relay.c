// Sends on what it receives: counts, and images from where they have arrived.

#include <armor_messages.h>

static const armor_handle *armor;

static int create(const armor_handle *handle, void *user) {
  (void)user;
  armor = handle;
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "count", armor_count, ARMOR_OPTIONAL));
  ARMOR_TRY(ARMOR_PROVIDE(handle, "count-back", armor_count, 0));
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "image", armor_image, ARMOR_OPTIONAL));
  return ARMOR_PROVIDE(handle, "image-back", armor_image, 0);
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  (void)user;
  if (strcmp(header->id, "count") == 0) {
    armor_count count;
    ARMOR_TRY(ARMOR_DECODE(data, armor_count, &count));
    return ARMOR_SEND(armor, "count-back", armor_count, &count);
  }
  armor_image image;
  ARMOR_TRY(ARMOR_DECODE(data, armor_image, &image));
  return ARMOR_SEND(armor, "image-back", armor_image, &image);
}

static const armor_component component = {.kind = "relay",
                                          .summary = "Sends on what it receives.",
                                          .never_done = true,
                                          .create = create,
                                          .data_received = data_received};

int main(int argc, char **argv) { return armor_run(argc, argv, &component); }
