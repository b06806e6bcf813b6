#include "planning3d/yaw_plan.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr double kYawShare = 0.98;
constexpr double kHeadingSpeed_mps = 0.1;  // horizontal; slower flight gives no heading to look along

void set(MotionState& state, const YawTurn::State& yaw) {
  state.yaw_rad = wrap_angle(yaw.turned_rad);
  state.yaw_rate_radps = yaw.rate_radps;
}

}  // namespace

YawPlan::YawPlan(const MotionLimits& limits, double yaw_rad, double rate_radps)
    : rate_radps_(std::max(kYawShare * limits.yaw_rate_radps, std::abs(rate_radps))),
      acceleration_radps2_(kYawShare * limits.yaw_acceleration_radps2),
      start_{yaw_rad, rate_radps} {}

void YawPlan::turn(std::vector<MotionState>& states, double goal_yaw_rad) const {
  finish_from(states, 0, start_, goal_yaw_rad);
}

void YawPlan::look_along(std::vector<MotionState>& states, double goal_yaw_rad) const {
  std::vector<YawTurn::State> tracked{start_};
  double heading_rad = start_.turned_rad;
  for (std::size_t i = 0; i + 1 < states.size(); ++i) {
    const Eigen::Vector3d& v = states[i].velocity_mps;
    if (std::hypot(v.x(), v.y()) > kHeadingSpeed_mps) heading_rad = std::atan2(v.y(), v.x());
    const YawTurn::State now = tracked.back();
    const YawTurn::State next = turn_from(now, heading_rad).at(Trajectory::kStep_s);
    tracked.push_back({now.turned_rad + next.turned_rad, next.rate_radps});
  }
  std::size_t last = states.size() - 1;
  for (; last > 0; --last) {
    const double left_s = Trajectory::kStep_s * static_cast<double>(states.size() - 1 - last);
    if (turn_from(tracked[last], goal_yaw_rad).duration_s() <= left_s) break;
  }
  for (std::size_t i = 0; i < last; ++i) set(states[i], tracked[i]);
  finish_from(states, last, tracked[last], goal_yaw_rad);
}

YawTurn YawPlan::turn_from(const YawTurn::State& from, double goal_yaw_rad) const {
  return YawTurn::to_heading(from.rate_radps, goal_yaw_rad - from.turned_rad, rate_radps_, acceleration_radps2_);
}

void YawPlan::finish_from(std::vector<MotionState>& states, std::size_t first, const YawTurn::State& from,
                          double goal_yaw_rad) const {
  const YawTurn turn = turn_from(from, goal_yaw_rad);
  const auto steps = static_cast<std::size_t>(std::ceil(turn.duration_s() / Trajectory::kStep_s - 1e-9));
  while (states.size() < first + steps + 1) {
    MotionState wait;
    wait.position_m = states.back().position_m;
    states.push_back(wait);
  }
  for (std::size_t i = first; i < states.size(); ++i) {
    const YawTurn::State yaw = turn.at(Trajectory::kStep_s * static_cast<double>(i - first));
    set(states[i], {from.turned_rad + yaw.turned_rad, yaw.rate_radps});
  }
  states.back().yaw_rad = wrap_angle(goal_yaw_rad);
  states.back().yaw_rate_radps = 0.0;
}

}  // namespace stairwell::planning3d
