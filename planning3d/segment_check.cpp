#include "planning3d/segment_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

SegmentCheck::SegmentCheck(const FreeSpace& space, const std::vector<KeepOut>& keep_out, const Eigen::Vector3d& start_m)
    : space_(&space), keep_out_(keep_out) {
  const double res_m = space.grid().resolution_m();
  for (KeepOut& sphere : keep_out_) {
    sphere.radius_m = std::min(sphere.radius_m, (start_m - sphere.center_m).norm() - res_m);
  }
  std::erase_if(keep_out_, [](const KeepOut& sphere) { return !(sphere.radius_m > 0.0); });
  // Half a voxel's diagonal for the robot's place in its voxel, another for the obstacle's corner.
  const double cells = space.robot().radius_m / res_m + std::sqrt(3.0);
  roomy_squared_cells_ = static_cast<int>(std::ceil(std::min(cells * cells, 1e9)));
}

bool SegmentCheck::outside_keep_out(const Eigen::Vector3d& point_m) const {
  return std::all_of(keep_out_.begin(), keep_out_.end(), [&point_m](const KeepOut& sphere) {
    return (point_m - sphere.center_m).squaredNorm() >= sphere.radius_m * sphere.radius_m;
  });
}

bool SegmentCheck::keeps_out(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const {
  const Eigen::Vector3d leg_m = to_m - from_m;
  const double squared_m2 = std::max(1e-12, leg_m.squaredNorm());
  return std::all_of(keep_out_.begin(), keep_out_.end(), [&](const KeepOut& sphere) {
    const double u = std::clamp((sphere.center_m - from_m).dot(leg_m) / squared_m2, 0.0, 1.0);
    return (from_m + u * leg_m - sphere.center_m).norm() >= sphere.radius_m;
  });
}

bool SegmentCheck::sweep_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double spare_m) const {
  const Aabb& box = space_->flight_box();
  return box.contains(from_m) && box.contains(to_m) && keeps_out(from_m, to_m) &&
         space_->swept_sphere_free(from_m, to_m, space_->robot().radius_m + spare_m);
}

bool SegmentCheck::segment_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const {
  if (!keeps_out(from_m, to_m)) return false;
  // Amanatides & Woo 1987: all voxels between the two ends, in order.
  const GridSpec& grid = space_->grid();
  const double res_m = grid.resolution_m();
  const Eigen::Vector3d leg_m = to_m - from_m;
  const VoxelIndex first = grid.index_of(from_m);
  const VoxelIndex last = grid.index_of(to_m);
  int at[3] = {first.x, first.y, first.z};
  const int end[3] = {last.x, last.y, last.z};
  int step[3];
  double next[3];
  double delta[3];
  int crossings = 0;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = leg_m[axis] > 0.0 ? 1 : -1;
    crossings += std::abs(end[axis] - at[axis]);
    const double face_m =
        (grid.first_cell()[static_cast<std::size_t>(axis)] + at[axis] + (step[axis] > 0 ? 1 : 0)) * res_m;
    const bool moves = std::abs(leg_m[axis]) > 1e-12;
    next[axis] = moves ? (face_m - from_m[axis]) / leg_m[axis] : std::numeric_limits<double>::infinity();
    delta[axis] = moves ? res_m / std::abs(leg_m[axis]) : std::numeric_limits<double>::infinity();
  }
  double entered = 0.0;
  double near_from = -1.0;  // where the stretch of voxels began in which the robot may touch something; < 0: not in one
  const auto stretch_free = [&](double until) {
    return near_from < 0.0 ||
           space_->swept_sphere_free(from_m + near_from * leg_m, from_m + until * leg_m, space_->robot().radius_m);
  };
  for (int crossing = 0;; ++crossing) {
    const VoxelIndex v{at[0], at[1], at[2]};
    if (!space_->traversable(v)) return false;
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (roomy(v)) {
      if (!stretch_free(entered)) return false;
      near_from = -1.0;
    } else if (near_from < 0.0) {
      near_from = entered;
    }
    if (crossing >= crossings || next[axis] > 1.0) return stretch_free(1.0);
    entered = std::min(1.0, next[axis]);
    at[axis] += step[axis];
    next[axis] += delta[axis];
  }
}

}  // namespace stairwell::planning3d
