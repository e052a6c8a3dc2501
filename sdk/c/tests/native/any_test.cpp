// Messages of any type in C++: passed on when they arrive, and later.

#include <armor_messages.hpp>
#include <armor_testing.hpp>

#include "check.h"

#include <cstring>

namespace {

using armor::AnyMessage;
using armor::messages::Count;
using armor::messages::Image;
using armor::messages::Number;

template <class F>
std::string refusal(F &&work) {
  try {
    work();
  } catch (const armor::Error &error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

class Passer : public armor::Component {
 public:
  Passer() : Component("passer", "Passes messages on.") {
    subscribe<AnyMessage>("in", "what is passed on", ARMOR_MANY);
    subscribe<Count>("typed", "", ARMOR_OPTIONAL);
    provide<AnyMessage>("out");
    provide<AnyMessage>("first", "", ARMOR_LATCHED);
  }
  void data_received(const armor::Header &header, const armor::Data &data) override {
    if (header.id == "typed") {
      CHECK(contains(refusal([&] { data.any(); }), "declared as Count, but was decoded as Any"));
      CHECK(contains(refusal([&] { data.history()[0].any(); }), "declared as Count, but was decoded as Any"));
      return;
    }
    CHECK(contains(refusal([&] { data.decode<Count>(); }), "declared as Any{}"));
    const AnyMessage message = data.any();
    CHECK(message.stamp_s() == header.stamp_s && message.schema() == armor::schema_of<Image>());
    CHECK(message.type_name() == "Image" && message.bytes().size() > 100000);
    const AnyMessage newest = data.history()[0].any();
    CHECK(newest.schema() == message.schema() && newest.stamp_s() == header.stamp_s);
    CHECK(newest.bytes().size() == message.bytes().size());
    if (first) {
      const AnyMessage past = data.history("in")[1].any();
      CHECK(past.type_name() == "Image" && past.stamp_s() == first.stamp_s());
      CHECK(std::memcmp(past.bytes().data(), first.bytes().data(), first.bytes().size()) == 0);
    }
    if (!first) first = message;
    send_data("out", message);
  }
  armor::Outcome exec(armor::Call call) override {
    if (call != armor::Call::Tick) return armor::carry_on();
    send_data("first", first);
    CHECK(contains(refusal([&] { send_data("out", Count{1}); }), "output `out` is declared as Any{}"));
    CHECK(contains(refusal([&] { send_data("out", AnyMessage()); }), "any is NULL"));
    return armor::carry_on();
  }

  AnyMessage first;
};

}  // namespace

int main() {
  armor::TestedComponent<Passer> passer;
  passer.start();
  Image image;
  for (const std::uint8_t shade : {1, 2}) {
    image.data.assign(100000, shade);
    passer.send("in", image);
  }
  passer.send("typed", Count{3});
  passer.tick_after(0.1);
  const auto out = passer.outputs<Image>("out");
  CHECK(out.size() == 2 && out[1].data == image.data);
  const auto first = passer.outputs<Image>("first");
  CHECK(first.size() == 1 && first[0].data == out[0].data);
  CHECK(contains(refusal([&] { passer.send("in", Number{1.0}); }), "which input `in` does not take"));
  CHECK(!AnyMessage() && AnyMessage().bytes().size() == 0 && AnyMessage().schema().empty());
  return 0;
}
