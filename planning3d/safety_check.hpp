#pragma once

#include "core/trajectory.hpp"
#include "planning3d/free_space.hpp"

#include <limits>
#include <string>
#include <vector>

namespace stairwell::planning3d {

enum class Verdict { kSafe, kOccupied, kUnknown, kOutsideBox, kLimits, kFellow };
const char* to_string(Verdict verdict);

/// The verdict, and where and when it goes wrong.
struct SafetyReport {
  Verdict verdict = Verdict::kSafe;
  double at_time_s = std::numeric_limits<double>::quiet_NaN();  ///< first bad moment (paths: metres along the path)
  Eigen::Vector3d at_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  bool safe() const { return verdict == Verdict::kSafe; }
};

/// The one check that every path and trajectory passes, whoever made it (SPEC A18): the robot's shape against
/// occupied and unknown voxels (distance field first, then occupancy words, voxel by voxel only to name what is hit),
/// the flight box, the limits, and fellow UAVs' commanded motions. Unknown space is never entered.
class SafetyCheck {
 public:
  /// What the check insists on.
  struct Config {
    double step_m = 0.04;             ///< spacing of the checked states; between them the swept sphere is checked
    double spare_m = 0.0;             ///< added to the robot's radius
    double fellow_clearance_m = 0.5;  ///< least distance between the centres of two UAVs
    /// A UAV that already touches something (the map changed around it) may leave: for this far from its start the
    /// sphere is only as large as fits there, until it first fits whole. 0 = never.
    double escape_m = 0.6;
  };
  SafetyCheck() = default;
  explicit SafetyCheck(const Config& config) : config_(config) {}

  /// The robot at one place (its radius, without margin).
  Verdict check_position(const FreeSpace& space, const Eigen::Vector3d& position_m) const {
    return check_position(space, position_m, space.robot().radius_m);
  }
  Verdict check_position(const FreeSpace& space, const Eigen::Vector3d& position_m, double radius_m) const;
  /// Every point, and points between where two are farther apart than `step_m`.
  SafetyReport check_path(const FreeSpace& space, const std::vector<Eigen::Vector3d>& path_m) const;
  /// From `from_s` to the end, where the UAV stays. Space only.
  SafetyReport check_space(const FreeSpace& space, const Trajectory& trajectory, double from_s) const;
  /// By finite differences of the stored states; of jerk only what lies behind `from_s`.
  SafetyReport check_limits(const Trajectory& trajectory, const MotionLimits& limits, double from_s) const;
  /// Against the fellows' whole commanded motions, including both standing still at their ends for ever. Where they are
  /// nearer than the clearance at `from_s`, the motion is safe when it comes no nearer and clear in the end.
  SafetyReport check_fellows(const Trajectory& trajectory, const std::vector<const Trajectory*>& fellows,
                             double from_s) const;

  const Config& config() const { return config_; }

 private:
  Config config_{};
};

}  // namespace stairwell::planning3d
