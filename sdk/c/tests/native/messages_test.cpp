// Structs of C++ as messages: every type of a field there and back, and the schemas of the standard
// messages, which the library knows from C.

#include <armor_messages.hpp>
#include <armor_testing.hpp>

#include "check.h"

namespace mine {

enum class Mode { Off = 3, On = 5 };
ARMOR_MESSAGE_ENUM(Mode, Off, On)

struct Part {
  std::uint8_t number = 0;
  std::string name;
  std::vector<double> values;
};
ARMOR_MESSAGE(Part, number, name, (values, "m"))

struct Every {
  bool is_on = false;
  std::int64_t i64 = 0;
  float f32 = 0.0F;
  double f64 = 0.0;
  std::string text;
  std::array<double, 3> fixed{};
  std::vector<float> list;
  std::vector<std::string> texts;
  std::vector<bool> flags;
  Part nested;
  std::array<Part, 2> two;
  std::vector<Part> parts;
  Mode mode = Mode::Off;
  std::optional<double> depth;
  std::optional<Part> spare;
};
ARMOR_MESSAGE(Every, is_on, i64, f32, (f64, "m/s"), text, (fixed, "rad"), list, texts, flags, nested, two,
              parts, mode, (depth, "m"), spare)

// The same message, read where it has arrived.
struct Samples {
  std::string frame;
  std::vector<float> values;
};
ARMOR_MESSAGE(Samples, frame, values)
struct SamplesView {
  std::string_view frame;
  armor::span<const float> values;
};
ARMOR_MESSAGE_NAMED("Samples", SamplesView, frame, values)

class Echo : public armor::Component {
 public:
  Echo() : Component("echo", "Sends back what it receives.") {
    subscribe<Every>("in");
    provide<Every>("out");
    subscribe<Samples>("samples", "", ARMOR_OPTIONAL);
    provide<Samples>("samples-back");
    subscribe<armor::messages::Image>("image", "", ARMOR_OPTIONAL);
    provide<armor::messages::ImageView>("image-back");
  }
  void data_received(const armor::Header &header, const armor::Data &data) override {
    if (header.id == "image") {
      const auto image = data.decode<armor::messages::ImageView>();
      first = image.data.data();
      kept = data.keep<armor::messages::Image>();
      return send_data("image-back", image);
    }
    if (header.id == "samples") return send_data("samples-back", data.decode<SamplesView>());
    CHECK(header.data == "test.in" && header.stamp_s == 1000.0 && header.lost == 0);
    send_data("out", data.decode<Every>());
  }
  const std::uint8_t *first = nullptr;
  armor::Kept kept;
};

// Uses its input as another type.
class Mistaken : public armor::Component {
 public:
  Mistaken() : Component("mistaken", "Decodes another type.") { subscribe<Part>("in"); }
  void data_received(const armor::Header &, const armor::Data &data) override { data.decode<Samples>(); }
};

}  // namespace mine

static bool operator==(const mine::Part &a, const mine::Part &b) {
  return a.number == b.number && a.name == b.name && a.values == b.values;
}

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

int main() {
  using namespace mine;
  CHECK(armor::schema_of<Part>() == "Part{number:u8,name:string,values:[f64](m)}");
  CHECK(armor::schema_of<Mode>() == "Mode<Off,On>");
  CHECK(armor::schema_of<SamplesView>() == armor::schema_of<Samples>());
  CHECK(armor::schema_of<armor::messages::ImageView>() == armor::schema_of<armor::messages::Image>());
  CHECK(armor::messages::Quaternion{}.w == 1.0 && std::isnan(armor::messages::Progress{}.fraction));

  armor::TestedComponent<Echo> echo;
  echo.start();
  const Part part{2, "zw\xc3\xb6i", {1.5, -1.5}};
  Every message;
  message.is_on = true, message.i64 = INT64_MIN, message.f32 = 0.5F, message.f64 = 2.5;
  message.text = std::string("a\0b", 3);
  message.fixed = {1, 2, 3};
  message.list.assign(500, 0.25F);
  message.texts = {"a", ""};
  message.flags = {true, false, true};
  message.nested = part, message.two[1] = part, message.parts = {part, Part{}};
  message.mode = Mode::On;
  message.depth = 3.5;
  echo.send("in", message);
  message.depth.reset(), message.spare = part;
  echo.send("in", message);
  const auto outputs = echo.outputs<Every>("out");
  CHECK(outputs.size() == 2);
  for (const Every &back : outputs) {
    CHECK(back.is_on && back.i64 == INT64_MIN && back.f32 == 0.5F && back.f64 == 2.5);
    CHECK(back.text == message.text && back.fixed == message.fixed && back.list == message.list);
    CHECK(back.texts == message.texts && back.flags == message.flags && back.nested == part);
    CHECK(back.two[1] == part && back.parts.size() == 2 && back.parts[0] == part);
    CHECK(back.mode == Mode::On);
  }
  CHECK(outputs[0].depth == 3.5 && !outputs[0].spare && !outputs[1].depth && *outputs[1].spare == part);

  // A span is aligned, whatever the length of the text before it.
  for (std::size_t len = 0; len < 8; ++len) {
    echo.send("samples", Samples{std::string(len, 'x'), std::vector<float>(300 + len, 1.0F)});
  }
  const auto samples = echo.outputs<SamplesView>("samples-back");
  for (std::size_t len = 0; len < 8; ++len) {
    CHECK(samples[len].frame.size() == len && samples[len].values.size() == 300 + len);
    CHECK(samples[len].values[299] == 1.0F);
  }

  // A kept message outlives the call.
  armor::messages::Image image;
  image.data.assign(4000, 9);
  echo.send("image", image);
  CHECK(echo.component().first != nullptr);
  CHECK(echo.component().kept.decode<armor::messages::ImageView>().data[3999] == 9);
  CHECK(echo.outputs<armor::messages::Image>("image-back")[0].data == image.data);

  // What is wrong is an exception, and in a component a failure.
  message.mode = static_cast<Mode>(4);
  check_throws([&] { echo.send("in", message); }, "an enum has a value without a name");
  check_throws([&] { echo.send("in", part); }, "is declared as Every, but");
  check_throws([&] { echo.outputs<Part>("out"); }, "is declared as Every, but used as Part");
  armor::TestedComponent<Mistaken> mistaken;
  mistaken.start();
  check_throws([&] { mistaken.send("in", part); }, "but was decoded as Samples{");
  armor::Arena arena;
  const std::uint8_t bytes[] = {1, 255, 255, 255, 255, 255, 255, 255, 255};
  check_throws([&] { armor::decode_message<Part>(bytes, sizeof bytes, arena); }, "longer than the message");
  check_throws([&] { armor::decode_message<Part>(bytes, 3, arena); }, "ends within a value");
  std::puts("messages of C++: passed");
  return 0;
}
