#pragma once

#include "core/grid_spec.hpp"

#include <Eigen/Core>

#include <cmath>
#include <limits>

namespace stairwell::coverage3d {

/// Visits the voxels that a straight segment passes, in order and with both ends (Amanatides and Woo 1987), until
/// `visit(voxel)` returns false. Returns false when it was stopped.
template <typename Visit>
bool walk_voxels(const GridSpec& grid, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, Visit&& visit) {
  const double inverse = 1.0 / grid.resolution_m();
  const VoxelIndex first = grid.index_of(from_m);
  const VoxelIndex last = grid.index_of(to_m);
  const Eigen::Vector3d delta = (to_m - from_m) * inverse;
  int cell[3] = {first.x, first.y, first.z};
  const int end[3] = {last.x, last.y, last.z};
  int step[3];
  double next[3];
  double stride[3];
  int remaining = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double offset = from_m[axis] * inverse - (cell[axis] + grid.first_cell()[static_cast<std::size_t>(axis)]);
    step[axis] = end[axis] > cell[axis] ? 1 : -1;
    remaining += std::abs(end[axis] - cell[axis]);
    if (end[axis] == cell[axis]) {
      next[axis] = stride[axis] = std::numeric_limits<double>::infinity();
      continue;
    }
    stride[axis] = 1.0 / std::abs(delta[axis]);
    next[axis] = (step[axis] > 0 ? 1.0 - offset : offset) * stride[axis];
  }
  if (!visit(first)) return false;
  for (; remaining > 0; --remaining) {
    int axis = next[0] < next[1] ? 0 : 1;
    if (next[2] < next[axis]) axis = 2;
    cell[axis] += step[axis];
    next[axis] = cell[axis] == end[axis] ? std::numeric_limits<double>::infinity() : next[axis] + stride[axis];
    if (!visit(VoxelIndex{cell[0], cell[1], cell[2]})) return false;
  }
  return true;
}

}  // namespace stairwell::coverage3d
