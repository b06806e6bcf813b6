#pragma once

#include "core/trajectory.hpp"
#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <limits>
#include <optional>
#include <vector>

namespace stairwell::planning3d {

/// The velocity a UAV wishes for while local avoidance pushes it about: towards a point some way ahead on its path that
/// it can reach on a straight line, slowing down towards the end.
class PathFollower {
 public:
  /// @pre path_m is not empty
  PathFollower(std::vector<Eigen::Vector3d> path_m, const MotionLimits& limits, double cruise_mps);

  double length_m() const { return arc_m_.back(); }
  double progress_m() const { return progress_m_; }  ///< along the path; falls when pushed back
  const Eigen::Vector3d& goal_m() const { return path_m_.back(); }
  Eigen::Vector3d point_at(double arc_m) const;
  /// Progress to the nearest point of the whole path.
  void seek(const Eigen::Vector3d& position_m);
  /// Nearest point of the part of the path around the progress so far. Call once per period, before the wish.
  void update(const Eigen::Vector3d& position_m);

  /// Towards the path's end, or `stop_arc_m` on it (which may lie behind). nullopt when no point of the path nearby can
  /// be reached on a straight line: a new path is needed.
  std::optional<Eigen::Vector3d> wish_mps(const FreeSpace& space, const Eigen::Vector3d& position_m,
                                          double stop_arc_m = std::numeric_limits<double>::infinity()) const;

 private:
  void update_between(const Eigen::Vector3d& position_m, double from_m, double to_m);

  std::vector<Eigen::Vector3d> path_m_;
  std::vector<double> arc_m_;
  MotionLimits limits_;
  double cruise_mps_;
  double progress_m_ = 0.0;
};

}  // namespace stairwell::planning3d
