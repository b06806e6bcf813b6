#pragma once

#include "planning3d/planner.hpp"

#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// Extra cost per voxel length by squared distance in cells (the distance field's values): `clearance_weight` at the
/// least clearance, falling as a parabola to 0 at `comfort_m` beyond it.
std::vector<float> nearness_table(const FreeSpace& space, double clearance_weight, double comfort_m);

/// By voxel z: 1 where the rule allows horizontal moves.
std::vector<std::uint8_t> level_table(const GridSpec& grid, const MotionRule& rule);

/// Lowest and highest voxel that a path may need: by the slice rule, columns beyond all layers and both ends lead
/// nowhere.
struct HeightRange {
  int lo;
  int hi;
  bool contains(int z) const { return z >= lo && z <= hi; }
};
HeightRange useful_heights(const std::vector<std::uint8_t>& level, int start_z, int goal_z);

}  // namespace stairwell::planning3d
