// Throws at its third tick.

#include <armor_messages.hpp>

class Thrower : public armor::Component {
 public:
  Thrower() : Component("thrower", "Throws.") { provide<armor::messages::Count>("ticks"); }
  armor::Outcome exec(armor::Call call) override {
    if (call != armor::Call::Tick) return armor::carry_on();
    if (++ticks_ == 3) throw std::runtime_error("the third tick is too much");
    send_data("ticks", armor::messages::Count{ticks_});
    return armor::carry_on();
  }

 private:
  std::uint64_t ticks_ = 0;
};

int main(int argc, char **argv) { return armor::run<Thrower>(argc, argv); }
