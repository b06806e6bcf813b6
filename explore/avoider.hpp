#pragma once

#include "explore/fleet_config.hpp"
#include "explore/uav.hpp"
#include "planning3d/free_space.hpp"
#include "planning3d/orca.hpp"
#include "planning3d/safety_check.hpp"

#include <optional>
#include <vector>

namespace stairwell::explore {

/// What a UAV would fly if there were no fellows.
struct Wish {
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  bool held = false;     ///< a fellow has the right of way
  bool arrived = false;  ///< at the end of its path
};

/// Local avoidance of fellows for `--avoidance orca`: from the fellows' positions and velocities alone.
class Avoider {
 public:
  /// @param tick_s a velocity is chosen this often
  Avoider(const FleetConfig& config, double tick_s);

  /// The UAV as others see it.
  static planning3d::SeenUav seen(const Uav& uav);
  /// Its commanded motion soon comes too near to a fellow that keeps its velocity, or a fellow is within the distance
  /// that both may need to stop.
  bool must_avoid(const Uav& uav, const std::vector<planning3d::SeenUav>& fellows, double now_s) const;
  /// Nobody would come near on the straight way that it wishes to fly.
  bool is_clear(const Uav& uav, const Eigen::Vector3d& wish_mps, const std::vector<planning3d::SeenUav>& fellows) const;
  /// What the UAV on its path wishes for, fellows' right of way respected; zero without a path. nullopt: it needs a new
  /// path.
  std::optional<Wish> wish(const planning3d::FreeSpace& space, Uav& uav,
                           const std::vector<planning3d::SeenUav>& fellows) const;
  /// A tick towards the chosen velocity, then braking to rest on a straight line; checked against the map. nullopt when
  /// that is not safe: brake on the present course, which always is.
  std::optional<Trajectory> segment(const planning3d::FreeSpace& space, const Uav& uav, const Eigen::Vector3d& wish_mps,
                                    const std::vector<planning3d::SeenUav>& fellows, double now_s) const;
  /// Path of a new trajectory, should the UAV have to leave it.
  void remember_path(Uav& uav, std::vector<Eigen::Vector3d> path_m) const;

 private:
  Trajectory motion(const MotionState& from, const Eigen::Vector3d& velocity_mps, double now_s) const;

  MotionLimits limits_;
  double clearance_m_;
  double radius_m_;
  planning3d::OrcaConfig orca_;
  planning3d::SafetyCheck check_;
};

}  // namespace stairwell::explore
