// Components in C++17: over armor.h, header only. docs/cpp.md is the guide.
//
//   #include <armor.hpp>
//   #include <armor_messages.hpp>
//
//   class Blinker : public armor::Component {
//    public:
//     Blinker() : Component("blinker", "Switches a light on and off.") {
//       provide<armor::messages::Flag>("light");
//     }
//     armor::Outcome exec(armor::Call) override {
//       on_ = !on_;
//       send_data("light", armor::messages::Flag{on_});
//       return armor::carry_on();
//     }
//
//    private:
//     bool on_ = false;
//   };
//
//   int main(int argc, char **argv) { return armor::run<Blinker>(argc, argv); }
//
// An exception of a component is a report of its failure with what(); none crosses to C.

#ifndef ARMOR_HPP
#define ARMOR_HPP

#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "armor.h"
#include "armor_codec.hpp"

namespace armor {

// Why `exec` is called.
enum class Call {
  // The component has been activated.
  Started = ARMOR_CALL_STARTED,
  // Its period is over.
  Tick = ARMOR_CALL_TICK,
  // It has received data, and the file gives it no rate.
  Data = ARMOR_CALL_DATA,
  // The last call before it is frozen or ended: bring actuators to rest.
  Stopping = ARMOR_CALL_STOPPING,
};

// What `exec` returns.
struct Outcome {
  armor_outcome_kind kind = ARMOR_OUTCOME_KIND_CARRY_ON;
  // The name of an event, or the reason of a failure.
  std::string text;
  double value = 0.0;
};

// Nothing to report.
inline Outcome carry_on() { return {}; }
// The task is over; no more calls in this activation, except Call::Stopping.
inline Outcome done() { return {ARMOR_OUTCOME_KIND_DONE, {}, 0.0}; }
// The task cannot be done, and why.
inline Outcome failed(std::string why) { return {ARMOR_OUTCOME_KIND_FAILED, std::move(why), 0.0}; }
// Something happened that the mission may wait for.
inline Outcome event(std::string name, double value = 0.0) {
  return {ARMOR_OUTCOME_KIND_EVENT, std::move(name), value};
}

// A line in the component's log.
inline void log_debug(const std::string &text) { armor_log_text(10, text.c_str()); }
inline void log_info(const std::string &text) { armor_log_text(20, text.c_str()); }
inline void log_warning(const std::string &text) { armor_log_text(30, text.c_str()); }
inline void log_error(const std::string &text) { armor_log_text(40, text.c_str()); }

// A received message that is kept: large ones stay in shared memory. Views into it are valid as long as
// it, or a copy of it, exists.
class Kept {
 public:
  Kept() = default;
  explicit Kept(armor_kept *kept) : kept_(kept, armor_kept_free), arena_(new Arena) {}

  template <class T>
  T decode() const {
    std::size_t len = 0;
    const std::uint8_t *bytes = armor_kept_bytes(kept_.get(), &len);
    return decode_message<T>(bytes, len, *arena_);
  }

 private:
  std::shared_ptr<armor_kept> kept_;
  std::shared_ptr<Arena> arena_;
};

// Where data comes from, when it was created, and what is missing before it.
struct Header {
  // Local name of the input.
  std::string_view id;
  // System-wide name of the data, `component.output`.
  std::string_view data;
  std::uint64_t sequence;
  // System time in seconds.
  double stamp_s;
  std::uint64_t instance;
  // How many messages were lost immediately before it.
  std::uint64_t lost;
};

class Component;

// A message of any type, for a component that passes messages on and does not read them: the type of an
// input, `subscribe<armor::AnyMessage>`, which has the type of its first link, and of outputs, which get that
// type, too. `send_data` passes it on, in this call or later, with its bytes and its stamp unchanged. Large
// ones stay in shared memory. The copies share it.
class AnyMessage {
 public:
  AnyMessage() = default;
  explicit AnyMessage(armor_any *any) : any_(any, armor_any_free) {}

  // Whether there is one: not if it was made without a message.
  explicit operator bool() const { return any_ != nullptr; }
  std::string_view type_name() const { return own(armor_any_type(any_.get())); }
  std::string_view schema() const { return own(armor_any_schema(any_.get())); }
  // When it was created: system time in seconds.
  double stamp_s() const { return armor_any_stamp(any_.get()); }
  // Its bytes, valid as long as it.
  span<const std::uint8_t> bytes() const {
    std::size_t len = 0;
    const std::uint8_t *bytes = armor_any_bytes(any_.get(), &len);
    return {bytes, len};
  }
  const armor_any *get() const { return any_.get(); }

 private:
  static std::string_view own(const char *text) { return text == nullptr ? "" : text; }

  std::shared_ptr<armor_any> any_;
};

template <>
inline const std::string &schema_of<AnyMessage>() {
  static const std::string schema = ARMOR_ANY;
  return schema;
}

// A message of a history. Spans and string_views that are decoded from it are valid during the call of
// `data_received`.
class Past {
 public:
  Past(const armor_data *data, std::string input, std::string source, std::string_view schema, std::size_t age)
      : data_(data), input_(std::move(input)), source_(std::move(source)), schema_(schema), age_(age) {
    check(armor_history_get(data_, input_.c_str(), c_source(), age_, &header_));
  }
  // When it was created: system time in seconds.
  double stamp_s() const { return header_.stamp_s; }
  std::uint64_t sequence() const { return header_.sequence; }
  std::uint64_t instance() const { return header_.instance; }
  // How many messages were lost immediately before it.
  std::uint64_t lost() const { return header_.lost; }
  // Whether the message before it in the history is not the one that was published before it.
  bool follows_gap() const { return header_.follows_gap; }
  // 0 is the newest.
  std::size_t age() const { return age_; }

  template <class T>
  T decode() const {
    const std::string &used = schema_of<T>();
    if (used != schema_) {
      throw Error(ARMOR_ERROR_OTHER_TYPE, "input `" + input_ + "` is declared as " + std::string(schema_) +
                                              ", but its history was decoded as " + used);
    }
    std::size_t len = 0;
    const std::uint8_t *bytes = armor_history_bytes(data_, input_.c_str(), c_source(), age_, &len);
    if (bytes == nullptr) throw Error(ARMOR_ERROR_NO_MESSAGE, armor_last_error());
    return decode_message<T>(bytes, len, *arena_);
  }

  // The message of an input of any type, with its type; valid beyond the call.
  AnyMessage any() const {
    armor_any *any = armor_history_any(data_, input_.c_str(), c_source(), age_);
    if (any == nullptr) throw Error(ARMOR_ERROR_OTHER_TYPE, armor_last_error());
    return AnyMessage(any);
  }

 private:
  const char *c_source() const { return source_.empty() ? nullptr : source_.c_str(); }

  const armor_data *data_;
  std::string input_, source_;
  std::string_view schema_;
  std::size_t age_;
  armor_past header_{};
  std::shared_ptr<Arena> arena_ = std::make_shared<Arena>();
};

// The last messages of an input since the component was activated, newest first; valid during the call
// of `data_received`.
class History {
 public:
  History(const armor_data *data, std::string input, std::string source, std::string_view schema)
      : data_(data), input_(std::move(input)), source_(std::move(source)), schema_(schema) {
    check(armor_history_len(data_, input_.c_str(), c_source(), &len_));
  }
  std::size_t size() const { return len_; }
  bool empty() const { return len_ == 0; }
  // The message of that age: 0 is the newest.
  Past operator[](std::size_t age) const { return {data_, input_, source_, schema_, age}; }
  // The message whose stamp is nearest to a time.
  std::optional<Past> nearest(double stamp_s) const {
    return find(armor_history_nearest(data_, input_.c_str(), c_source(), stamp_s));
  }
  // The two messages between which a time lies, the earlier one first; twice the same if its stamp is that
  // time exactly.
  std::optional<std::pair<Past, Past>> around(double stamp_s) const {
    std::size_t earlier = ARMOR_NO_AGE;
    const std::size_t later = armor_history_around(data_, input_.c_str(), c_source(), stamp_s, &earlier);
    if (later == ARMOR_NO_AGE) return std::nullopt;
    return std::make_pair((*this)[earlier], (*this)[later]);
  }

 private:
  const char *c_source() const { return source_.empty() ? nullptr : source_.c_str(); }
  std::optional<Past> find(std::size_t age) const {
    if (age == ARMOR_NO_AGE) return std::nullopt;
    return (*this)[age];
  }

  const armor_data *data_;
  std::string input_, source_;
  std::string_view schema_;
  std::size_t len_ = 0;
};

// The content of received data.
class Data {
 public:
  Data(const armor_data *data, std::string_view input, std::string_view schema,
       const Component *component = nullptr)
      : data_(data), input_(input), schema_(schema), component_(component) {}

  // Reads the message. Spans and string_views in it are valid during the call of `data_received`.
  template <class T>
  T decode() const {
    check_schema<T>();
    std::size_t len = 0;
    const std::uint8_t *bytes = armor_data_bytes(data_, &len);
    return decode_message<T>(bytes, len, arena_);
  }

  // The message of an input of any type, to be passed on.
  AnyMessage any() const {
    armor_any *any = armor_any_received(data_);
    if (any == nullptr) throw Error(ARMOR_ERROR_OTHER_TYPE, armor_last_error());
    return AnyMessage(any);
  }

  // The last messages of the input that this message is of (`history="n"` of its link), this one among
  // them; or of another input, whose `source` must be named if it has several.
  History history() const { return {data_, std::string(input_), "", schema_}; }
  History history(const std::string &input, const std::string &source = "") const;

  // Keeps the message beyond the call.
  template <class T>
  Kept keep() const {
    check_schema<T>();
    return Kept(armor_keep(data_));
  }

 private:
  template <class T>
  void check_schema() const {
    const std::string &used = schema_of<T>();
    if (used.data() != schema_.data() && used != schema_) {
      throw Error(ARMOR_ERROR_OTHER_TYPE, "input `" + std::string(input_) + "` is declared as " +
                                              std::string(schema_) + ", but was decoded as " + used);
    }
  }

  const armor_data *data_;
  std::string_view input_;
  std::string_view schema_;
  const Component *component_;
  mutable Arena arena_;
};

// What is declared of a parameter; `docs/manifest.md` explains it.
class ParameterOptions {
 public:
  ParameterOptions(armor_parameter_type type, std::string name) : type_(type), name_(std::move(name)) {}

  // Its value if the file assigns none, written as in a file: "0.3m/s".
  ParameterOptions &default_value(std::string text) { return set(default_, has_default_, std::move(text)); }
  // The unit of a number.
  ParameterOptions &unit(std::string unit) { return unit_ = std::move(unit), *this; }
  // Its smallest and largest value, in SI; infinite for none.
  ParameterOptions &range(double low, double high) { return low_ = low, high_ = high, *this; }
  // The choices, with spaces between them.
  ParameterOptions &choices(std::string choices) { return choices_ = std::move(choices), *this; }
  // The form of a text or path, such as "frame".
  ParameterOptions &format(std::string format) { return format_ = std::move(format), *this; }
  // What it does, in one line.
  ParameterOptions &doc(std::string doc) { return doc_ = std::move(doc), *this; }
  // A change in the file reaches the running component.
  ParameterOptions &live() { return live_ = true, *this; }
  // Of a path: the component writes there.
  ParameterOptions &written() { return written_ = true, *this; }

  const std::string &name() const { return name_; }
  armor_parameter_type type() const { return type_; }

  armor_parameter table() const {
    armor_parameter table{};
    table.name = name_.c_str();
    table.kind = type_;
    table.unit = unit_.c_str();
    table.default_value = has_default_ ? default_.c_str() : nullptr;
    table.minimum = low_;
    table.maximum = high_;
    table.choices = choices_.c_str();
    table.format = format_.c_str();
    table.doc = doc_.c_str();
    table.live = live_;
    table.written = written_;
    return table;
  }

 private:
  ParameterOptions &set(std::string &member, bool &flag, std::string text) {
    member = std::move(text);
    flag = true;
    return *this;
  }

  armor_parameter_type type_;
  std::string name_, unit_, default_, choices_, format_, doc_;
  bool has_default_ = false, live_ = false, written_ = false;
  double low_ = 0.0, high_ = 0.0;
};

// A number; the component gets SI.
inline ParameterOptions number(std::string name, std::string unit = "") {
  return ParameterOptions(ARMOR_PARAMETER_TYPE_NUMBER, std::move(name)).unit(std::move(unit));
}
inline ParameterOptions integer(std::string name) {
  return {ARMOR_PARAMETER_TYPE_INTEGER, std::move(name)};
}
inline ParameterOptions text(std::string name) { return {ARMOR_PARAMETER_TYPE_TEXT, std::move(name)}; }
// One of the choices, which have spaces between them.
inline ParameterOptions choice(std::string name, std::string choices) {
  return ParameterOptions(ARMOR_PARAMETER_TYPE_CHOICE, std::move(name)).choices(std::move(choices));
}
// A file or folder; the component gets it resolved.
inline ParameterOptions path(std::string name) { return {ARMOR_PARAMETER_TYPE_PATH, std::move(name)}; }
inline ParameterOptions flag(std::string name) { return {ARMOR_PARAMETER_TYPE_FLAG, std::move(name)}; }
inline ParameterOptions colour(std::string name) {
  return {ARMOR_PARAMETER_TYPE_COLOUR, std::move(name)};
}

// A parameter as a member of a component: declared and requested in its constructor, set before the
// first call of `exec`. T: double, int64_t, bool or std::string.
template <class T>
class Parameter {
 public:
  Parameter(Component *component, ParameterOptions options);
  Parameter(const Parameter &) = delete;
  Parameter &operator=(const Parameter &) = delete;

  const T &get() const { return value_; }
  operator const T &() const { return value_; }

 private:
  void read(const armor_value *value, armor_parameter_type type) {
    if constexpr (std::is_same_v<T, double>) {
      check(armor_value_number(value, &value_));
    } else if constexpr (std::is_same_v<T, std::int64_t>) {
      check(armor_value_integer(value, &value_));
    } else if constexpr (std::is_same_v<T, bool>) {
      check(armor_value_flag(value, &value_));
    } else {
      static_assert(std::is_same_v<T, std::string>, "T is double, int64_t, bool or std::string");
      const bool is_path = type == ARMOR_PARAMETER_TYPE_PATH;
      const char *text = is_path ? armor_value_path(value) : armor_value_text(value);
      if (text == nullptr) throw Error(ARMOR_ERROR_PARAMETER, armor_last_error());
      value_ = text;
    }
  }

  T value_{};
};

// One task, in one process. The constructor declares the ports; parameters are members. It runs for
// `--describe` too, so it opens no hardware or files: `exec` does, at Call::Started.
//
// `exec`, `data_received` and `parameter_received` never run at the same time.
class Component {
 public:
  Component(std::string kind, std::string summary)
      : kind_(std::move(kind)), summary_(std::move(summary)) {}
  Component(const Component &) = delete;
  Component &operator=(const Component &) = delete;
  virtual ~Component() = default;

  // A parameter has arrived, or a live one has changed: the member has the new value. An exception
  // refuses it.
  virtual void parameter_received(std::string_view) {}
  // Data of an input have arrived.
  virtual void data_received(const Header &, const Data &) {}
  // One step of the component's work.
  virtual Outcome exec(Call) { return carry_on(); }

  const std::string &kind() const { return kind_; }

 protected:
  // Declares an output. `flags`: 0 or ARMOR_LATCHED.
  template <class T>
  void provide(const std::string &id, const std::string &doc = "", std::uint32_t flags = 0) {
    // After the constructor it is refused.
    if (handle_ != nullptr) check(armor_provide_schema(handle_, id.c_str(), schema_of<T>().c_str(), flags));
    ports_.push_back({id, doc, "", &schema_of<T>(), flags, true});
  }
  // Declares an input. `flags`: ARMOR_OPTIONAL, ARMOR_MANY. `stale_after`: the age from which on its
  // data are taken for missing.
  template <class T>
  void subscribe(const std::string &id, const std::string &doc = "", std::uint32_t flags = 0,
                 const std::string &stale_after = "") {
    if (handle_ != nullptr) check(armor_subscribe_schema(handle_, id.c_str(), schema_of<T>().c_str(), flags));
    ports_.push_back({id, doc, stale_after, &schema_of<T>(), flags, false});
  }
  // Declares an event that `exec` reports.
  void declare_event(const std::string &name, const std::string &doc = "", bool has_value = false,
                     const std::string &unit = "") {
    events_.push_back({name, doc, unit, has_value});
  }
  // It works until it is frozen, and never reports that it is done.
  void set_never_done() { never_done_ = true; }
  // Its task comes to an end by itself.
  void set_ends_by_itself() { ends_by_itself_ = true; }
  // It does nothing without a rate.
  void set_needs_rate() { needs_rate_ = true; }
  // It reads data of the system to which no link leads, as a recorder does. Where the file places such a
  // component on another host, that host may read all data.
  void set_reads_all() { reads_all_ = true; }
  // Forbids the executive to freeze this component.
  void set_non_controllable() {
    // After the constructor it is refused.
    if (handle_ != nullptr) check(armor_set_non_controllable(handle_));
    non_controllable_ = true;
  }

  // Publishes a message: encoded once, arrays sent from where they are. Threads of the component may
  // publish while it is active.
  template <class T>
  void send_data(const char *id, const T &message) const {
    const std::string *declared = find_schema(id, true);
    const std::string &used = schema_of<T>();
    if (declared != nullptr && declared != &used && *declared != used) {
      throw Error(ARMOR_ERROR_OTHER_TYPE, "output `" + std::string(id) + "` is declared as " +
                                              *declared + ", but " + used + " is sent");
    }
    const EncodedMessage<T> encoded(message);
    check(armor_send_bytes(handle(), id, encoded.pieces(), encoded.piece_count()));
  }
  // Passes a message on, on an output of any type.
  void send_data(const char *id, const AnyMessage &message) const {
    check(armor_send_any(handle(), id, message.get()));
  }
  // The current time of the whole system in seconds since the Unix epoch.
  double timestamp() const { return armor_timestamp(handle()); }
  // Requests a parameter again: its value arrives in `parameter_received`. Those that are members have been
  // requested before the first call of `exec`.
  void get_parameter(const char *name) const { check(armor_get_parameter(handle(), name)); }
  // Waits until every requested parameter has arrived, for at most ten seconds.
  void synchronize() const { check(armor_synchronize(handle())); }
  // The system-wide name of what an output publishes; empty if there is no such output.
  std::string provided_data(const char *id) const { return own(armor_provided_data(handle(), id)); }
  // The system-wide names of what feeds an input; empty if nothing does.
  std::string subscribed_data(const char *id) const {
    return own(armor_subscribed_data(handle(), id));
  }

 private:
  template <class T>
  friend class Parameter;
  friend class Runner;
  friend class Data;

  struct Port {
    std::string id, doc, stale_after;
    const std::string *schema;
    std::uint32_t flags;
    bool is_output;
  };
  struct DeclaredEvent {
    std::string name, doc, unit;
    bool has_value;
  };
  struct DeclaredParameter {
    ParameterOptions options;
    std::function<void(const armor_value *)> read;
  };

  static std::string own(const char *text) { return text == nullptr ? "" : text; }

  const armor_handle *handle() const {
    if (handle_ == nullptr) {
      throw Error(ARMOR_ERROR_NOT_ACTIVE, "the constructor only declares: send from `exec` on");
    }
    return handle_;
  }

  const std::string *find_schema(std::string_view id, bool is_output) const {
    for (const Port &port : ports_) {
      if (port.is_output == is_output && port.id == id) return port.schema;
    }
    return nullptr;
  }

  std::string kind_, summary_;
  std::deque<Port> ports_;
  std::deque<DeclaredEvent> events_;
  std::deque<DeclaredParameter> parameters_;
  bool never_done_ = false, ends_by_itself_ = false, needs_rate_ = false, reads_all_ = false;
  bool non_controllable_ = false;
  const armor_handle *handle_ = nullptr;
  std::string reported_;
};

inline History Data::history(const std::string &input, const std::string &source) const {
  const std::string *schema = component_ == nullptr ? nullptr : component_->find_schema(input, false);
  return {data_, input, source, schema == nullptr ? std::string_view() : *schema};
}

template <class T>
Parameter<T>::Parameter(Component *component, ParameterOptions options) {
  const armor_parameter_type type = options.type();
  component->parameters_.push_back(
      {std::move(options), [this, type](const armor_value *value) { read(value, type); }});
}

// A component as C sees it.
class Runner {
 public:
  // `build` may throw: that is a failure of the constructor.
  explicit Runner(const std::function<std::unique_ptr<Component>()> &build) {
    table_.kind = "component";
    table_.summary = "A component whose constructor has failed.";
    table_.user = this;
    table_.create = &Runner::create;
    table_.parameter_received = &Runner::parameter_received;
    table_.data_received = &Runner::data_received;
    table_.exec = &Runner::exec;
    try {
      component_ = build();
    } catch (const std::exception &error) {
      failure_ = error.what();
    } catch (...) {
      failure_ = UNKNOWN;
    }
    if (component_ != nullptr) declare();
  }
  Runner(const Runner &) = delete;
  Runner &operator=(const Runner &) = delete;

  const armor_component *table() const { return &table_; }
  Component *component() const { return component_.get(); }
  // Throws if there is no such output, or one of another type; outputs of any type have any.
  void check_output(const char *id, const std::string &used) const {
    const std::string *declared = component_->find_schema(id, true);
    const std::string output = "output `" + std::string(id) + "`";
    if (declared == nullptr) {
      throw Error(ARMOR_ERROR_UNKNOWN_PORT, "`" + component_->kind_ + "` has no " + output);
    }
    if (*declared != used && *declared != ARMOR_ANY) {
      const auto name = [](const std::string &schema) { return schema.substr(0, schema.find_first_of("{<")); };
      const bool differ = name(*declared) != name(used);
      throw Error(ARMOR_ERROR_OTHER_TYPE, output + " is declared as " + (differ ? name(*declared) : *declared) +
                                              ", but used as " + (differ ? name(used) : used));
    }
  }

 private:
  static constexpr const char *UNKNOWN = "an exception that is no std::exception";

  void declare() {
    const Component &component = *component_;
    for (const auto &parameter : component.parameters_) {
      parameters_.push_back(parameter.options.table());
    }
    for (const auto &port : component.ports_) {
      const char *age = port.stale_after.empty() ? nullptr : port.stale_after.c_str();
      if (!port.doc.empty() || age != nullptr) ports_.push_back({port.id.c_str(), port.doc.c_str(), age});
    }
    for (const auto &event : component.events_) {
      events_.push_back({event.name.c_str(), event.doc.c_str(), event.has_value, event.unit.c_str()});
    }
    table_.kind = component.kind_.c_str();
    table_.summary = component.summary_.c_str();
    table_.parameters = parameters_.data();
    table_.parameter_count = parameters_.size();
    table_.ports = ports_.data();
    table_.port_count = ports_.size();
    table_.events = events_.data();
    table_.event_count = events_.size();
    table_.never_done = component.never_done_;
    table_.ends_by_itself = component.ends_by_itself_;
    table_.needs_rate = component.needs_rate_;
    table_.reads_all = component.reads_all_;
  }

  // Runs code of the component: its exception is an error.
  template <class F>
  static int guard(F &&body) noexcept {
    try {
      body();
      return ARMOR_ERROR_NONE;
    } catch (const std::exception &error) {
      return armor_fail_with(error.what());
    } catch (...) {
      return armor_fail_with(UNKNOWN);
    }
  }

  static int create(const armor_handle *handle, void *user) {
    auto &runner = *static_cast<Runner *>(user);
    return guard([&] {
      if (runner.component_ == nullptr) throw std::runtime_error(runner.failure_);
      Component &component = *runner.component_;
      component.handle_ = handle;
      for (const auto &port : component.ports_) {
        const auto declare = port.is_output ? armor_provide_schema : armor_subscribe_schema;
        check(declare(handle, port.id.c_str(), port.schema->c_str(), port.flags));
      }
      for (const auto &parameter : component.parameters_) {
        check(armor_get_parameter(handle, parameter.options.name().c_str()));
      }
      if (component.non_controllable_) check(armor_set_non_controllable(handle));
    });
  }

  static int parameter_received(void *user, const char *name, const armor_value *value) {
    return guard([&] {
      Component &component = *static_cast<Runner *>(user)->component_;
      for (const auto &parameter : component.parameters_) {
        if (parameter.options.name() == name) parameter.read(value);
      }
      component.parameter_received(name);
    });
  }

  static int data_received(void *user, const armor_header *header, const armor_data *data) {
    return guard([&] {
      Component &component = *static_cast<Runner *>(user)->component_;
      const Header given{header->id,      header->data,     header->sequence,
                         header->stamp_s, header->instance, header->lost};
      const std::string *schema = component.find_schema(given.id, false);
      component.data_received(given, Data(data, given.id, schema == nullptr ? std::string_view() : *schema, &component));
    });
  }

  static armor_outcome exec(void *user, int call) {
    armor_outcome result{ARMOR_OUTCOME_KIND_FAILED, nullptr, 0.0};
    guard([&] {
      Component &component = *static_cast<Runner *>(user)->component_;
      Outcome outcome = component.exec(static_cast<Call>(call));
      component.reported_ = std::move(outcome.text);
      const char *text = component.reported_.c_str();
      if (outcome.kind == ARMOR_OUTCOME_KIND_FAILED) armor_fail_with(text);
      result = {outcome.kind, text, outcome.value};
    });
    return result;
  }

  std::unique_ptr<Component> component_;
  std::string failure_;
  std::vector<armor_parameter> parameters_;
  std::vector<armor_port_text> ports_;
  std::vector<armor_event> events_;
  armor_component table_{};
};

// Runs a component as this process, by its command line; returns the exit code of the process. The
// process ends without the component's destructor: what must be released is at Call::Stopping.
template <class C>
int run(int argc, char **argv) {
  static Runner *const runner = new Runner([] { return std::make_unique<C>(); });
  return armor_run(argc, argv, runner->table());
}

}  // namespace armor

#endif  // ARMOR_HPP
