#pragma once

#include "core/trajectory.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <string_view>

namespace stairwell::explore {

/// What a run reports while it goes on. The default does nothing (the null twin).
class ExplorationLog {
 public:
  virtual ~ExplorationLog() = default;

  /// A UAV changed its state (`takeoff`, `radial_scan`, `find_goal`, `travel`, `land`, `done`).
  virtual void on_state(double time_s, std::size_t uav, std::string_view state) {
    (void)time_s, (void)uav, (void)state;
  }
  /// A goal was given; `planner` says which one found the way.
  virtual void on_goal(double time_s, std::size_t uav, const Eigen::Vector3d& goal_m, double gain_m3,
                       std::string_view planner) {
    (void)time_s, (void)uav, (void)goal_m, (void)gain_m3, (void)planner;
  }
  /// Something went another way than planned: `reason` is a short machine-readable word.
  virtual void on_event(double time_s, std::size_t uav, std::string_view event, std::string_view reason) {
    (void)time_s, (void)uav, (void)event, (void)reason;
  }
  /// A UAV's scan is in the fleet's map; nothing else has changed the map since the scan before.
  virtual void on_scan(double time_s, std::size_t uav, const mapping::OccupancyMap& map) {
    (void)time_s, (void)uav, (void)map;
  }
  /// A UAV was commanded this motion.
  virtual void on_trajectory(double time_s, std::size_t uav, const Trajectory& trajectory) {
    (void)time_s, (void)uav, (void)trajectory;
  }
};

}  // namespace stairwell::explore
