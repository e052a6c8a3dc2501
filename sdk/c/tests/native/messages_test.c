// Structs of C as messages: every form of a field there and back, and what is refused.

#include <armor_messages.h>
#include <math.h>
#include <stdint.h>

#include "check.h"

typedef enum mode { MODE_OFF, MODE_ON } mode;
ARMOR_ENUM(mode, "Mode", "Off", "On");

typedef struct part {
  uint8_t number;
  armor_string name;
  armor_f64_list values;
} part;
ARMOR_STRUCT(part, "Part", ARMOR_FIELD(part, number, ""), ARMOR_FIELD(part, name, ""),
             ARMOR_LIST(part, values, "m"));

typedef struct every {
  bool is_on;
  uint8_t u8;
  int8_t i8;
  uint16_t u16;
  int16_t i16;
  uint32_t u32;
  int32_t i32;
  uint64_t u64;
  int64_t i64;
  float f32;
  double f64;
  armor_string text;
  double fixed[3];
  armor_f32_list list;
  armor_string_list texts;
  part nested;
  part two[2];
  ARMOR_LIST_OF(part) parts;
  mode mode;
  struct {
    bool is_present;
    double value;
  } depth;
  struct {
    bool is_present;
    part value;
  } spare;
  bool flags[3];
} every;
ARMOR_STRUCT(every, "Every", ARMOR_FIELD(every, is_on, ""), ARMOR_FIELD(every, u8, ""),
             ARMOR_FIELD(every, i8, ""), ARMOR_FIELD(every, u16, ""), ARMOR_FIELD(every, i16, ""),
             ARMOR_FIELD(every, u32, ""), ARMOR_FIELD(every, i32, ""), ARMOR_FIELD(every, u64, ""),
             ARMOR_FIELD(every, i64, ""), ARMOR_FIELD(every, f32, ""), ARMOR_FIELD(every, f64, "m/s"),
             ARMOR_FIELD(every, text, ""), ARMOR_ARRAY(every, fixed, "rad"),
             ARMOR_LIST(every, list, ""), ARMOR_LIST(every, texts, ""),
             ARMOR_NESTED(every, nested, part, ""), ARMOR_NESTED_ARRAY(every, two, part),
             ARMOR_NESTED_LIST(every, parts, part), ARMOR_NESTED(every, mode, mode, ""),
             ARMOR_OPTIONAL_FIELD(every, depth, "m"), ARMOR_OPTIONAL_NESTED(every, spare, part),
             ARMOR_ARRAY(every, flags, ""));

// Has the name of another struct, and other fields.
typedef struct other {
  double f64;
} other;
ARMOR_STRUCT(other, "Every", ARMOR_FIELD(other, f64, ""));

static const armor_handle *armor;
static int decoded;
static const void *image_bytes;
static armor_kept *kept;

static int create(const armor_handle *handle, void *user) {
  (void)user;
  armor = handle;
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "in", every, 0));
  ARMOR_TRY(ARMOR_PROVIDE(handle, "out", every, 0));
  ARMOR_TRY(ARMOR_SUBSCRIBE(handle, "image", armor_image, ARMOR_OPTIONAL));
  return ARMOR_PROVIDE(handle, "image-back", armor_image, ARMOR_LATCHED);
}

static int data_received(void *user, const armor_header *header, const armor_data *data) {
  (void)user;
  if (strcmp(header->id, "image") == 0) {
    armor_image image;
    ARMOR_TRY(ARMOR_DECODE(data, armor_image, &image));
    size_t len = 0;
    const uint8_t *bytes = armor_data_bytes(data, &len);
    CHECK(image.data.data >= bytes && image.data.data + image.data.len <= bytes + len);
    image_bytes = bytes;
    armor_kept_free(kept);
    kept = armor_keep(data);
    return ARMOR_SEND(armor, "image-back", armor_image, &image);
  }
  CHECK(strcmp(header->data, "test.in") == 0 && header->stamp_s == 1000.0 && header->lost == 0);
  other wrong;
  CHECK_FAILS(ARMOR_DECODE(data, other, &wrong), ARMOR_ERROR_OTHER_TYPE, "with other fields");
  every message;
  ARMOR_TRY(ARMOR_DECODE(data, every, &message));
  ++decoded;
  return ARMOR_SEND(armor, "out", every, &message);
}

static const armor_component component = {.kind = "echo",
                                          .summary = "Sends back what it receives.",
                                          .create = create,
                                          .data_received = data_received};

static void check_part(const part *given, uint8_t number, const char *name, double value) {
  CHECK(given->number == number && armor_string_equals(given->name, name));
  CHECK(strlen(given->name.data) == given->name.len);
  CHECK(given->values.len == 2 && given->values.data[0] == value && given->values.data[1] == -value);
}

int main(void) {
  armor_test *test = armor_test_build(&component, NULL, 0);
  CHECK(test != NULL);
  CHECK_FAILS(armor_test_tick_after(test, 0.1), ARMOR_ERROR_NOT_ACTIVE, "start it first");
  CHECK_OK(armor_test_start(test));

  const double near[] = {1.5, -1.5}, far[] = {7.0, -7.0};
  const part parts[] = {{1, armor_string_of("one"), {near, 2}}, {2, armor_string_of("zw\xc3\xb6i"), {far, 2}}};
  float list[500];
  for (int index = 0; index < 500; ++index) list[index] = (float)index;
  const armor_string texts[] = {armor_string_of("a"), armor_string_of("")};
  every message = {.is_on = true, .u8 = 255, .i8 = -128, .u16 = 65535, .i16 = -32768};
  message.u32 = UINT32_MAX, message.i32 = INT32_MIN;
  message.u64 = UINT64_MAX, message.i64 = INT64_MIN, message.f32 = 0.5f, message.f64 = INFINITY;
  message.text = armor_string_of("text");
  message.fixed[2] = 3.0;
  message.list.data = list, message.list.len = 500;
  message.texts.data = texts, message.texts.len = 2;
  message.nested = parts[0], message.two[1] = parts[1];
  message.parts.data = parts, message.parts.len = 2;
  message.mode = MODE_ON;
  message.depth.is_present = true, message.depth.value = 2.5;
  message.flags[1] = true;
  CHECK_OK(ARMOR_TEST_SEND(test, "in", every, &message));
  message.spare.is_present = true, message.spare.value = parts[1], message.depth.is_present = false;
  CHECK_OK(ARMOR_TEST_SEND(test, "in", every, &message));
  CHECK(decoded == 2 && armor_test_output_count(test, "out") == 2);

  for (size_t index = 0; index < 2; ++index) {
    every back;
    CHECK_OK(ARMOR_TEST_OUTPUT(test, "out", index, every, &back));
    CHECK(back.is_on && back.u8 == 255 && back.i8 == -128 && back.u16 == 65535 && back.i16 == -32768);
    CHECK(back.u32 == UINT32_MAX && back.i32 == INT32_MIN && back.u64 == UINT64_MAX);
    CHECK(back.i64 == INT64_MIN && back.f32 == 0.5f && isinf(back.f64));
    CHECK(armor_string_equals(back.text, "text") && back.fixed[2] == 3.0);
    CHECK(back.list.len == 500 && memcmp(back.list.data, list, sizeof list) == 0);
    CHECK(back.texts.len == 2 && armor_string_equals(back.texts.data[0], "a"));
    CHECK(back.texts.data[1].len == 0);
    check_part(&back.nested, 1, "one", 1.5);
    check_part(&back.two[1], 2, "zw\xc3\xb6i", 7.0);
    CHECK(back.two[0].values.len == 0 && back.parts.len == 2);
    check_part(&back.parts.data[1], 2, "zw\xc3\xb6i", 7.0);
    CHECK(back.mode == MODE_ON && !back.flags[0] && back.flags[1]);
    CHECK(back.depth.is_present == (index == 0) && back.spare.is_present == (index == 1));
    if (index == 1) check_part(&back.spare.value, 2, "zw\xc3\xb6i", 7.0);
  }

  // What is refused is not sent.
  message.text = armor_string_of("\xff");
  CHECK_FAILS(ARMOR_TEST_SEND(test, "in", every, &message), ARMOR_ERROR_NOT_UTF8, "not UTF-8");
  message.text = armor_string_of("text");
  message.mode = (mode)7;
  CHECK_FAILS(ARMOR_TEST_SEND(test, "in", every, &message), ARMOR_ERROR_MALFORMED, "7 is no value");
  message.mode = MODE_OFF;
  message.list.data = NULL;
  CHECK_FAILS(ARMOR_TEST_SEND(test, "in", every, &message), ARMOR_ERROR_NULL, "length 500");
  const uint8_t short_bytes[] = {1, 255};
  const armor_piece piece = {short_bytes, sizeof short_bytes};
  CHECK_FAILS(armor_test_send_bytes(test, "in", "Count{count:u64}", &piece, 1), ARMOR_ERROR_OTHER_TYPE,
              "is declared as Every");

  // A bulk array of bytes is where it has arrived; a kept one outlives the call.
  uint8_t pixels[4000];
  memset(pixels, 9, sizeof pixels);
  armor_image image = {.width = 40, .height = 100, .encoding = armor_string_of("mono8")};
  image.data.data = pixels, image.data.len = sizeof pixels;
  CHECK_OK(ARMOR_TEST_SEND(test, "image", armor_image, &image));
  CHECK(image_bytes != NULL && kept != NULL);
  armor_image again;
  CHECK_OK(ARMOR_DECODE_KEPT(kept, armor_image, &again));
  CHECK(again.data.len == sizeof pixels && again.data.data[3999] == 9);
  armor_kept_free(kept);
  armor_kept_free(NULL);
  armor_test_free(test);
  puts("messages of C: passed");
  return 0;
}
