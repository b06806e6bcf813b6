#pragma once

#include "planning3d/free_space.hpp"

#include <vector>

namespace stairwell::planning3d {

/// Whether the robot fits along straight segments: every voxel passed is traversable, near obstacles the capsule that
/// the sphere sweeps is tested exactly, and keep-out spheres are not entered.
class SegmentCheck {
 public:
  /// A keep-out sphere that holds `start_m` shrinks so that the robot can leave it, not come closer.
  SegmentCheck(const FreeSpace& space, const std::vector<KeepOut>& keep_out, const Eigen::Vector3d& start_m);

  const FreeSpace& space() const { return *space_; }
  bool voxel_free(const VoxelIndex& v) const { return space_->traversable(v) && outside_keep_out(v); }
  bool outside_keep_out(const Eigen::Vector3d& point_m) const;
  bool outside_keep_out(const VoxelIndex& v) const {  ///< its centre
    return keep_out_.empty() || outside_keep_out(space_->grid().center_of(v));
  }
  /// A robot anywhere inside this voxel touches nothing.
  bool roomy(const VoxelIndex& v) const { return space_->blocked_distance().squared_cells(v) >= roomy_squared_cells_; }
  /// The robot's sphere at an exact place.
  bool fits(const Eigen::Vector3d& point_m) const { return space_->sphere_free(point_m, space_->robot().radius_m); }

  bool segment_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const;
  /// The same without regard to which voxels are passed: the swept sphere touches nothing, exactly, and keeps inside
  /// the flight box. True wherever segment_free() is, and also between voxels that meet in an edge or a corner only.
  /// @param spare_m  added to the robot's radius
  bool sweep_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double spare_m = 0.0) const;

 private:
  bool keeps_out(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const;

  const FreeSpace* space_;
  std::vector<KeepOut> keep_out_;
  int roomy_squared_cells_ = 0;
};

}  // namespace stairwell::planning3d
