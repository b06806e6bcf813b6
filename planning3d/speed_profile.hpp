#pragma once

#include "core/trajectory.hpp"
#include "planning3d/curve.hpp"

#include <optional>
#include <vector>

namespace stairwell::planning3d {

/// Share of the limits that is planned with; the rest absorbs what sampling adds.
struct LimitShares {
  double speed = 0.99;
  double acceleration = 0.97;
  double bend = 0.9;  ///< of the acceleration, at most spent on turning
};

/// Quickest squared speeds along a curve from `start_mps` to rest (forward and backward passes over arc length);
/// nullopt when the curve bends too soon to brake for it or has a cusp.
/// @param share of the largest squared speed that each node allows; null: all of it
std::optional<std::vector<double>> squared_speeds(const Curve& curve, const MotionLimits& limits, double start_mps,
                                                  const LimitShares& shares = {},
                                                  const std::vector<double>* share = nullptr);

/// Shortens the curve to where braking as hard as the limits allow comes to rest; never faster than flown before.
FlownCurve hardest_stop(const FlownCurve& flown, const MotionLimits& limits, const LimitShares& shares);

/// States every Trajectory::kStep_s: constant tangential acceleration between nodes. Yaw is left at zero.
std::vector<MotionState> timed_states(const Curve& curve, const std::vector<double>& squared_speed,
                                      const MotionLimits& limits);

double travel_time_s(const Curve& curve, const std::vector<double>& squared_speed);

}  // namespace stairwell::planning3d
