// The filter on a drive around a square, and the component without a system.

#include <armor_testing.hpp>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "../src/ports.hpp"

#define CHECK(condition)                                                      \
  do {                                                                        \
    if (!(condition)) {                                                       \
      std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);    \
      std::exit(1);                                                           \
    }                                                                         \
  } while (0)

// Drives ten times around a circle of 5 m radius with wheels that measure 3 % too much and a gyroscope
// with a bias; returns the root mean square error of the second half, in metres.
static double drive(unsigned seed, bool has_positions) {
  constexpr double PERIOD_S = 0.05, SPEED_MPS = 1.0, TURN_RADPS = 0.2, BIAS_RADPS = 0.01;
  constexpr int STEPS = 6283;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  FilterNoise sigmas;
  sigmas.position_m = 0.5;
  PoseFilter filter(0, 0, 0.1, 1.0, 0.2, sigmas);
  double x = 0, y = 0, heading = 0, sum = 0;
  for (int step = 0; step < STEPS; ++step) {
    x += SPEED_MPS * PERIOD_S * std::cos(heading + TURN_RADPS * PERIOD_S / 2);
    y += SPEED_MPS * PERIOD_S * std::sin(heading + TURN_RADPS * PERIOD_S / 2);
    heading += TURN_RADPS * PERIOD_S;
    filter.predict(1.03 * SPEED_MPS, TURN_RADPS + BIAS_RADPS + 0.005 * noise(random), PERIOD_S);
    if (has_positions && step % 20 == 0) filter.correct(x + 0.5 * noise(random), y + 0.5 * noise(random));
    if (step >= STEPS / 2) sum += std::pow(filter.state()(0) - x, 2) + std::pow(filter.state()(1) - y, 2);
  }
  if (has_positions) {
    // It has found the bias, and is as sure as it is right.
    CHECK(std::abs(filter.state()(3) - BIAS_RADPS) < 0.005);
    CHECK(std::sqrt(filter.covariance()(0, 0)) < 0.5);
    const Eigen::LLT<Eigen::Matrix4d> root(filter.covariance());
    CHECK(root.info() == Eigen::Success);
  }
  return std::sqrt(sum / (STEPS - STEPS / 2));
}

static void test_filter() {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const double with = drive(seed, true), without = drive(seed, false);
    std::printf("seed %u: %.2f m with positions, %.2f m without\n", seed, with, without);
    CHECK(with < 0.35 && with < without / 4);
  }
  // A position that cannot be is refused, and changes nothing.
  PoseFilter filter(0, 0, 0, 1.0, 0.1, FilterNoise());
  CHECK(filter.correct(1.0, 0.0));
  const PoseFilter::State before = filter.state();
  CHECK(!filter.correct(100.0, 0.0) && filter.state() == before);
  // Headings stay within half a turn of 0.
  for (int step = 0; step < 100; ++step) filter.predict(0, 1.0, 0.1);
  CHECK(std::abs(filter.state()(2)) <= M_PI);
}

static void test_component() {
  using namespace armor::messages;
  armor::TestedComponent<PoseFilterComponent> filter({{"heading", "90deg"}, {"gps_sigma", "1m"}});
  filter.start();
  Odometry odometry;
  Imu imu;
  for (int step = 0; step <= 20; ++step) {
    odometry.stamp = 1000.0 + 0.1 * step;
    odometry.twist.twist.linear.x = 1.0;
    filter.send("imu", imu);
    filter.send("odometry", odometry);
  }
  auto poses = filter.outputs<PoseWithCovarianceStamped>("pose");
  CHECK(poses.size() == 21 && poses.back().frame == "earth" && poses.back().stamp == 1002.0);
  // 2 s to the north at 1 m/s.
  CHECK(std::abs(poses.back().pose.pose.position.x) < 1e-9);
  CHECK(std::abs(poses.back().pose.pose.position.y - 2.0) < 1e-9);
  CHECK(std::abs(poses.back().pose.pose.orientation.z - std::sqrt(0.5)) < 1e-9);
  const double before = poses.back().pose.covariance[0];

  NavSatFix fix;
  fix.latitude = NAN, fix.longitude = NAN;
  filter.send("gps", fix);
  fix.latitude = 50.0, fix.longitude = 8.0;
  filter.send("gps", fix);
  fix.latitude = 51.0;
  filter.send("gps", fix);
  filter.send("odometry", odometry);
  poses = filter.outputs<PoseWithCovarianceStamped>("pose");
  CHECK(poses.back().pose.pose.position.y < 1.9 && poses.back().pose.covariance[0] < before);
  CHECK(filter.outputs<Count>("refused").back().count == 1);
}

int main() {
  test_filter();
  test_component();
  std::puts("pose filter: passed");
  return 0;
}
