#pragma once

#include "planning3d/planner.hpp"

#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// Extra cost per voxel length by squared distance in cells (the distance field's values): `clearance_weight` at the
/// least clearance, falling as a parabola to 0 at `comfort_m` beyond it.
std::vector<float> nearness_table(const FreeSpace& space, double clearance_weight, double comfort_m);

/// Its mean along a straight line, sampled about once a voxel.
double mean_nearness(const FreeSpace& space, const std::vector<float>& nearness, const Eigen::Vector3d& a_m,
                     const Eigen::Vector3d& b_m);

/// By voxel z: 1 where the rule allows horizontal moves.
std::vector<std::uint8_t> level_table(const GridSpec& grid, const MotionRule& rule);
/// Whether the slice rule allows the straight line between two voxels: in a column, or in a layer.
bool stays_in_slice(const std::vector<std::uint8_t>& level, const VoxelIndex& a, const VoxelIndex& b);

/// Lowest and highest voxel that a path may need: by the slice rule, columns beyond all layers and both ends lead
/// nowhere.
struct HeightRange {
  int lo;
  int hi;
  bool contains(int z) const { return z >= lo && z <= hi; }
};
HeightRange useful_heights(const std::vector<std::uint8_t>& level, int start_z, int goal_z);

}  // namespace stairwell::planning3d
