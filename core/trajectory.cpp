#include "core/trajectory.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace stairwell {

std::vector<std::string> MotionLimits::problems() const {
  std::vector<std::string> found;
  const auto check = [&found](double value, const char* name) {
    if (!(value > 0.0) || !std::isfinite(value)) found.push_back(std::string(name) + " limit must be positive");
  };
  check(speed_mps, "speed");
  check(acceleration_mps2, "acceleration");
  check(yaw_rate_radps, "yaw rate");
  check(yaw_acceleration_radps2, "yaw acceleration");
  if (!(jerk_mps3 >= 0.0) || !std::isfinite(jerk_mps3)) {
    found.push_back("jerk limit must be positive, or 0 for none");
  }
  return found;
}

double MotionLimits::stretch(const Eigen::Vector3d& direction) const {
  return norm == Norm::kEuclidean ? 1.0 : direction.norm() / direction.cwiseAbs().maxCoeff();
}

Trajectory::Trajectory(double start_time_s, std::vector<MotionState> states)
    : start_time_s_(start_time_s), states_(std::move(states)) {
  if (states_.empty()) throw std::invalid_argument("a trajectory needs at least one state");
}

Trajectory Trajectory::hover(double start_time_s, const Eigen::Vector3d& position_m, double yaw_rad) {
  MotionState state;
  state.position_m = position_m;
  state.yaw_rad = yaw_rad;
  return {start_time_s, {state}};
}

double Trajectory::end_time_s() const {
  return states_.empty() ? start_time_s_ : start_time_s_ + kStep_s * static_cast<double>(states_.size() - 1);
}

MotionState Trajectory::sample(double time_s) const {
  const double steps = (time_s - start_time_s_) / kStep_s;
  if (!(steps > 0.0)) return states_.front();
  const auto last = states_.size() - 1;
  if (steps >= static_cast<double>(last)) {
    MotionState rest;
    rest.position_m = states_.back().position_m;
    rest.yaw_rad = states_.back().yaw_rad;
    return rest;
  }
  const auto i = static_cast<std::size_t>(steps);
  const double u = steps - static_cast<double>(i);
  const MotionState& a = states_[i];
  const MotionState& b = states_[i + 1];
  const double h = kStep_s;
  const double u2 = u * u;
  const double u3 = u2 * u;
  MotionState s;
  s.position_m = (2 * u3 - 3 * u2 + 1) * a.position_m + (u3 - 2 * u2 + u) * h * a.velocity_mps +
                 (-2 * u3 + 3 * u2) * b.position_m + (u3 - u2) * h * b.velocity_mps;
  s.velocity_mps = (1 - u) * a.velocity_mps + u * b.velocity_mps;
  s.acceleration_mps2 = (1 - u) * a.acceleration_mps2 + u * b.acceleration_mps2;
  s.yaw_rad = wrap_angle(a.yaw_rad + u * wrap_angle(b.yaw_rad - a.yaw_rad));
  s.yaw_rate_radps = (1 - u) * a.yaw_rate_radps + u * b.yaw_rate_radps;
  return s;
}

double Trajectory::length_m(double from_s, double to_s) const {
  if (states_.empty() || !(to_s > from_s)) return 0.0;
  const double begin_s = std::clamp(from_s, start_time_s_, end_time_s());
  const double finish_s = std::clamp(to_s, start_time_s_, end_time_s());
  double length_m = 0.0;
  Eigen::Vector3d previous_m = sample(begin_s).position_m;
  auto next = static_cast<std::size_t>(std::floor((begin_s - start_time_s_) / kStep_s)) + 1;
  for (; next < states_.size(); ++next) {
    if (start_time_s_ + kStep_s * static_cast<double>(next) >= finish_s) break;
    length_m += (states_[next].position_m - previous_m).norm();
    previous_m = states_[next].position_m;
  }
  return length_m + (sample(finish_s).position_m - previous_m).norm();
}

}  // namespace stairwell
