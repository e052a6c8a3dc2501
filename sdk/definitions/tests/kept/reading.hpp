// Messages, as `armor message export --lang cpp` writes them.

#pragma once

#include <armor_messages.hpp>

using armor::messages::Pose2D;

enum class State : uint32_t {
  Idle,
  Busy,
};
ARMOR_MESSAGE_ENUM(State, Idle, Busy)

struct Part {
  int32_t id{};
  // Unit: kg.
  std::optional<float> mass{};
};
ARMOR_MESSAGE_NAMED("Part", Part, id, (mass, "kg"))

struct Reading {
  // Unit: s.
  double stamp{};
  std::string name{};
  uint16_t level{};
  bool ok{};
  // Unit: m.
  std::vector<float> ranges{};
  std::vector<uint8_t> raw{};
  std::vector<std::string> names{};
  // Unit: m.
  std::array<double, 4> corner{};
  // Unit: m.
  std::optional<double> depth{};
  State state{};
  Pose2D at{};
  std::vector<Part> parts{};
};
ARMOR_MESSAGE_NAMED("Reading", Reading, (stamp, "s"), name, level, ok, (ranges, "m"), raw, names, (corner, "m"), (depth, "m"), state, at, parts)

// As `Reading`, with texts and lists that are borrowed: from the message that has arrived, or
// from the sender's memory.
struct ReadingView {
  // Unit: s.
  double stamp{};
  std::string_view name{};
  uint16_t level{};
  bool ok{};
  // Unit: m.
  armor::span<const float> ranges{};
  armor::span<const uint8_t> raw{};
  std::vector<std::string> names{};
  // Unit: m.
  std::array<double, 4> corner{};
  // Unit: m.
  std::optional<double> depth{};
  State state{};
  Pose2D at{};
  std::vector<Part> parts{};
};
ARMOR_MESSAGE_NAMED("Reading", ReadingView, (stamp, "s"), name, level, ok, (ranges, "m"), raw, names, (corner, "m"), (depth, "m"), state, at, parts)
