// {{Type}}: counts its steps and publishes the count.

#include <armor.hpp>
#include <armor_messages.hpp>

class {{Type}} : public armor::Component {
 public:
  // Declares the ports. Runs for --describe too, so it opens no hardware or files: `exec` does, at
  // Call::Started.
  {{Type}}() : Component("{{name}}", "Counts its steps.") {
    provide<armor::messages::Count>("count", "the sum so far");
  }

  armor::Outcome exec(armor::Call call) override {
    if (call == armor::Call::Tick) {
      count_ += static_cast<std::uint64_t>(step_.get());
      send_data("count", armor::messages::Count{count_});
    }
    return armor::carry_on();
  }

 private:
  armor::Parameter<std::int64_t> step_{
      this, armor::integer("step").default_value("1").range(1, 1000).doc("added at each step")};
  std::uint64_t count_ = 0;
};
