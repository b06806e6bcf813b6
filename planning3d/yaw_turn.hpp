#pragma once

namespace stairwell::planning3d {

/// Quickest turn from a yaw and yaw rate to rest, within limits of rate and acceleration (trapezoidal rate).
class YawTurn {
 public:
  /// By exactly `turn_rad` (may exceed a full turn).
  YawTurn(double rate_radps, double turn_rad, double max_rate_radps, double max_acceleration_radps2);
  /// To the heading `turn_rad` away or any full turn from it, whichever is reached first.
  static YawTurn to_heading(double rate_radps, double turn_rad, double max_rate_radps, double max_acceleration_radps2);
  /// Just stop turning.
  static YawTurn stop(double rate_radps, double max_rate_radps, double max_acceleration_radps2);

  double duration_s() const { return speed_up_s_ + cruise_s_ + slow_down_s_; }
  /// Heading and turning rate.
  struct State {
    double turned_rad;
    double rate_radps;
  };
  State at(double time_s) const;

 private:
  double turn_rad_ = 0.0;
  double sign_ = 1.0;
  double start_radps_ = 0.0;  ///< in the direction of the turn
  double peak_radps_ = 0.0;
  double speed_up_s_ = 0.0;
  double cruise_s_ = 0.0;
  double slow_down_s_ = 0.0;
};

}  // namespace stairwell::planning3d
