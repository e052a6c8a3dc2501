// Messages, as `armor message export --lang c` writes them.

#pragma once

#include <armor_messages.h>

typedef enum armor_state_message {
  ARMOR_STATE_MESSAGE_IDLE,
  ARMOR_STATE_MESSAGE_BUSY,
} armor_state_message;
ARMOR_ENUM(armor_state_message, "State", "Idle", "Busy");

typedef struct armor_part {
  int32_t id;
  // Unit: kg.
  struct {
    bool is_present;
    float value;
  } mass;
} armor_part;
ARMOR_STRUCT(armor_part, "Part",
  ARMOR_FIELD(armor_part, id, ""),
  ARMOR_OPTIONAL_FIELD(armor_part, mass, "kg"));

typedef struct armor_reading {
  // Unit: s.
  double stamp;
  armor_string name;
  uint16_t level;
  bool ok;
  // Unit: m.
  armor_f32_list ranges;
  armor_u8_list raw;
  armor_string_list names;
  // Unit: m.
  double corner[4];
  // Unit: m.
  struct {
    bool is_present;
    double value;
  } depth;
  armor_state_message state;
  armor_pose2d at;
  ARMOR_LIST_OF(armor_part) parts;
} armor_reading;
ARMOR_STRUCT(armor_reading, "Reading",
  ARMOR_FIELD(armor_reading, stamp, "s"),
  ARMOR_FIELD(armor_reading, name, ""),
  ARMOR_FIELD(armor_reading, level, ""),
  ARMOR_FIELD(armor_reading, ok, ""),
  ARMOR_LIST(armor_reading, ranges, "m"),
  ARMOR_LIST(armor_reading, raw, ""),
  ARMOR_LIST(armor_reading, names, ""),
  ARMOR_ARRAY(armor_reading, corner, "m"),
  ARMOR_OPTIONAL_FIELD(armor_reading, depth, "m"),
  ARMOR_NESTED(armor_reading, state, armor_state_message, ""),
  ARMOR_NESTED(armor_reading, at, armor_pose2d, ""),
  ARMOR_NESTED_LIST(armor_reading, parts, armor_part));
