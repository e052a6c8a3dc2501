// The peer of measure.sh and memory.sh in C++.

#include <algorithm>
#include <armor_messages.hpp>
#include <chrono>
#include <fstream>

using armor::messages::ImageView;
using Clock = std::chrono::steady_clock;

// The first trips of each are not counted: memory that is touched for the first time, and caches.
constexpr std::uint64_t ROUND_TRIPS = 20'000, IMAGE_TRIPS = 2'000, WARM_UP = 200;

// 100 bytes on the wire.
struct Small {
  std::uint64_t number = 0;
  std::array<std::uint8_t, 92> payload{};
};
ARMOR_MESSAGE(Small, number, payload)

class Peer : public armor::Component {
 public:
  Peer() : Component("cpp-peer", "Measures links.") {
    subscribe<Small>("small-in", "", ARMOR_OPTIONAL);
    provide<Small>("small-out");
    subscribe<ImageView>("image-in", "", ARMOR_OPTIONAL);
    provide<ImageView>("image-out");
  }

  void data_received(const armor::Header &header, const armor::Data &data) override {
    if (header.id == "image-in") return take_image(data.decode<ImageView>());
    const auto small = data.decode<Small>();
    if (role_.get() == "answer") return send_data("small-out", small);
    if (role_.get() == "ask") {
      take_time();
      if (small.number + 1 < ROUND_TRIPS) return send_small(small.number + 1);
      log_times("round trip 100 B");
      pixels_.assign(static_cast<std::size_t>(image_.get()), 7);
      return send_image(0);
    }
    if (count_++ == 0) sent_ = Clock::now();
    const auto messages = static_cast<std::uint64_t>(flood_.get());
    if (count_ % (messages / 10) == 0) {
      armor::log_info("measured: " + std::to_string(count_) + " messages, " + resident() + " resident");
    }
    if (count_ == messages) {
      const double rate = static_cast<double>(messages) / seconds() / 1e6;
      armor::log_info("measured: flood 100 B: " + std::to_string(rate) + " M msg/s");
    }
  }

  armor::Outcome exec(armor::Call call) override {
    const bool is_first = role_.get() == "ask" || role_.get() == "flood";
    // At the second tick the links are up.
    if (call != armor::Call::Tick || !is_first || ++count_ != 2) return armor::carry_on();
    const std::uint64_t messages = role_.get() == "ask" ? 1 : static_cast<std::uint64_t>(flood_.get());
    for (std::uint64_t number = 0; number < messages; ++number) send_small(number);
    return armor::carry_on();
  }

 private:
  // Resident memory of this process.
  static std::string resident() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
      if (line.rfind("VmRSS:", 0) == 0) return line.substr(line.find_first_of("0123456789"));
    }
    return "?";
  }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - sent_).count(); }

  void send_small(std::uint64_t number) {
    if (role_.get() == "ask") sent_ = Clock::now();
    send_data("small-out", Small{number, {}});
  }

  void send_image(std::uint32_t number) {
    ImageView image;
    image.width = number;
    image.height = 1;
    image.data = armor::span<const std::uint8_t>(pixels_);
    sent_ = Clock::now();
    send_data("image-out", image);
  }

  void take_image(const ImageView &view) {
    if (role_.get() == "answer") {
      ImageView image;
      image.width = view.width;
      image.height = static_cast<std::uint32_t>(view.data[0]) + view.data[view.data.size() - 1];
      return send_data("image-out", image);
    }
    take_time();
    if (view.width + 1 < IMAGE_TRIPS) return send_image(view.width + 1);
    log_times(std::to_string(image_.get()) + " B image and answer");
    armor::log_info("measured: end");
  }

  void take_time() { times_us_.push_back(seconds() * 1e6); }

  void log_times(const std::string &what) {
    times_us_.erase(times_us_.begin(), times_us_.begin() + WARM_UP);
    std::sort(times_us_.begin(), times_us_.end());
    const double p50 = times_us_[times_us_.size() / 2], p99 = times_us_[times_us_.size() * 99 / 100];
    armor::log_info("measured: " + what + ": " + std::to_string(p50) + " us p50, " + std::to_string(p99) +
                    " us p99");
    times_us_.clear();
  }

  armor::Parameter<std::string> role_{
      this, armor::text("role").default_value("answer").doc("ask, answer, flood or count")};
  armor::Parameter<std::int64_t> flood_{
      this, armor::integer("flood").default_value("2000000").range(10, 1e12).doc("messages of a flood")};
  armor::Parameter<std::int64_t> image_{
      this, armor::integer("image").default_value("8388608").range(1, 6e7).doc("bytes of an image")};
  std::uint64_t count_ = 0;
  Clock::time_point sent_;
  std::vector<double> times_us_;
  std::vector<std::uint8_t> pixels_;
};

int main(int argc, char **argv) { return armor::run<Peer>(argc, argv); }
