// The peer of measure.sh and memory.sh in C++.

#include <algorithm>
#include <armor_messages.hpp>
#include <chrono>
#include <fstream>

using armor::messages::ImageView;
using Clock = std::chrono::steady_clock;

// The first trips of each are not counted: memory that is touched for the first time, and caches.
constexpr std::uint64_t ROUND_TRIPS = 5'000, IMAGE_TRIPS = 1'000, WARM_UP = 100;
constexpr std::array<std::size_t, 3> IMAGE_LENS = {64 << 10, 1 << 20, 8 << 20};

// 100 bytes on the wire.
struct Small {
  std::uint64_t number = 0;
  std::array<std::uint8_t, 92> payload{};
};
ARMOR_MESSAGE(Small, number, payload)

enum class Role { Ask, Answer, Flood, Count };

class Peer : public armor::Component {
 public:
  Peer() : Component("cpp-peer", "Measures links.") {
    subscribe<Small>("small-in", "", ARMOR_OPTIONAL);
    provide<Small>("small-out");
    subscribe<ImageView>("image-in", "", ARMOR_OPTIONAL);
    provide<ImageView>("image-out");
  }

  void parameter_received(std::string_view) override {
    const std::string_view names[] = {"ask", "answer", "flood", "count"};
    for (int at = 0; at < 4; ++at) {
      if (role_text_.get() == names[at]) role_ = static_cast<Role>(at);
    }
  }

  void data_received(const armor::Header &header, const armor::Data &data) override {
    if (header.id == "image-in") return take_image(data.decode<ImageView>());
    const auto small = data.decode<Small>();
    if (role_ == Role::Answer) return send_data("small-out", small);
    if (role_ == Role::Ask) {
      take_time();
      if (small.number + 1 < ROUND_TRIPS) return send_small(small.number + 1);
      log_times("round trip 100 B");
      return send_image(0);
    }
    count_flood();
  }

  armor::Outcome exec(armor::Call call) override {
    const bool is_first = role_ == Role::Ask || role_ == Role::Flood;
    if (call != armor::Call::Tick || !is_first || count_ == 2) return armor::carry_on();
    ++count_;
    if (count_ == 1) {
      if (role_ == Role::Ask) make_ready();
      return armor::carry_on();
    }
    // At the second tick the links are up.
    const std::uint64_t messages = role_ == Role::Ask ? 1 : static_cast<std::uint64_t>(flood_.get());
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

  // Touches all memory of the measurement.
  void make_ready() {
    times_us_.assign(ROUND_TRIPS, 1.0);
    times_us_.clear();
    for (std::size_t at = IMAGE_LENS.size(); at-- > 0;) images_[at].assign(IMAGE_LENS[at], 7);
  }

  void send_small(std::uint64_t number) {
    if (role_ == Role::Ask) sent_ = Clock::now();
    send_data("small-out", Small{number, {}});
  }

  void send_image(std::uint32_t number) {
    ImageView image;
    image.width = number;
    image.height = 1;
    image.data = armor::span<const std::uint8_t>(images_[size_at_]);
    sent_ = Clock::now();
    send_data("image-out", image);
  }

  void take_image(const ImageView &view) {
    if (role_ == Role::Answer) {
      ImageView image;
      image.width = view.width;
      image.height = static_cast<std::uint32_t>(view.data[0]) + view.data[view.data.size() - 1];
      return send_data("image-out", image);
    }
    take_time();
    if (view.width + 1 < IMAGE_TRIPS) return send_image(view.width + 1);
    log_times("image of " + std::to_string(IMAGE_LENS[size_at_] >> 10) + " KiB and answer");
    if (++size_at_ < IMAGE_LENS.size()) return send_image(0);
    armor::log_info("measured: end");
  }

  void count_flood() {
    const auto messages = static_cast<std::uint64_t>(flood_.get());
    if (count_++ == 0) sent_ = Clock::now(), next_log_ = messages / 10;
    if (count_ == next_log_) {
      armor::log_info("measured: " + std::to_string(count_) + " messages, " + resident() + " resident");
      next_log_ += messages / 10;
    }
    if (count_ == messages) {
      const double rate = static_cast<double>(messages) / seconds() / 1e6;
      armor::log_info("measured: flood 100 B: " + std::to_string(rate) + " M msg/s");
    }
  }

  void take_time() { times_us_.push_back(seconds() * 1e6); }

  void log_times(const std::string &what) {
    const auto begin = times_us_.begin() + WARM_UP;
    std::sort(begin, times_us_.end());
    const std::size_t len = times_us_.size() - WARM_UP;
    const double p50 = begin[len / 2], p99 = begin[len * 99 / 100];
    armor::log_info("measured: " + what + ": " + std::to_string(p50) + " us p50, " + std::to_string(p99) +
                    " us p99");
    times_us_.clear();
  }

  armor::Parameter<std::string> role_text_{
      this, armor::choice("role", "ask answer flood count").default_value("answer").doc("what is measured")};
  armor::Parameter<std::int64_t> flood_{
      this, armor::integer("flood").default_value("2000000").range(10, 1e12).doc("messages of a flood")};
  // Messages that were counted, or ticks, and the count at which the memory is logged next.
  std::uint64_t count_ = 0, next_log_ = 0;
  Role role_ = Role::Answer;
  Clock::time_point sent_;
  std::vector<double> times_us_;
  std::array<std::vector<std::uint8_t>, IMAGE_LENS.size()> images_;
  // The size that is measured.
  std::size_t size_at_ = 0;
};

int main(int argc, char **argv) { return armor::run<Peer>(argc, argv); }
