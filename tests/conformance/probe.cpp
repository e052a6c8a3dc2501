// The probe of the conformance test in C++; see probe.rs.

#include <armor_messages.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

using armor::AnyMessage;
using armor::messages::Count;
using armor::messages::Image;
using armor::messages::ImageView;
using armor::messages::Number;
using armor::messages::Pose2D;
using namespace std::chrono_literals;

constexpr std::size_t IMAGE_LEN = 1 << 20;

enum class Side : std::uint32_t { Left, Right };
ARMOR_MESSAGE_ENUM(Side, Left, Right)

struct Part {
  std::int32_t id{};
  std::string name{};
};
ARMOR_MESSAGE_NAMED("Part", Part, id, name)

struct Mixed {
  bool flag{};
  std::int8_t small{};
  std::uint64_t wide{};
  double number{};
  float single{};
  std::string text{};
  std::optional<double> maybe{};
  Side side{};
  Pose2D pose{};
  std::vector<Part> parts{};
  std::vector<double> numbers{};
  std::array<double, 3> fixed{};
};
ARMOR_MESSAGE_NAMED("Mixed", Mixed, flag, small, wide, (number, "m"), single, text, maybe, side, pose, parts,
                    numbers, fixed)

namespace {

// The behaviour of this process is the name of the component.
std::string behaviour;

// Writes what the test looks for into the log.
template <class... T>
void note(const T &...parts) {
  std::ostringstream text;
  text << std::boolalpha << "seen: ";
  (text << ... << parts);
  armor::log_info(text.str());
}

template <class F>
void refusal(F &&work) {
  try {
    work();
    note("nothing is refused");
  } catch (const std::exception &error) {
    note("refused: ", error.what());
  }
}

bool is_even(const ImageView &image) {
  for (const std::uint8_t byte : image.data) {
    if (byte != image.data[0]) return false;
  }
  return true;
}

class Probe : public armor::Component {
 public:
  Probe() : Component("probe", "Shows how a component behaves.") {
    provide<Count>("out");
    provide<Count>("state", "", ARMOR_LATCHED);
    provide<Mixed>("mixed");
    provide<Image>("image");
    subscribe<Count>("in", "", ARMOR_OPTIONAL);
    subscribe<Count>("other", "", ARMOR_OPTIONAL);
    subscribe<Count>("many", "", ARMOR_OPTIONAL | ARMOR_MANY);
    subscribe<Mixed>("mixed_in", "", ARMOR_OPTIONAL);
    subscribe<Image>("image_in", "", ARMOR_OPTIONAL);
    subscribe<AnyMessage>("any_in", "", ARMOR_OPTIONAL | ARMOR_MANY);
    provide<AnyMessage>("any_out");
    provide<AnyMessage>("any_last", "", ARMOR_LATCHED);
    declare_event("near", "something is near", true, "m");
    declare_event("over", "it is over");
    set_reads_all();
    if (behaviour == "declare-twice") provide<Count>("out");
    if (behaviour == "declare-bad-name") provide<Count>("7 up");
    if (behaviour == "construct-fails") throw std::runtime_error("no hardware");
  }

  void parameter_received(std::string_view name) override {
    if (name == "number" && number_ == 0.9) throw std::runtime_error("0.9 is not for this probe");
    if (name == "number") note("parameter number=", number_.get());
    if (name == "whole") note("parameter whole=", whole_.get());
    if (name == "flag") note("parameter flag=", flag_.get());
    if (name == "text") note("parameter text=", text_.get());
    if (name == "file") note("parameter file=", file_.get());
  }

  void data_received(const armor::Header &header, const armor::Data &data) override {
    received_ += 1;
    if (header.id == "mixed_in") return receive_mixed(data.decode<Mixed>());
    if (header.id == "image_in") return receive_image(data);
    if (header.id == "any_in") return pass_on(header, data.any());
    const auto count = data.decode<Count>().count;
    if (behaviour == "any-receiver") compare_stamps(header, count);
    if (received_ <= 40) {
      note("data ", header.id, " count=", count, " lost=", header.lost, " from=", header.data);
    }
    if (received_ == 1) {
      note("stamp recent=", std::abs(timestamp() - header.stamp_s) < 5.0, " instance=", header.instance != 0);
    }
    if (behaviour == "data-failure") throw std::runtime_error("the data are spoilt");
    if ((behaviour == "history" || behaviour == "history-forgotten") && received_ <= 4) show_history(data.history());
    if (behaviour == "history-none" && received_ == 1) {
      refusal([&] { data.history(); });
      refusal([&] { data.history("none"); });
    }
  }

  armor::Outcome exec(armor::Call call) override {
    if (call == armor::Call::Started) ticks_ = received_ = 0;
    else if (call != armor::Call::Stopping) ticks_ += 1;
    if (ticks_ <= 5 || call == armor::Call::Stopping) {
      const char *const words[] = {"started", "tick", "data", "stopping"};
      note("call ", words[static_cast<int>(call)]);
    }
    if (call == armor::Call::Started) begin();
    else if (call != armor::Call::Stopping) return work();
    return armor::carry_on();
  }

 private:
  void begin() {
    since_s_ = timestamp();
    if (behaviour == "declare-late") refusal([&] { provide<Count>("late"); });
    if (behaviour == "forbid-late") refusal([&] { set_non_controllable(); });
    if (behaviour == "send-unknown") refusal([&] { send_data("nothing", Count{1}); });
    if (behaviour == "send-wrong-type") refusal([&] { send_data("out", Number{1.0}); });
    if (behaviour == "names") {
      const auto show = [](const std::string &name) { return name.empty() ? "none" : name; };
      note("provided ", show(provided_data("out")));
      note("provided ", show(provided_data("nothing")));
      note("subscribed ", show(subscribed_data("in")));
      note("subscribed ", show(subscribed_data("other")));
    }
  }

  armor::Outcome work() {
    const auto is = [this](const char *name, int tick) { return behaviour == name && ticks_ == tick; };
    if (is("failed", 2)) return armor::failed("no power");
    if (is("failed-silently", 2)) return armor::failed("");
    if (is("exception", 2)) throw std::runtime_error("no power at all");
    if (is("done", 2)) return armor::done();
    if (is("event", 3)) return armor::event("near", 0.5);
    if (is("event-undeclared", 2)) return armor::event("far", 0.5);
    if (is("crash", 2) && !std::filesystem::exists(file_.get())) {
      std::ofstream(file_.get()).close();
      std::abort();
    }
    if (is("hang", 2)) std::this_thread::sleep_for(600s);
    if (is("busy", 2)) std::this_thread::sleep_for(2600ms);
    if ((behaviour == "slow" || behaviour == "slow-all") && ticks_ <= 6) std::this_thread::sleep_for(300ms);
    if (is("freeze-in-exec", 2)) {
      std::this_thread::sleep_for(1500ms);
      note("the call ends");
    }
    if (is("print", 1)) std::puts("printed on stdout");
    if (is("synchronize", 2)) {
      get_parameter("number");
      synchronize();
      note("synchronized");
    }
    if (is("time", 3)) {
      const double now_s = timestamp();
      const auto wall = std::chrono::system_clock::now().time_since_epoch();
      const double wall_s = std::chrono::duration<double>(wall).count();
      note("time right=", std::abs(now_s - wall_s) < 5.0, " passes=", now_s > since_s_);
    }
    if (is("any", 5) && any_) send_data("any_last", any_);
    if (behaviour == "sender") send_data("out", Count{++published_});
    return armor::carry_on();
  }

  void pass_on(const armor::Header &header, const AnyMessage &message) {
    if (!any_) {
      any_ = message;
      note("any type=", message.type_name(), " schema=", message.schema(), " len=", message.bytes().size(),
           " stamp=", message.stamp_s() == header.stamp_s);
    }
    send_data("any_out", message);
  }

  void compare_stamps(const armor::Header &header, std::uint64_t count) {
    if (header.id == "in") stamps_[count] = header.stamp_s;
    else if (stamps_.count(count) > 0 && stamps_[count] == header.stamp_s) note("passed on with its stamp=true");
  }

  void receive_mixed(Mixed mixed) {
    if (++mixed_ == 1) {
      note("mixed wide=", mixed.wide, " small=", static_cast<int>(mixed.small), " text=", mixed.text);
      std::ostringstream maybe;
      if (mixed.maybe.has_value()) maybe << *mixed.maybe;
      const std::string shown = mixed.maybe.has_value() ? maybe.str() : "none";
      note("mixed maybe=", shown, " parts=", mixed.parts.size(), " numbers=", mixed.numbers.size());
    }
    mixed.maybe.reset();
    send_data("mixed", mixed);
  }

  void receive_image(const armor::Data &data) {
    const auto image = data.decode<ImageView>();
    images_ += 1;
    if (images_ == 1) note("image whole=", image.data.size() == IMAGE_LEN && is_even(image));
    send_data("image", image);
    if (images_ == 1) {
      kept_ = data.keep<ImageView>();
    } else if (images_ == 4) {
      note("kept unchanged=", is_even(kept_.decode<ImageView>()));
    }
  }

  void show_history(const armor::History &history) {
    std::string text;
    const auto oldest = history[history.size() - 1].decode<Count>().count;
    for (std::size_t age = 0; age < history.size(); ++age) {
      text += " " + std::to_string(history[age].decode<Count>().count - oldest);
    }
    note("history", text);
    if (received_ != 4) return;
    const auto around = history.around((history[0].stamp_s() + history[1].stamp_s()) / 2.0);
    const auto nearest = history.nearest(history[2].stamp_s() + 1e-4);
    note("around ", around->first.age(), " ", around->second.age(), " nearest ", nearest->age());
    note("around nothing=", !history.around(history[2].stamp_s() - 10.0).has_value());
  }

  armor::Parameter<double> number_{
      this, armor::number("number", "m/s").default_value("0.3m/s").range(0.0, 1.0).live().doc("A speed.")};
  armor::Parameter<std::int64_t> whole_{this, armor::integer("whole").default_value("7").doc("A whole number.")};
  armor::Parameter<bool> flag_{this, armor::flag("flag").default_value("false").doc("A flag.")};
  armor::Parameter<std::string> text_{this, armor::text("text").default_value("none").doc("A text.")};
  armor::Parameter<std::string> file_{this, armor::path("file").default_value("mark").doc("A file.")};
  int ticks_ = 0, received_ = 0, images_ = 0, mixed_ = 0;
  std::uint64_t published_ = 0;
  armor::Kept kept_;
  AnyMessage any_;
  // Of the data of `in`, by their count.
  std::map<std::uint64_t, double> stamps_;
  double since_s_ = 0.0;
};

}  // namespace

int main(int argc, char **argv) {
  for (int index = 1; index + 1 < argc; ++index) {
    if (std::string_view(argv[index]) == "--name") behaviour = argv[index + 1];
  }
  return armor::run<Probe>(argc, argv);
}
