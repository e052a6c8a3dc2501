// The history of an input in C++: newest first, nearest, around, and what is refused.

#include <armor_messages.hpp>
#include <armor_testing.hpp>

#include "check.h"

using armor::messages::Count;
using armor::messages::LaserScan;
using armor::messages::LaserScanView;

namespace {

template <class F>
std::string refusal(F &&body) {
  try {
    body();
  } catch (const armor::Error &error) {
    return error.what();
  }
  return "nothing is refused";
}

bool contains(const std::string &text, const char *part) { return text.find(part) != std::string::npos; }

class Stepper : public armor::Component {
 public:
  Stepper() : Component("stepper", "Reads a history.") {
    subscribe<Count>("steps");
    subscribe<LaserScan>("scan");
  }
  void data_received(const armor::Header &header, const armor::Data &data) override {
    if (header.id == "scan") {
      const armor::History history = data.history();
      // Each message of the history has its own memory.
      const auto newest = history[0], older = history[history.size() - 1];
      CHECK(newest.decode<LaserScanView>().ranges[0] == static_cast<float>(history.size()));
      CHECK(older.decode<LaserScanView>().ranges[0] == 1.0F);
      return;
    }
    if (++received < 3) return;
    const armor::History history = data.history();
    CHECK(history.size() == 3 && !history.empty());
    for (std::size_t age = 0; age < history.size(); ++age) {
      CHECK(history[age].decode<Count>().count == 3 - age && history[age].age() == age);
      CHECK(history[age].sequence() == 2 - age && !history[age].follows_gap());
    }
    CHECK(history.nearest(1000.9)->decode<Count>().count == 2);
    const auto [earlier, later] = *history.around(1000.5);
    CHECK(earlier.stamp_s() == 1000.0 && later.stamp_s() == 1001.0);
    CHECK(!history.around(999.0).has_value());
    CHECK(data.history("steps", "test.steps").size() == 3 && data.history("scan").empty());
    CHECK(!data.history("scan").nearest(1000.0).has_value());
    CHECK(contains(refusal([&] { data.history("none"); }), "no input `none`"));
    CHECK(contains(refusal([&] { history[3]; }), "has 3 messages"));
    CHECK(contains(refusal([&] { history[0].decode<LaserScan>(); }), "declared as Count"));
  }
  int received = 0;
};

}  // namespace

int main() {
  armor::TestedComponent<Stepper> stepper;
  stepper.start();
  for (std::uint64_t step = 1; step <= 3; ++step) {
    stepper.send("steps", Count{step});
    stepper.pass_time(1.0);
  }
  CHECK(stepper.component().received == 3);
  LaserScan scan;
  for (const float range : {1.0F, 2.0F}) {
    scan.ranges.assign(1000, range);
    stepper.send("scan", scan);
  }
  return 0;
}
