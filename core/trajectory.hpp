#pragma once

#include <Eigen/Core>

#include <string>
#include <vector>

namespace stairwell {

/// What a UAV may do. Euclidean: the norms of velocity and acceleration are limited; per axis: each component.
struct MotionLimits {
  enum class Norm { kEuclidean, kPerAxis };
  double speed_mps = 2.0;
  double acceleration_mps2 = 2.0;
  double yaw_rate_radps = 1.5707963267948966;
  double yaw_acceleration_radps2 = 1.5707963267948966;
  double jerk_mps3 = 0.0;  ///< change of the acceleration, in planned motions (not in emergency braking); 0 = no limit
  Norm norm = Norm::kEuclidean;

  bool limits_jerk() const { return jerk_mps3 > 0.0; }
  /// How much faster than the limits a motion along `direction` (any length but zero) may be: 1 for Euclidean limits,
  /// up to sqrt(3) on a space diagonal per axis. The same for speed and acceleration.
  double stretch(const Eigen::Vector3d& direction) const;
  /// What is limited of a velocity, an acceleration or a jerk: its norm, or its largest component per axis.
  double size_of(const Eigen::Vector3d& v) const {
    return norm == Norm::kEuclidean ? v.norm() : v.cwiseAbs().maxCoeff();
  }
  std::vector<std::string> problems() const;
};

/// State of motion in the world frame.
struct MotionState {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double yaw_rate_radps = 0.0;
};

/// A commanded motion over simulated time: states at a fixed step with cubic Hermite interpolation in between,
/// continuous in position and velocity. Before `start_time_s` the first state holds; after `end_time_s` the last
/// position and yaw hold at rest.
class Trajectory {
 public:
  static constexpr double kStep_s = 0.02;

  Trajectory() = default;
  /// @param states one every kStep_s from start_time_s; at least one. @throws std::invalid_argument if empty.
  Trajectory(double start_time_s, std::vector<MotionState> states);

  /// Stand still.
  static Trajectory hover(double start_time_s, const Eigen::Vector3d& position_m, double yaw_rad);

  bool empty() const { return states_.empty(); }
  double start_time_s() const { return start_time_s_; }
  double end_time_s() const;
  const std::vector<MotionState>& states() const { return states_; }

  MotionState sample(double time_s) const;
  /// Path length between two times by the stored states.
  double length_m(double from_s, double to_s) const;

 private:
  double start_time_s_ = 0.0;
  std::vector<MotionState> states_;
};

}  // namespace stairwell
