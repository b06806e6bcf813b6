#include "planning3d/yaw_turn.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

YawTurn::YawTurn(double rate_radps, double turn_rad, double max_rate_radps, double max_acceleration_radps2)
    : turn_rad_(turn_rad) {
  const double a = max_acceleration_radps2;
  const double stop_rad = rate_radps * std::abs(rate_radps) / (2.0 * a);
  sign_ = turn_rad >= stop_rad ? 1.0 : -1.0;
  const double turn = sign_ * turn_rad;
  start_radps_ = sign_ * rate_radps;
  const double triangle = std::sqrt(std::max(0.0, a * turn + 0.5 * start_radps_ * start_radps_));
  peak_radps_ = std::max(0.0, std::min(triangle, max_rate_radps));
  speed_up_s_ = std::abs(peak_radps_ - start_radps_) / a;
  slow_down_s_ = peak_radps_ / a;
  const double ramps_rad = 0.5 * (peak_radps_ + start_radps_) * speed_up_s_ + 0.5 * peak_radps_ * slow_down_s_;
  cruise_s_ = peak_radps_ > 1e-12 ? std::max(0.0, (turn - ramps_rad) / peak_radps_) : 0.0;
}

YawTurn YawTurn::to_heading(double rate_radps, double turn_rad, double max_rate_radps, double max_acceleration_radps2) {
  const double shortest_rad = wrap_angle(turn_rad);
  YawTurn best(rate_radps, shortest_rad, max_rate_radps, max_acceleration_radps2);
  if (std::abs(rate_radps) < 1e-9) return best;
  for (const double other_rad : {shortest_rad - 2.0 * kPi, shortest_rad + 2.0 * kPi}) {
    const YawTurn turn(rate_radps, other_rad, max_rate_radps, max_acceleration_radps2);
    if (turn.duration_s() < best.duration_s() - 1e-9) best = turn;
  }
  return best;
}

YawTurn YawTurn::stop(double rate_radps, double max_rate_radps, double max_acceleration_radps2) {
  const double stop_rad = rate_radps * std::abs(rate_radps) / (2.0 * max_acceleration_radps2);
  return {rate_radps, stop_rad, std::max(max_rate_radps, std::abs(rate_radps)), max_acceleration_radps2};
}

YawTurn::State YawTurn::at(double time_s) const {
  if (time_s >= duration_s()) return {turn_rad_, 0.0};
  if (time_s <= 0.0) return {0.0, sign_ * start_radps_};
  if (time_s < speed_up_s_) {
    const double rate = start_radps_ + (peak_radps_ - start_radps_) * time_s / speed_up_s_;
    return {sign_ * 0.5 * (start_radps_ + rate) * time_s, sign_ * rate};
  }
  const double left_s = duration_s() - time_s;
  if (left_s < slow_down_s_) {
    const double rate = peak_radps_ * left_s / slow_down_s_;
    return {turn_rad_ - sign_ * 0.5 * rate * left_s, sign_ * rate};
  }
  const double before_rad = 0.5 * (start_radps_ + peak_radps_) * speed_up_s_;
  return {sign_ * (before_rad + peak_radps_ * (time_s - speed_up_s_)), sign_ * peak_radps_};
}

}  // namespace stairwell::planning3d
