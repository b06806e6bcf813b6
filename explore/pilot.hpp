#pragma once

#include "explore/fleet_config.hpp"
#include "explore/uav.hpp"
#include "planning3d/fallback_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/trajectory_builder.hpp"

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::explore {

enum class FlightOutcome { kFlying, kUnreachable, kFellowInTheWay };

/// A trajectory that passed the safety check, or why there is none.
struct FlightResult {
  FlightOutcome outcome = FlightOutcome::kUnreachable;
  std::optional<Trajectory> trajectory;        ///< set when kFlying; not yet commanded
  std::vector<Eigen::Vector3d> path_m;         ///< that the trajectory smooths
  bool part_way = false;                       ///< the trajectory ends before the path does
  std::string_view planner;                    ///< which planner found the way
  bool fell_back = false;                      ///< it was not the one asked for
  std::string not_used;                        ///< why the planners before it, or all of them, found none
  std::vector<Eigen::Vector3d> wanted_path_m;  ///< kFellowInTheWay: where it wanted to go
};

/// A motion to a goal as if there were no fellows, or none.
struct FlightDraft {
  int thread = 0;  ///< by whose planner: it knows the surroundings already
  planning3d::PlanRequest request;
  planning3d::FallbackResult found;
  std::vector<Eigen::Vector3d> path_m;  ///< the last that a motion was tried along
  std::optional<Trajectory> motion;
  double horizon_m = 0.0;  ///< motions lead so far along their paths
  bool part_way = false;   ///< the motion ends before the path does
};

/// Turns goals into safe motions: planner, fallback planner, trajectory, safety check against map and fellows. Without
/// an answer the UAV brakes and hovers.
class Pilot {
 public:
  static constexpr double kAllTheWay_m = std::numeric_limits<double>::infinity();

  /// @throws InputError for unknown planners
  explicit Pilot(const FleetConfig& config);

  /// All the way. Does not command anything. @param fellows every other UAV
  FlightResult fly_to(const planning3d::FreeSpace& space, const Uav& uav, const Eigen::Vector3d& position_m,
                      double yaw_rad, const planning3d::MotionRule& rule, const std::vector<const Uav*>& fellows,
                      double depart_s) {
    return fly(space, uav, yaw_rad, draft(space, uav, position_m, yaw_rad, rule, depart_s, kAllTheWay_m), fellows,
               depart_s);
  }
  /// The first half of `fly_to`, which fellows do not matter to. With threads, calls with different numbers from 0 to
  /// `drafting_threads()` - 1 may run at the same time.
  /// @param horizon_m  motions come to rest so far along longer paths, looking along them
  FlightDraft draft(const planning3d::FreeSpace& space, const Uav& uav, const Eigen::Vector3d& position_m,
                    double yaw_rad, const planning3d::MotionRule& rule, double depart_s, double horizon_m,
                    int thread = 0);
  /// The second half. @pre nothing was commanded to the UAV since
  FlightResult fly(const planning3d::FreeSpace& space, const Uav& uav, double yaw_rad, FlightDraft draft,
                   const std::vector<const Uav*>& fellows, double depart_s);
  /// More than 1 with planners whose answers depend on the request alone.
  int drafting_threads() const { return static_cast<int>(planners_.size()); }

  /// Straight up or down without a planner (take-off, landing).
  std::optional<Trajectory> vertical(const planning3d::FreeSpace& space, const Uav& uav, double to_z_m, double depart_s,
                                     bool checked) const;
  Trajectory rotate(const Uav& uav, double turn_rad, double depart_s) const;
  Trajectory brake(const Uav& uav, double depart_s) const;
  /// Brakes and, where that alone is too late, gives way to the side that has most room: for what comes into sight
  /// late. @param level  left or right only, not up or down
  Trajectory brake_clear(const planning3d::FreeSpace& space, const Uav& uav, const std::vector<const Uav*>& fellows,
                         bool level, double depart_s) const;
  bool is_safe(const planning3d::FreeSpace& space, const Trajectory& motion, double from_s) const;
  planning3d::SafetyReport still_safe(const planning3d::FreeSpace& space, const Uav& uav, double time_s) const;
  /// Whether and when the motion comes too near to those that the fellows are commanded to.
  planning3d::SafetyReport meets(const Trajectory& motion, const std::vector<const Uav*>& fellows, double from_s) const;

 private:
  std::vector<planning3d::KeepOut> keep_outs(const std::vector<const Uav*>& fellows, const Eigen::Vector3d& start_m,
                                             double depart_s) const;
  std::optional<Trajectory> shape(const planning3d::FreeSpace& space, const Uav& uav,
                                  const std::vector<Eigen::Vector3d>& path_m, double yaw_rad, double depart_s) const;
  /// Whether a motion can follow the path; the draft gets both.
  planning3d::PlanVerdict shape_along(const planning3d::FreeSpace& space, const Uav& uav,
                                      const std::vector<Eigen::Vector3d>& path_m, double yaw_rad, double depart_s,
                                      FlightDraft& draft) const;

  FleetConfig config_;
  planning3d::SafetyCheck check_;
  planning3d::TrajectoryBuilder builder_;
  std::vector<planning3d::FallbackPlanner> planners_;  ///< alike, for each thread
};

}  // namespace stairwell::explore
