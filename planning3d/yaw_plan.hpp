#pragma once

#include "core/trajectory.hpp"
#include "planning3d/yaw_turn.hpp"

#include <cstddef>
#include <vector>

namespace stairwell::planning3d {

/// Fills in the yaw of a motion (states every Trajectory::kStep_s), from a given yaw and yaw rate to rest at the goal
/// yaw, within the limits of yaw rate and yaw acceleration. Where the turn takes longer than the motion, the UAV waits
/// at the motion's end.
class YawPlan {
 public:
  YawPlan(const MotionLimits& limits, double yaw_rad, double rate_radps);

  /// Turns straight to the goal yaw.
  void turn(std::vector<MotionState>& states, double goal_yaw_rad) const;
  /// Faces the direction of flight (SPEC B5), and turns to the goal yaw so that both finish together where possible.
  void look_along(std::vector<MotionState>& states, double goal_yaw_rad) const;

 private:
  YawTurn turn_from(const YawTurn::State& from, double goal_yaw_rad) const;
  void finish_from(std::vector<MotionState>& states, std::size_t first, const YawTurn::State& from,
                   double goal_yaw_rad) const;

  double rate_radps_;
  double acceleration_radps2_;
  YawTurn::State start_;
};

}  // namespace stairwell::planning3d
