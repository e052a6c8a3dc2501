// Components of C++: parameters, events, exceptions.

#include <armor_messages.hpp>
#include <armor_testing.hpp>
#include <thread>

#include "check.h"

using armor::messages::Count;

class Speaker : public armor::Component {
 public:
  Speaker() : Component("speaker", "Speaks.") {
    provide<Count>("out", "what it says");
    declare_event("spoken", "it has spoken", true);
  }
  void parameter_received(std::string_view name) override {
    received += std::string(name) + " ";
    if (name == "speed" && speed == 0.5) throw std::invalid_argument("speed is not 0.5 m/s");
  }
  armor::Outcome exec(armor::Call call) override {
    calls += "STDX"[static_cast<int>(call)];
    if (call != armor::Call::Tick) return armor::carry_on();
    if (wrong == "throw") throw std::runtime_error("no camera");
    if (wrong == "number") throw 7;
    if (wrong == "port") send_data("none", Count{1});
    if (wrong == "type") send_data("out", armor::messages::Flag{true});
    if (wrong == "failed") return armor::failed("it is hoarse");
    if (wrong == "event") return armor::event("silence");
    if (wrong == "done") return armor::done();
    // A thread of its own sends, too.
    std::thread([this] { send_data("out", Count{8}); }).join();
    return armor::event("spoken", 0.25);
  }

  armor::Parameter<double> speed{
      this, armor::number("speed", "m/s").default_value("0.1m/s").range(0, 1).live()};
  armor::Parameter<std::int64_t> count{this, armor::integer("count").default_value("3")};
  armor::Parameter<bool> loud{this, armor::flag("loud").default_value("true")};
  armor::Parameter<std::string> name{this, armor::choice("name", "a b").default_value("b")};
  armor::Parameter<std::string> file{this, armor::path("file").default_value("/tmp/x")};
  std::string received, calls, wrong;
};

// Opens its device too early.
class Eager : public armor::Component {
 public:
  Eager() : Component("eager", "Fails.") { throw std::runtime_error("no device"); }
  armor::Parameter<double> speed{this, armor::number("speed", "m/s").default_value("0.1m/s")};
};

// Declares what contradicts itself.
class Twice : public armor::Component {
 public:
  Twice() : Component("twice", "Fails.") {
    provide<Count>("out");
    provide<Count>("out");
  }
};

template <class F>
static void check_throws(F &&body, const char *text) {
  try {
    body();
  } catch (const std::exception &error) {
    if (std::string(error.what()).find(text) != std::string::npos) return;
    std::fprintf(stderr, "`%s` is not in `%s`\n", text, error.what());
    std::exit(1);
  }
  std::fprintf(stderr, "nothing is thrown with `%s`\n", text);
  std::exit(1);
}

static void check_failure(const char *wrong, const char *reason) {
  armor::TestedComponent<Speaker> speaker;
  speaker.component().wrong = wrong;
  speaker.start();
  check_throws([&] { speaker.tick_after(0.1); }, reason);
  CHECK(speaker.state() == ARMOR_STATE_FAILED);
  CHECK(speaker.reports().back().text.find(reason) != std::string::npos);
}

int main() {
  armor::TestedComponent<Speaker> speaker({{"speed", "20cm/s"}, {"name", "a"}});
  Speaker &component = speaker.component();
  CHECK(component.speed == 0.2 && component.count == 3 && component.loud && component.name.get() == "a");
  CHECK(component.file.get() == "/tmp/x" && component.received == "speed count loud name file ");
  speaker.start();
  speaker.tick_after(0.1);
  check_throws([&] { speaker.set_parameter("speed", "0.5m/s"); }, "speed is not 0.5 m/s");
  check_throws([&] { speaker.set_parameter("speed", "2m/s"); }, "out of range");
  speaker.set_parameter("speed", "1m/s");
  CHECK(component.speed == 1.0);
  CHECK(speaker.outputs<Count>("out").at(0).count == 8);
  const auto reports = speaker.reports();
  CHECK(reports.at(0).kind == ARMOR_OUTCOME_KIND_EVENT && reports[0].text == "spoken");
  CHECK(reports[0].value == 0.25);
  component.wrong = "done";
  speaker.tick_after(0.1);
  CHECK(speaker.state() == ARMOR_STATE_DONE);
  speaker.stop();
  CHECK(component.calls == "STTX");

  check_failure("throw", "no camera");
  check_failure("number", "an exception that is no std::exception");
  check_failure("port", "declare it with `provide` in the constructor (`create` in C)");
  check_failure("type", "output `out` is declared as Count{count:u64}, but Flag{data:bool} is sent");
  check_failure("failed", "it is hoarse");
  check_failure("event", "the event `silence` is not declared, only: spoken; add it to its events");
  check_throws([] { armor::TestedComponent<Eager> eager; }, "no device");
  check_throws([] { armor::TestedComponent<Eager>({{"speed", "1m/s"}}); }, "no device");
  check_throws([&] { speaker.outputs<Count>("none"); }, "`speaker` has no output `none`");
  check_throws([&] { speaker.outputs<armor::messages::Flag>("out"); }, "is declared as Count, but used as Flag");
  check_throws([] { armor::TestedComponent<Twice> twice; }, "declared twice");
  check_throws([] { armor::TestedComponent<Speaker>({{"volume", "1"}}); }, "volume");
  std::puts("behaviour of C++: passed");
  return 0;
}
