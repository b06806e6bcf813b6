#pragma once

#include "core/trajectory.hpp"
#include "planning3d/free_space.hpp"
#include "planning3d/safety_check.hpp"

#include <optional>
#include <vector>

namespace stairwell::planning3d {

/// What a trajectory is to be built from.
struct TrajectoryRequest {
  const Trajectory* previous = nullptr;  ///< what the UAV is flying now; the new one departs from it
  double depart_s = 0.0;                 ///< switch time: the new trajectory starts in the previous one's state then
  std::vector<Eigen::Vector3d> path_m;   ///< from about the departure position to the goal
  double goal_yaw_rad = 0.0;
  bool look_along_path = false;  ///< depth cameras: face the direction of flight until near the goal (B5)
};

/// Cubic B-spline (C2) through the path's corridor (SPEC A5), drawn to where it bends little (ElasticBand), joined to
/// the motion under way, time-parameterised within the limits by forward and backward passes over arc length, and where
/// the limits have one for jerk, by a running mean of those (jerk_limited_states).
///
/// The join follows the old (already checked) curve for 0, 1/4, .. 1 of the stopping distance and then turns on to the
/// new path; the quickest candidate that is safe wins, and the last one brakes to rest on the old curve, which is
/// always possible. Ends at rest. Where there is room, half a voxel more than the check's radius is kept.
class TrajectoryBuilder {
 public:
  TrajectoryBuilder(const MotionLimits& limits, const SafetyCheck& check) : limits_(limits), check_(check) {}

  /// nullopt when no candidate is safe (space and limits; fellows are checked by the caller).
  std::optional<Trajectory> build(const FreeSpace& space, const TrajectoryRequest& request) const;

  /// Brakes on the curve being flown as hard as the limits allow, for emergencies: without regard to the limit of jerk.
  /// Starts at `depart_s`.
  Trajectory brake(const Trajectory& flying, double depart_s) const;
  /// Brakes a little less hard and gives way to one side meanwhile, by up to a quarter of the way that braking takes;
  /// just brakes where the limits do not allow both.
  /// @param aside  unit vector across the present course
  Trajectory brake_aside(const Trajectory& flying, double depart_s, const Eigen::Vector3d& aside) const;
  /// Turn on the spot from rest by `turn_rad` (may exceed a full turn: the radial scan) at no more than `rate_radps`.
  Trajectory rotate(double depart_s, const Eigen::Vector3d& position_m, double yaw_rad, double turn_rad,
                    double rate_radps) const;
  /// Motion model `step` (SPEC A5): constant `delta_m` every `period_s` along the path, no acceleration limits.
  static Trajectory step_along(double depart_s, double yaw_rad, const std::vector<Eigen::Vector3d>& path_m,
                               double goal_yaw_rad, double delta_m, double period_s);

  /// A motion without yaw, a state every Trajectory::kStep_s.
  struct Ride {
    std::vector<MotionState> states;
  };

 private:
  /// @param stops at every corner: fits wherever the path itself does
  std::optional<Trajectory> build_checked(const FreeSpace& space, const TrajectoryRequest& request,
                                          const SafetyCheck& check, bool stops) const;
  /// With yaw; `check` has the last word on every one.
  std::optional<Trajectory> quickest_safe(const FreeSpace& space, const TrajectoryRequest& request,
                                          const SafetyCheck& check, const Eigen::Vector3d& goal_m,
                                          std::vector<Ride> rides) const;
  Trajectory without_turning_on(const Trajectory& flying, double depart_s, Ride ride) const;

  MotionLimits limits_;
  SafetyCheck check_;
};

}  // namespace stairwell::planning3d
