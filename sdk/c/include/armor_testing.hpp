// Components of C++ under test: no process, no socket; the test advances the time. With the version of
// these functions for C in armor.h, `armor_test_…`.
//
//   armor::TestedComponent<Follower> follower({{"speed", "0.2m/s"}});
//   follower.start();
//   follower.send("scan", scan);
//   follower.tick_after(0.1);
//   assert(follower.outputs<Twist>("velocity").size() == 1);

#ifndef ARMOR_TESTING_HPP
#define ARMOR_TESTING_HPP

#include <initializer_list>

#include "armor.hpp"

namespace armor {

// What a component has reported.
struct Report {
  armor_outcome_kind kind;
  // The name of an event, or the reason of a failure.
  std::string text;
  double value;
};

// A component under test. A step in which the component fails throws armor::Error with the reason.
template <class C>
class TestedComponent {
 public:
  // `settings` have their values as in a file; the other parameters have their defaults.
  explicit TestedComponent(std::initializer_list<armor_setting> settings = {})
      : runner_([] { return std::make_unique<C>(); }), test_(nullptr, armor_test_free) {
    // Without a component there are no parameters: the reason is what its constructor has thrown.
    const std::size_t count = runner_.component() == nullptr ? 0 : settings.size();
    test_.reset(armor_test_build(runner_.table(), settings.begin(), count));
    if (test_ == nullptr) throw Error(ARMOR_ERROR_TEST, armor_last_error());
  }

  // The component itself.
  C &component() { return static_cast<C &>(*runner_.component()); }
  // Activates it: exec(Call::Started).
  void start() { check(armor_test_start(test_.get())); }
  // Freezes it: exec(Call::Stopping).
  void stop() { check(armor_test_stop(test_.get())); }
  // Calls `exec` after each message from now on, as in a file that gives it no rate.
  void execute_on_data() { check(armor_test_execute_on_data(test_.get())); }
  // Lets time pass, then calls exec(Call::Tick).
  void tick_after(double seconds) { check(armor_test_tick_after(test_.get(), seconds)); }
  // Lets time pass without a call.
  void pass_time(double seconds) { check(armor_test_pass_time(test_.get(), seconds)); }
  // Changes a live parameter.
  void set_parameter(const char *name, const char *value) {
    check(armor_test_set_parameter(test_.get(), name, value));
  }

  // Hands a message to it as data of an input.
  template <class T>
  void send(const char *input, const T &message) {
    const EncodedMessage<T> encoded(message);
    check(armor_test_send_bytes(test_.get(), input, schema_of<T>().c_str(), encoded.pieces(),
                                encoded.piece_count()));
  }

  // All messages that have been published on an output. Spans in them are valid as long as the test.
  template <class T>
  std::vector<T> outputs(const char *output) {
    std::vector<T> messages;
    runner_.check_output(output, schema_of<T>());
    const std::size_t count = armor_test_output_count(test_.get(), output);
    for (std::size_t index = 0; index < count; ++index) {
      std::size_t len = 0;
      const std::uint8_t *bytes =
          armor_test_output_bytes(test_.get(), output, index, schema_of<T>().c_str(), &len);
      if (bytes == nullptr) throw Error(ARMOR_ERROR_TEST, armor_last_error());
      messages.push_back(decode_message<T>(bytes, len, arena_));
    }
    return messages;
  }

  // Everything that it has reported, in order.
  std::vector<Report> reports() {
    std::vector<Report> reports;
    const std::size_t count = armor_test_report_count(test_.get());
    for (std::size_t index = 0; index < count; ++index) {
      armor_report report{};
      check(armor_test_report(test_.get(), index, &report));
      reports.push_back({static_cast<armor_outcome_kind>(report.kind), report.text, report.value});
    }
    return reports;
  }

  armor_state state() const { return static_cast<armor_state>(armor_test_state(test_.get())); }

 private:
  Runner runner_;
  std::unique_ptr<armor_test, decltype(&armor_test_free)> test_;
  Arena arena_;
};

}  // namespace armor

#endif  // ARMOR_TESTING_HPP
