// How structs of C are described for messages, and short forms of functions. Included by armor.h.
//
//   typedef struct reading {
//     double celsius;
//     armor_string place;
//   } reading;
//   ARMOR_STRUCT(reading, "Reading",
//     ARMOR_FIELD(reading, celsius, "degC"),
//     ARMOR_FIELD(reading, place, ""));
//
// defines the table `reading_type`. Name, order, types and units of the fields are the schema: both ends
// of a link must have the same.

#ifndef ARMOR_FIELDS_H
#define ARMOR_FIELDS_H

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#if defined(__GNUC__)
#define ARMOR_PRINTF(text, first) __attribute__((format(printf, text, first), unused))
#define ARMOR_UNUSED __attribute__((unused))
#else
#define ARMOR_PRINTF(text, first)
#define ARMOR_UNUSED
#endif

// The number of items of an array.
#define ARMOR_COUNT(array) (sizeof(array) / sizeof((array)[0]))

// Returns the error of a call that fails: in functions that return an `int`.
#define ARMOR_TRY(call)                        \
  do {                                         \
    int armor_error_ = (call);                 \
    if (armor_error_ != ARMOR_ERROR_NONE) {    \
      return armor_error_;                     \
    }                                          \
  } while (0)

// The schema of ports that pass on messages of any type, for `armor_subscribe_schema` and
// `armor_provide_schema`.
#define ARMOR_ANY "Any{}"

// What the search of a history returns if it finds no message.
#define ARMOR_NO_AGE ((size_t)-1)

// A list in a struct: a pointer and a length. A received list is read-only.
#define ARMOR_LIST_OF(type) \
  struct {                  \
    const type *data;       \
    size_t len;             \
  }

typedef ARMOR_LIST_OF(uint8_t) armor_u8_list;
typedef ARMOR_LIST_OF(int8_t) armor_i8_list;
typedef ARMOR_LIST_OF(uint16_t) armor_u16_list;
typedef ARMOR_LIST_OF(int16_t) armor_i16_list;
typedef ARMOR_LIST_OF(uint32_t) armor_u32_list;
typedef ARMOR_LIST_OF(int32_t) armor_i32_list;
typedef ARMOR_LIST_OF(uint64_t) armor_u64_list;
typedef ARMOR_LIST_OF(int64_t) armor_i64_list;
typedef ARMOR_LIST_OF(float) armor_f32_list;
typedef ARMOR_LIST_OF(double) armor_f64_list;
typedef ARMOR_LIST_OF(armor_string) armor_string_list;

// The text of a C string, which it points to.
ARMOR_UNUSED static inline armor_string armor_string_of(const char *text) {
  armor_string result = {text, text ? strlen(text) : 0};
  return result;
}

// Whether two texts are equal.
ARMOR_UNUSED static inline bool armor_string_equals(armor_string text, const char *other) {
  return text.len == strlen(other) && (text.len == 0 || memcmp(text.data, other, text.len) == 0);
}

// Keeps the reason of a failure, and returns ARMOR_ERROR_FAILED: `return armor_fail("no %s", path);`
ARMOR_PRINTF(1, 2) static inline int armor_fail(const char *format, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return armor_fail_with(text);
}

// Writes a line into the component's log. Levels: 10 debug, 20 info, 30 warning, 40 error.
ARMOR_PRINTF(2, 3) static inline void armor_write_log(int level, const char *format, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  armor_log_text(level, text);
}

// What `exec` returns: nothing to report.
ARMOR_UNUSED static inline armor_outcome armor_carry_on(void) {
  armor_outcome outcome = {ARMOR_OUTCOME_KIND_CARRY_ON, NULL, 0.0};
  return outcome;
}

// What `exec` returns: the task is over.
ARMOR_UNUSED static inline armor_outcome armor_done(void) {
  armor_outcome outcome = {ARMOR_OUTCOME_KIND_DONE, NULL, 0.0};
  return outcome;
}

// What `exec` returns: an event with a value. `name` must be valid after the return, as a literal is.
ARMOR_UNUSED static inline armor_outcome armor_report_event(const char *name, double value) {
  armor_outcome outcome = {ARMOR_OUTCOME_KIND_EVENT, name, value};
  return outcome;
}

// What `exec` returns after a function of this header has failed, or after `armor_fail`: a failure with
// the text of that.
ARMOR_UNUSED static inline armor_outcome armor_failed_with_last_error(void) {
  armor_outcome outcome = {ARMOR_OUTCOME_KIND_FAILED, NULL, 0.0};
  return outcome;
}

// What `exec` returns: a failure with this reason.
ARMOR_PRINTF(1, 2) static inline armor_outcome armor_failed(const char *format, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  armor_fail_with(text);
  return armor_failed_with_last_error();
}

#ifndef __cplusplus

// The kind of a value, from its C type.
#define ARMOR_KIND_OF(value)            \
  _Generic((value),                     \
      bool: ARMOR_FIELD_KIND_BOOL,      \
      uint8_t: ARMOR_FIELD_KIND_U8,     \
      int8_t: ARMOR_FIELD_KIND_I8,      \
      uint16_t: ARMOR_FIELD_KIND_U16,   \
      int16_t: ARMOR_FIELD_KIND_I16,    \
      uint32_t: ARMOR_FIELD_KIND_U32,   \
      int32_t: ARMOR_FIELD_KIND_I32,    \
      uint64_t: ARMOR_FIELD_KIND_U64,   \
      int64_t: ARMOR_FIELD_KIND_I64,    \
      float: ARMOR_FIELD_KIND_F32,      \
      double: ARMOR_FIELD_KIND_F64,     \
      armor_string: ARMOR_FIELD_KIND_TEXT)

#define ARMOR_MEMBER(type, member) (((type *)0)->member)
// Does not compile if the value has another type.
#define ARMOR_NESTED_KIND(value, of) _Generic((value), of: ARMOR_FIELD_KIND_NESTED)

// A number, a flag or a text; with the unit of a number, or "".
#define ARMOR_FIELD(type, member, unit)                                                       \
  {#member, unit, ARMOR_KIND_OF(ARMOR_MEMBER(type, member)), ARMOR_FIELD_FORM_ONE,            \
   offsetof(type, member), 0, NULL, false, 0}
// A fixed array of these: `double covariance[36];`
#define ARMOR_ARRAY(type, member, unit)                                                       \
  {#member, unit, ARMOR_KIND_OF(ARMOR_MEMBER(type, member)[0]), ARMOR_FIELD_FORM_FIXED,       \
   offsetof(type, member), ARMOR_COUNT(ARMOR_MEMBER(type, member)), NULL, false, 0}
// A list of these: `armor_f32_list ranges;`
#define ARMOR_LIST(type, member, unit)                                                        \
  {#member, unit, ARMOR_KIND_OF(*ARMOR_MEMBER(type, member).data), ARMOR_FIELD_FORM_LIST,     \
   offsetof(type, member), 0, NULL, false, 0}
// One that may be absent: `struct { bool is_present; double value; } depth;`
#define ARMOR_OPTIONAL_FIELD(type, member, unit)                                              \
  {#member, unit, ARMOR_KIND_OF(ARMOR_MEMBER(type, member).value), ARMOR_FIELD_FORM_ONE,      \
   offsetof(type, member.value), 0, NULL, true, offsetof(type, member.is_present)}

// A struct or an enum with a table `of_type`: `armor_pose pose;`
#define ARMOR_NESTED(type, member, of, unit)                                                  \
  {#member, unit, ARMOR_NESTED_KIND(ARMOR_MEMBER(type, member), of), ARMOR_FIELD_FORM_ONE,    \
   offsetof(type, member), 0, &of##_type, false, 0}
// A fixed array of these.
#define ARMOR_NESTED_ARRAY(type, member, of)                                                  \
  {#member, "", ARMOR_NESTED_KIND(ARMOR_MEMBER(type, member)[0], of),                         \
   ARMOR_FIELD_FORM_FIXED, offsetof(type, member), ARMOR_COUNT(ARMOR_MEMBER(type, member)),   \
   &of##_type, false, 0}
// A list of these: `ARMOR_LIST_OF(armor_pose) poses;`
#define ARMOR_NESTED_LIST(type, member, of)                                                   \
  {#member, "", ARMOR_NESTED_KIND(*ARMOR_MEMBER(type, member).data, of),                      \
   ARMOR_FIELD_FORM_LIST, offsetof(type, member), 0, &of##_type, false, 0}
// One that may be absent: `struct { bool is_present; armor_pose value; } goal;`
#define ARMOR_OPTIONAL_NESTED(type, member, of)                                               \
  {#member, "", ARMOR_NESTED_KIND(ARMOR_MEMBER(type, member).value, of),                      \
   ARMOR_FIELD_FORM_ONE, offsetof(type, member.value), 0, &of##_type, true,                   \
   offsetof(type, member.is_present)}

// Describes a struct: its C type, its name in the schema, its fields. Defines the table `type_type`.
#define ARMOR_STRUCT(type, name, ...)                                                         \
  ARMOR_UNUSED static const armor_field type##_fields[] = {__VA_ARGS__};                      \
  ARMOR_UNUSED static const armor_type type##_type = {                                        \
      name, sizeof(type), _Alignof(type), type##_fields, ARMOR_COUNT(type##_fields), NULL, 0}

// Describes an enum whose values count from 0: the names of its values in the schema.
#define ARMOR_ENUM(type, name, ...)                                                           \
  ARMOR_UNUSED static const char *const type##_names[] = {__VA_ARGS__};                       \
  ARMOR_UNUSED static const armor_type type##_type = {                                        \
      name, sizeof(type), _Alignof(type), NULL, 0, type##_names, ARMOR_COUNT(type##_names)}

// The functions that take a table, with the type of the struct checked.
#define ARMOR_PROVIDE(handle, id, type, flags) armor_provide(handle, id, &type##_type, flags)
#define ARMOR_SUBSCRIBE(handle, id, type, flags) armor_subscribe(handle, id, &type##_type, flags)
#define ARMOR_SEND(handle, id, type, message) \
  armor_send_data(handle, id, &type##_type, 1 ? (message) : (const type *)0)
#define ARMOR_DECODE(data, type, message) \
  armor_decode(data, &type##_type, 1 ? (message) : (type *)0)
#define ARMOR_HISTORY_DECODE(data, input, source, age, type, message) \
  armor_history_decode(data, input, source, age, &type##_type, 1 ? (message) : (type *)0)
#define ARMOR_DECODE_KEPT(kept, type, message) \
  armor_decode_kept(kept, &type##_type, 1 ? (message) : (type *)0)
#define ARMOR_TEST_SEND(test, input, type, message) \
  armor_test_send(test, input, &type##_type, 1 ? (message) : (const type *)0)
#define ARMOR_TEST_OUTPUT(test, output, index, type, message) \
  armor_test_output(test, output, index, &type##_type, 1 ? (message) : (type *)0)

#endif  // __cplusplus

#endif  // ARMOR_FIELDS_H
