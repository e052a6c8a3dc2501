// The filter as a component: odometry, gyroscope and satellite positions in, poses out.

#ifndef PORTS_HPP
#define PORTS_HPP

#include <armor.hpp>
#include <armor_messages.hpp>
#include <optional>

#include "pose_filter.hpp"

class PoseFilterComponent : public armor::Component {
 public:
  PoseFilterComponent()
      : Component("pose-filter", "Estimates the pose on the earth from wheels, gyroscope and satellites.") {
    subscribe<armor::messages::Odometry>("odometry", "speed, and turn rate without a gyroscope");
    subscribe<armor::messages::Imu>("imu", "turn rate by a gyroscope", ARMOR_OPTIONAL);
    subscribe<armor::messages::NavSatFix>("gps", "positions on the earth", ARMOR_OPTIONAL);
    provide<armor::messages::PoseWithCovarianceStamped>(
        "pose", "east and north of the datum, with each odometry");
    provide<armor::messages::Count>("refused", "number of positions that were not believable", ARMOR_LATCHED);
    set_never_done();
  }

  void data_received(const armor::Header &header, const armor::Data &data) override {
    if (header.id == "imu") {
      turn_radps_ = data.decode<armor::messages::Imu>().angular_velocity.z;
    } else if (header.id == "gps") {
      take_fix(data.decode<armor::messages::NavSatFix>());
    } else {
      take_odometry(data.decode<armor::messages::Odometry>());
    }
  }

  armor::Outcome exec(armor::Call call) override {
    if (call == armor::Call::Started) {
      FilterNoise noise;
      noise.position_m = gps_sigma_;
      filter_.emplace(start_x_, start_y_, heading_, position_sigma_, heading_sigma_, noise);
      last_s_.reset();
      turn_radps_.reset();
      refused_ = 0;
      send_data("refused", armor::messages::Count{refused_});
    }
    return armor::carry_on();
  }

 private:
  // Longest time between two messages that is believed; after a longer one the robot has been stopped.
  static constexpr double LONGEST_S = 1.0;
  static constexpr double EARTH_RADIUS_M = 6'378'137.0;

  void take_odometry(const armor::messages::Odometry &odometry) {
    const double time_s = last_s_ ? odometry.stamp - *last_s_ : 0.0;
    last_s_ = odometry.stamp;
    if (time_s > 0.0 && time_s < LONGEST_S) {
      const armor::messages::Twist &twist = odometry.twist.twist;
      filter_->predict(twist.linear.x, turn_radps_.value_or(twist.angular.z), time_s);
    }
    publish(odometry.stamp);
  }

  // A fix that has failed has no numbers.
  void take_fix(const armor::messages::NavSatFix &fix) {
    if (!std::isfinite(fix.latitude) || !std::isfinite(fix.longitude)) return;
    const double degree_m = M_PI / 180 * EARTH_RADIUS_M;
    const double east = (fix.longitude - datum_longitude_ * 180 / M_PI) * degree_m * std::cos(datum_latitude_);
    const double north = (fix.latitude - datum_latitude_ * 180 / M_PI) * degree_m;
    if (!filter_->correct(east, north)) send_data("refused", armor::messages::Count{++refused_});
  }

  void publish(double stamp_s) {
    armor::messages::PoseWithCovarianceStamped message;
    message.stamp = stamp_s;
    message.frame = "earth";
    const PoseFilter::State &state = filter_->state();
    message.pose.pose.position = {state(0), state(1), 0.0};
    message.pose.pose.orientation.z = std::sin(state(2) / 2);
    message.pose.pose.orientation.w = std::cos(state(2) / 2);
    // Of x, y and yaw among x, y, z, roll, pitch, yaw.
    constexpr std::array<int, 3> PLACES{0, 1, 5};
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        const auto place = static_cast<std::size_t>(6 * PLACES[row] + PLACES[column]);
        message.pose.covariance[place] = filter_->covariance()(row, column);
      }
    }
    send_data("pose", message);
  }

  armor::Parameter<double> datum_latitude_{
      this, armor::number("datum_latitude", "rad").default_value("50deg").range(-1.5, 1.5).doc("where x and y are 0")};
  armor::Parameter<double> datum_longitude_{
      this, armor::number("datum_longitude", "rad").default_value("8deg").range(-3.15, 3.15).doc("where x and y are 0")};
  armor::Parameter<double> start_x_{
      this, armor::number("start_x", "m").default_value("0m").doc("where it begins, east of the datum")};
  armor::Parameter<double> start_y_{
      this, armor::number("start_y", "m").default_value("0m").doc("where it begins, north of the datum")};
  armor::Parameter<double> heading_{
      this, armor::number("heading", "rad").default_value("0deg").doc("heading then, anticlockwise from east")};
  armor::Parameter<double> position_sigma_{
      this, armor::number("position_sigma", "m").default_value("2m").range(0, 1e6).doc("how sure that place is")};
  armor::Parameter<double> heading_sigma_{
      this, armor::number("heading_sigma", "rad").default_value("10deg").range(0, 3.15).doc("how sure that heading is")};
  armor::Parameter<double> gps_sigma_{
      this, armor::number("gps_sigma", "m").default_value("1.5m").range(0.001, 1e3).doc("standard deviation of a position")};

  std::optional<PoseFilter> filter_;
  std::optional<double> last_s_, turn_radps_;
  std::uint64_t refused_ = 0;
};

#endif
