// The component without a system: its time passes only in tick_after. An exception fails the test.

#include <armor_testing.hpp>

#include "component.hpp"

static void expect(bool condition, const char *what) {
  if (!condition) throw std::runtime_error(what);
}

int main() {
  armor::TestedComponent<{{Type}}> counter({{"step", "2"}});
  counter.start();
  for (int tick = 0; tick < 3; ++tick) counter.tick_after(0.1);
  const auto counts = counter.outputs<armor::messages::Count>("count");
  expect(counts.size() == 3, "three ticks, three messages");
  expect(counts[2].count == 6, "the sum after three steps of 2");
  expect(counter.reports().empty(), "it has neither failed nor ended");
  return 0;
}
