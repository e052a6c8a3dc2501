// Structs of C++ as messages: their schemas, encoding and decoding. Included by armor.hpp.
//
//   struct Reading {
//     double celsius = 0.0;
//     std::string place;
//   };
//   ARMOR_MESSAGE(Reading, (celsius, "degC"), place)
//
// at the namespace of the struct. Types of fields: bool, fixed-width integers, float, double,
// std::string, std::string_view, std::vector, armor::span of const numbers, std::array, std::optional,
// enums of ARMOR_MESSAGE_ENUM, and structs of ARMOR_MESSAGE. Name, order, types and units of the fields are
// the schema: both ends of a link must have the same. A span or string_view in a received message is
// borrowed.

#ifndef ARMOR_CODEC_HPP
#define ARMOR_CODEC_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#if __has_include(<version>)
#include <version>
#endif
#if defined(__cpp_lib_span)
#include <span>
#endif

#include "armor.h"

namespace armor {

#if defined(__cpp_lib_span)
template <class T>
using span = std::span<T>;
#else
// Items next to each other in memory that it does not own; std::span in C++20.
template <class T>
class span {
 public:
  constexpr span() = default;
  constexpr span(T *data, std::size_t size) : data_(data), size_(size) {}
  template <class C, class = decltype(std::declval<const C &>().data())>
  constexpr span(const C &items) : data_(items.data()), size_(items.size()) {}
  constexpr T *data() const { return data_; }
  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr T &operator[](std::size_t index) const { return data_[index]; }
  constexpr T *begin() const { return data_; }
  constexpr T *end() const { return data_ + size_; }

 private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};
#endif

// An error of a function of armor.h: its code, and its text as what().
class Error : public std::runtime_error {
 public:
  Error(int code, const std::string &text) : std::runtime_error(text), code_(code) {}
  // One of armor_error.
  int code() const { return code_; }

 private:
  int code_;
};

// Throws if a function of armor.h has failed.
inline void check(int code) {
  if (code != ARMOR_ERROR_NONE) throw Error(code, armor_last_error());
}

// What decoded spans point to if the array has not arrived aligned.
using Arena = std::vector<std::unique_ptr<std::uint64_t[]>>;

// A field of a struct.
template <class S, class T>
struct Field {
  const char *name;
  T S::*member;
  const char *unit;
};
template <class S, class T>
constexpr Field<S, T> field(const char *name, T S::*member, const char *unit) {
  return {name, member, unit};
}

// An array from this length in bytes on is sent from where it is.
inline constexpr std::size_t PIECE_LEN = 1024;

class Writer {
 public:
  void clear() {
    own_.clear();
    arrays_.clear();
  }
  void append(const void *bytes, std::size_t len) {
    if (len == 0) return;
    const auto *begin = static_cast<const unsigned char *>(bytes);
    own_.insert(own_.end(), begin, begin + len);
  }
  template <class T>
  void append_number(T number) {
    append(&number, sizeof number);
  }
  void append_array(const void *bytes, std::size_t len) {
    if (len < PIECE_LEN) return append(bytes, len);
    arrays_.push_back({own_.size(), {bytes, len}});
  }
  // Its bytes, in pieces.
  const std::vector<armor_piece> &pieces() {
    pieces_.clear();
    std::size_t begin = 0;
    for (const auto &[end, array] : arrays_) {
      pieces_.push_back({own_.data() + begin, end - begin});
      pieces_.push_back(array);
      begin = end;
    }
    pieces_.push_back({own_.data() + begin, own_.size() - begin});
    return pieces_;
  }

 private:
  std::vector<unsigned char> own_;
  std::vector<std::pair<std::size_t, armor_piece>> arrays_;
  std::vector<armor_piece> pieces_;
};

class Reader {
 public:
  Reader(const std::uint8_t *bytes, std::size_t len, Arena &arena)
      : at_(bytes), end_(bytes + len), arena_(arena) {}
  const std::uint8_t *take(std::size_t len) {
    if (len > left()) throw Error(ARMOR_ERROR_MALFORMED, "the message ends within a value");
    const std::uint8_t *taken = at_;
    at_ += len;
    return taken;
  }
  template <class T>
  T take_number() {
    T number;
    std::memcpy(&number, take(sizeof number), sizeof number);
    return number;
  }
  std::size_t take_count(std::size_t min_len) {
    const auto count = take_number<std::uint64_t>();
    if (count > left() / min_len) throw Error(ARMOR_ERROR_MALFORMED, "a list is longer than the message");
    return static_cast<std::size_t>(count);
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
  Arena &arena() { return arena_; }

 private:
  const std::uint8_t *at_;
  const std::uint8_t *end_;
  Arena &arena_;
};

// How values of a type are described, encoded and decoded: specialised for each type.
template <class T, class = void>
struct Codec;

template <class T>
inline constexpr bool is_number_v = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

template <>
struct Codec<bool> {
  static constexpr std::size_t MIN_LEN = 1;
  static void describe(std::string &out) { out += "bool"; }
  static void encode(Writer &out, bool value) { out.append_number<std::uint8_t>(value ? 1 : 0); }
  static void decode(Reader &in, bool &value) {
    const auto byte = in.take_number<std::uint8_t>();
    if (byte > 1) throw Error(ARMOR_ERROR_MALFORMED, "a flag is neither true nor false");
    value = byte == 1;
  }
};

template <class T>
struct Codec<T, std::enable_if_t<is_number_v<T>>> {
  static_assert(sizeof(T) <= 8, "a number has at most 8 bytes");
  static constexpr std::size_t MIN_LEN = sizeof(T);
  static void describe(std::string &out) {
    out += std::is_floating_point_v<T> ? 'f' : std::is_signed_v<T> ? 'i' : 'u';
    out += std::to_string(8 * sizeof(T));
  }
  static void encode(Writer &out, T value) { out.append_number(value); }
  static void decode(Reader &in, T &value) { value = in.take_number<T>(); }
};

template <class T>
struct TextCodec {
  static constexpr std::size_t MIN_LEN = 8;
  static void describe(std::string &out) { out += "string"; }
  static void encode(Writer &out, const T &text) {
    out.append_number<std::uint64_t>(text.size());
    out.append(text.data(), text.size());
  }
  static void decode(Reader &in, T &text) {
    const std::size_t len = in.take_count(1);
    text = T(reinterpret_cast<const char *>(in.take(len)), len);
  }
};
template <>
struct Codec<std::string> : TextCodec<std::string> {};
template <>
struct Codec<std::string_view> : TextCodec<std::string_view> {};

template <class T>
struct Codec<std::vector<T>> {
  static constexpr std::size_t MIN_LEN = 8;
  static void describe(std::string &out) {
    out += '[';
    Codec<T>::describe(out);
    out += ']';
  }
  static void encode(Writer &out, const std::vector<T> &items) {
    out.append_number<std::uint64_t>(items.size());
    if constexpr (is_number_v<T>) {
      out.append_array(items.data(), items.size() * sizeof(T));
    } else {
      for (const auto &item : items) Codec<T>::encode(out, item);
    }
  }
  static void decode(Reader &in, std::vector<T> &items) {
    const std::size_t count = in.take_count(Codec<T>::MIN_LEN);
    if constexpr (is_number_v<T>) {
      items.resize(count);
      const std::uint8_t *bytes = in.take(count * sizeof(T));
      if (count > 0) std::memcpy(items.data(), bytes, count * sizeof(T));
    } else {
      items.clear();
      items.reserve(count);
      for (std::size_t index = 0; index < count; ++index) {
        T item{};
        Codec<T>::decode(in, item);
        items.push_back(std::move(item));
      }
    }
  }
};

template <class T>
struct Codec<span<const T>> {
  static_assert(is_number_v<T>, "a span is one of const numbers; use std::vector for others");
  static constexpr std::size_t MIN_LEN = 8;
  static void describe(std::string &out) { Codec<std::vector<T>>::describe(out); }
  static void encode(Writer &out, const span<const T> &items) {
    out.append_number<std::uint64_t>(items.size());
    out.append_array(items.data(), items.size() * sizeof(T));
  }
  static void decode(Reader &in, span<const T> &items) {
    const std::size_t count = in.take_count(sizeof(T));
    const std::uint8_t *bytes = in.take(count * sizeof(T));
    if (reinterpret_cast<std::uintptr_t>(bytes) % alignof(T) != 0) {
      const std::size_t words = (count * sizeof(T) + 7) / 8;
      auto copy = std::make_unique<std::uint64_t[]>(words);
      std::memcpy(copy.get(), bytes, count * sizeof(T));
      bytes = reinterpret_cast<const std::uint8_t *>(copy.get());
      in.arena().push_back(std::move(copy));
    }
    items = span<const T>(reinterpret_cast<const T *>(bytes), count);
  }
};

template <class T, std::size_t N>
struct Codec<std::array<T, N>> {
  static constexpr std::size_t MIN_LEN = N * Codec<T>::MIN_LEN;
  static void describe(std::string &out) {
    out += '[';
    Codec<T>::describe(out);
    out += ';' + std::to_string(N) + ']';
  }
  static void encode(Writer &out, const std::array<T, N> &items) {
    if constexpr (is_number_v<T>) {
      out.append(items.data(), sizeof items);
    } else {
      for (const auto &item : items) Codec<T>::encode(out, item);
    }
  }
  static void decode(Reader &in, std::array<T, N> &items) {
    if constexpr (is_number_v<T>) {
      std::memcpy(items.data(), in.take(sizeof items), sizeof items);
    } else {
      for (auto &item : items) Codec<T>::decode(in, item);
    }
  }
};

template <class T>
struct Codec<std::optional<T>> {
  static constexpr std::size_t MIN_LEN = 1;
  static void describe(std::string &out) {
    out += '?';
    Codec<T>::describe(out);
  }
  static void encode(Writer &out, const std::optional<T> &value) {
    Codec<bool>::encode(out, value.has_value());
    if (value) Codec<T>::encode(out, *value);
  }
  static void decode(Reader &in, std::optional<T> &value) {
    bool has_value = false;
    Codec<bool>::decode(in, has_value);
    if (has_value) {
      Codec<T>::decode(in, value.emplace());
    } else {
      value.reset();
    }
  }
};

// Enums: numbered on the wire in the order of ARMOR_MESSAGE_ENUM.
template <class T>
struct Codec<T, std::enable_if_t<std::is_enum_v<T>>> {
  static constexpr std::size_t MIN_LEN = 4;
  static void describe(std::string &out) {
    out += armor_message_name(static_cast<const T *>(nullptr));
    char before = '<';
    for (const char *name : armor_message_values(static_cast<const T *>(nullptr)).second) {
      out += before;
      out += name;
      before = ',';
    }
    out += '>';
  }
  static void encode(Writer &out, T value) {
    const auto values = armor_message_values(static_cast<const T *>(nullptr)).first;
    for (std::size_t index = 0; index < values.size(); ++index) {
      if (values[index] == value) return out.append_number(static_cast<std::uint32_t>(index));
    }
    throw Error(ARMOR_ERROR_MALFORMED, "an enum has a value without a name");
  }
  static void decode(Reader &in, T &value) {
    const auto values = armor_message_values(static_cast<const T *>(nullptr)).first;
    const auto index = in.take_number<std::uint32_t>();
    if (index >= values.size()) throw Error(ARMOR_ERROR_MALFORMED, "an enum has an unknown value");
    value = values[index];
  }
};

// Structs of ARMOR_MESSAGE.
template <class T>
struct Codec<T, std::enable_if_t<std::is_class_v<T>, std::void_t<decltype(armor_message_fields(
                                                         static_cast<const T *>(nullptr)))>>> {
  static constexpr auto FIELDS = armor_message_fields(static_cast<const T *>(nullptr));

  template <class S, class M>
  static constexpr std::size_t min_len_of(const Field<S, M> &) {
    return Codec<M>::MIN_LEN;
  }
  static constexpr std::size_t MIN_LEN =
      std::apply([](const auto &...fields) { return (min_len_of(fields) + ...); }, FIELDS);

  static void describe(std::string &out) {
    out += armor_message_name(static_cast<const T *>(nullptr));
    char before = '{';
    std::apply([&](const auto &...fields) { (describe_field(out, before, fields), ...); }, FIELDS);
    out += '}';
  }
  static void encode(Writer &out, const T &value) {
    std::apply([&](const auto &...fields) { (encode_field(out, value, fields), ...); }, FIELDS);
  }
  static void decode(Reader &in, T &value) {
    std::apply([&](const auto &...fields) { (decode_field(in, value, fields), ...); }, FIELDS);
  }

 private:
  template <class S, class M>
  static void describe_field(std::string &out, char &before, const Field<S, M> &field) {
    out += before;
    out += field.name;
    out += ':';
    Codec<M>::describe(out);
    if (*field.unit != '\0') out += '(' + std::string(field.unit) + ')';
    before = ',';
  }
  template <class S, class M>
  static void encode_field(Writer &out, const T &value, const Field<S, M> &field) {
    Codec<M>::encode(out, value.*field.member);
  }
  template <class S, class M>
  static void decode_field(Reader &in, T &value, const Field<S, M> &field) {
    Codec<M>::decode(in, value.*field.member);
  }
};

// The schema of a message.
template <class T>
const std::string &schema_of() {
  static const std::string schema = [] {
    std::string text;
    Codec<T>::describe(text);
    return text;
  }();
  return schema;
}

// An encoded message: small parts in a buffer of the thread, arrays where they are.
template <class T>
class EncodedMessage {
 public:
  explicit EncodedMessage(const T &message) {
    Writer &writer = thread_writer();
    writer.clear();
    Codec<T>::encode(writer, message);
    pieces_ = &writer.pieces();
  }
  const armor_piece *pieces() const { return pieces_->data(); }
  std::size_t piece_count() const { return pieces_->size(); }

 private:
  static Writer &thread_writer() {
    static thread_local Writer writer;
    return writer;
  }
  const std::vector<armor_piece> *pieces_;
};

template <class T>
T decode_message(const std::uint8_t *bytes, std::size_t len, Arena &arena) {
  if (bytes == nullptr) throw Error(ARMOR_ERROR_NULL, armor_last_error());
  Reader reader(bytes, len, arena);
  T message{};
  Codec<T>::decode(reader, message);
  if (reader.left() != 0) throw Error(ARMOR_ERROR_MALFORMED, "bytes are left over after the message");
  return message;
}

}  // namespace armor

// ARMOR_MESSAGE(Type, field, (field, "unit"), …): at most 32 fields.
#define ARMOR_MESSAGE(Type, ...) ARMOR_MESSAGE_NAMED(#Type, Type, __VA_ARGS__)
// With the name that the schema has for it.
#define ARMOR_MESSAGE_NAMED(name, Type, ...)                                            \
  inline constexpr const char *armor_message_name(const Type *) { return name; }       \
  inline constexpr auto armor_message_fields(const Type *) {                           \
    using armor_self = Type;                                                           \
    return std::make_tuple(ARMOR_CPP_EACH(ARMOR_CPP_FIELD, __VA_ARGS__));              \
  }
// ARMOR_MESSAGE_ENUM(Type, Value, …): an enum class, with its values in the order of the schema.
#define ARMOR_MESSAGE_ENUM(Type, ...)                                                   \
  inline constexpr const char *armor_message_name(const Type *) { return #Type; }      \
  inline constexpr auto armor_message_values(const Type *) {                           \
    using armor_self = Type;                                                           \
    return std::make_pair(std::array{ARMOR_CPP_EACH(ARMOR_CPP_VALUE, __VA_ARGS__)},    \
                          std::array{ARMOR_CPP_EACH(ARMOR_CPP_NAME, __VA_ARGS__)});    \
  }

#define ARMOR_CPP_VALUE(value) armor_self::value
#define ARMOR_CPP_NAME(value) #value
#define ARMOR_CPP_FIELD(item) ARMOR_CPP_JOIN(ARMOR_CPP_FIELD_, ARMOR_CPP_IS_PAREN(item))(item)
#define ARMOR_CPP_FIELD_0(member) ::armor::field(#member, &armor_self::member, "")
#define ARMOR_CPP_FIELD_1(item) ARMOR_CPP_FIELD_UNIT item
#define ARMOR_CPP_FIELD_UNIT(member, unit) ::armor::field(#member, &armor_self::member, unit)
#define ARMOR_CPP_JOIN(a, b) ARMOR_CPP_JOIN_I(a, b)
#define ARMOR_CPP_JOIN_I(a, b) a##b
#define ARMOR_CPP_PROBE(...) ~, 1
#define ARMOR_CPP_SECOND(a, b, ...) b
#define ARMOR_CPP_SECOND_I(...) ARMOR_CPP_SECOND(__VA_ARGS__)
#define ARMOR_CPP_IS_PAREN(item) ARMOR_CPP_SECOND_I(ARMOR_CPP_PROBE item, 0, ~)
#define ARMOR_CPP_EACH(do, ...) \
  ARMOR_CPP_JOIN(ARMOR_CPP_EACH_, ARMOR_CPP_COUNT(__VA_ARGS__))(do, __VA_ARGS__)
#define ARMOR_CPP_COUNT(...) ARMOR_CPP_COUNT_I(__VA_ARGS__, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, \
  16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0)
#define ARMOR_CPP_COUNT_I(_1, _2, _3, _4, _5, _6, _7, _8, _9, _10, _11, _12, _13, _14, _15, _16, \
  _17, _18, _19, _20, _21, _22, _23, _24, _25, _26, _27, _28, _29, _30, _31, _32, count, ...) count
#define ARMOR_CPP_EACH_1(do, item) do(item)
#define ARMOR_CPP_EACH_2(do, item, ...) do(item), ARMOR_CPP_EACH_1(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_3(do, item, ...) do(item), ARMOR_CPP_EACH_2(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_4(do, item, ...) do(item), ARMOR_CPP_EACH_3(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_5(do, item, ...) do(item), ARMOR_CPP_EACH_4(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_6(do, item, ...) do(item), ARMOR_CPP_EACH_5(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_7(do, item, ...) do(item), ARMOR_CPP_EACH_6(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_8(do, item, ...) do(item), ARMOR_CPP_EACH_7(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_9(do, item, ...) do(item), ARMOR_CPP_EACH_8(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_10(do, item, ...) do(item), ARMOR_CPP_EACH_9(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_11(do, item, ...) do(item), ARMOR_CPP_EACH_10(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_12(do, item, ...) do(item), ARMOR_CPP_EACH_11(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_13(do, item, ...) do(item), ARMOR_CPP_EACH_12(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_14(do, item, ...) do(item), ARMOR_CPP_EACH_13(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_15(do, item, ...) do(item), ARMOR_CPP_EACH_14(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_16(do, item, ...) do(item), ARMOR_CPP_EACH_15(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_17(do, item, ...) do(item), ARMOR_CPP_EACH_16(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_18(do, item, ...) do(item), ARMOR_CPP_EACH_17(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_19(do, item, ...) do(item), ARMOR_CPP_EACH_18(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_20(do, item, ...) do(item), ARMOR_CPP_EACH_19(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_21(do, item, ...) do(item), ARMOR_CPP_EACH_20(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_22(do, item, ...) do(item), ARMOR_CPP_EACH_21(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_23(do, item, ...) do(item), ARMOR_CPP_EACH_22(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_24(do, item, ...) do(item), ARMOR_CPP_EACH_23(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_25(do, item, ...) do(item), ARMOR_CPP_EACH_24(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_26(do, item, ...) do(item), ARMOR_CPP_EACH_25(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_27(do, item, ...) do(item), ARMOR_CPP_EACH_26(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_28(do, item, ...) do(item), ARMOR_CPP_EACH_27(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_29(do, item, ...) do(item), ARMOR_CPP_EACH_28(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_30(do, item, ...) do(item), ARMOR_CPP_EACH_29(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_31(do, item, ...) do(item), ARMOR_CPP_EACH_30(do, __VA_ARGS__)
#define ARMOR_CPP_EACH_32(do, item, ...) do(item), ARMOR_CPP_EACH_31(do, __VA_ARGS__)

#endif  // ARMOR_CODEC_HPP
