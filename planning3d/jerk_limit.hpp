#pragma once

#include "core/trajectory.hpp"
#include "planning3d/curve.hpp"
#include "planning3d/speed_profile.hpp"

#include <optional>
#include <vector>

namespace stairwell::planning3d {

/// States every Trajectory::kStep_s along the curve to rest at its end, within the limits of speed, acceleration and
/// jerk (of the positions' third differences; yaw has none): the arc length over time is the running mean of the
/// quickest one without a limit of jerk, so that its acceleration changes no faster than the mean's window allows
/// (Biagiotti & Melchiorri 2012, FIR filters). Where the bends ask for more jerk the curve is flown more slowly.
/// nullopt where that cannot be done from the start's speed and tangential acceleration.
std::optional<std::vector<MotionState>> jerk_limited_states(const Curve& curve, const MotionLimits& limits,
                                                            double start_mps, double start_mps2,
                                                            const LimitShares& shares = {});

}  // namespace stairwell::planning3d
