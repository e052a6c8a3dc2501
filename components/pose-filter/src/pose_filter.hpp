// An extended Kalman filter on the plane: wheels, gyroscope and satellite positions. No ports, no clock.
//
// After S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics (2005), section 3.3, with the bias of the
// gyroscope as a part of the state.

#ifndef POSE_FILTER_HPP
#define POSE_FILTER_HPP

#include <Eigen/Dense>
#include <cmath>

// The noise of what is measured: standard deviations.
struct FilterNoise {
  // Of the speed, as a share of it.
  double speed_share = 0.05;
  // Of the turn rate, rad/s in a reading.
  double turn_radps = 0.01;
  // How far the bias of the gyroscope walks in a second, rad/s.
  double bias_walk_radps = 0.0005;
  // Of a satellite position along each axis, m.
  double position_m = 1.0;
};

class PoseFilter {
 public:
  // East and north in metres, heading in rad anticlockwise from east, bias of the gyroscope in rad/s.
  using State = Eigen::Vector4d;
  using Covariance = Eigen::Matrix4d;

  PoseFilter(double x_m, double y_m, double heading_rad, double sigma_m, double sigma_rad,
             const FilterNoise &noise)
      : noise_(noise), state_(x_m, y_m, heading_rad, 0.0), covariance_(Covariance::Zero()) {
    covariance_.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad, 1e-4;
  }

  // Moves for a time at a speed ahead and a turn rate as the gyroscope measures it.
  void predict(double speed_mps, double turn_radps, double time_s) {
    const double turn = turn_radps - state_(3);
    const double middle = state_(2) + turn * time_s / 2;
    const double way = speed_mps * time_s;
    Covariance jacobian = Covariance::Identity();
    jacobian(0, 2) = -way * std::sin(middle);
    jacobian(1, 2) = way * std::cos(middle);
    jacobian(2, 3) = -time_s;
    state_(0) += way * std::cos(middle);
    state_(1) += way * std::sin(middle);
    state_(2) = wrap(state_(2) + turn * time_s);

    // The noise along the way and of the heading, each in a reading; that of the bias grows with time.
    const double along = noise_.speed_share * way;
    const Eigen::Vector2d direction(std::cos(middle), std::sin(middle));
    covariance_ = jacobian * covariance_ * jacobian.transpose();
    covariance_.topLeftCorner<2, 2>() += along * along * direction * direction.transpose();
    covariance_(2, 2) += std::pow(noise_.turn_radps * time_s, 2);
    covariance_(3, 3) += std::pow(noise_.bias_walk_radps, 2) * time_s;
  }

  // Takes a position into account. One that is farther from the estimate than its covariance makes
  // believable (0.1 %) is not: returns false.
  bool correct(double x_m, double y_m) {
    const Eigen::Vector2d innovation(x_m - state_(0), y_m - state_(1));
    const Eigen::Matrix2d spread = covariance_.topLeftCorner<2, 2>() +
                                   Eigen::Matrix2d::Identity() * noise_.position_m * noise_.position_m;
    const Eigen::Matrix2d inverse = spread.inverse();
    if (innovation.dot(inverse * innovation) > BELIEVED) return false;
    const Eigen::Matrix<double, 4, 2> gain = covariance_.leftCols<2>() * inverse;
    state_ += gain * innovation;
    state_(2) = wrap(state_(2));
    const Covariance corrected = covariance_ - gain * covariance_.topRows<2>();
    covariance_ = (corrected + corrected.transpose()) / 2;
    return true;
  }

  const State &state() const { return state_; }
  const Covariance &covariance() const { return covariance_; }

 private:
  // The 99.9 % quantile of chi squared with two degrees of freedom.
  static constexpr double BELIEVED = 13.8;

  static double wrap(double angle_rad) { return std::remainder(angle_rad, 2 * M_PI); }

  FilterNoise noise_;
  State state_;
  Covariance covariance_;
};

#endif
