#pragma once

#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <vector>

namespace stairwell::planning3d {

/// A convex piece of free space around a place: wherever in it the robot's centre is, its sphere (and `spare_m` more)
/// touches nothing blocked; unknown counts as blocked. Planes are laid against the nearest blocked voxel that no plane
/// has cut off yet, and against the flight box.
class FreeCell {
 public:
  /// Where the robot's centre may be: normal . x >= offset_m.
  struct Plane {
    Eigen::Vector3d normal;  ///< unit length, away from the obstacle
    double offset_m;
    double gap_m(const Eigen::Vector3d& point_m) const { return normal.dot(point_m) - offset_m; }
  };

  /// Looks at what is nearer than `reach_m` to the robot's surface. @pre center_m is finite
  FreeCell(const FreeSpace& space, const Eigen::Vector3d& center_m, double reach_m, double spare_m);

  const std::vector<Plane>& planes() const { return planes_; }
  /// The cell ends this far from its centre, where nobody looked.
  double reach_m() const { return reach_m_; }
  /// Planes that the centre itself is beyond (a map that changed around the robot) may be left, not crossed farther.
  bool contains(const Eigen::Vector3d& point_m) const;

 private:
  void add_flight_box(const Aabb& box);

  Eigen::Vector3d center_m_;
  double reach_m_;
  std::vector<Plane> planes_;
};

}  // namespace stairwell::planning3d
