#include "planning3d/cost_tables.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

std::vector<float> nearness_table(const FreeSpace& space, double clearance_weight, double comfort_m) {
  const auto most = static_cast<std::size_t>(space.blocked_distance().truncation_cells());
  const double least_cells = std::sqrt(static_cast<double>(space.min_squared_cells()));
  const double comfort_cells = std::max(1e-9, comfort_m / space.grid().resolution_m());
  std::vector<float> nearness(most * most + 1, 0.0F);
  for (std::size_t squared = 0; squared < nearness.size(); ++squared) {
    const double beyond = (std::sqrt(static_cast<double>(squared)) - least_cells) / comfort_cells;
    const double near = std::clamp(1.0 - beyond, 0.0, 1.0);
    nearness[squared] = static_cast<float>(std::max(0.0, clearance_weight) * near * near);
  }
  return nearness;
}

double mean_nearness(const FreeSpace& space, const std::vector<float>& nearness, const Eigen::Vector3d& a_m,
                     const Eigen::Vector3d& b_m) {
  const GridSpec& grid = space.grid();
  const int pieces = std::max(1, static_cast<int>(std::ceil((b_m - a_m).norm() / grid.resolution_m())));
  double sum = 0.0;
  for (int k = 0; k < pieces; ++k) {
    const Eigen::Vector3d at_m = a_m + (k + 0.5) / pieces * (b_m - a_m);
    sum += static_cast<double>(nearness[space.blocked_distance().squared_cells(grid.index_of(at_m))]);
  }
  return sum / pieces;
}

std::vector<std::uint8_t> level_table(const GridSpec& grid, const MotionRule& rule) {
  const bool anywhere = rule.kind == MotionRule::Kind::kVolume;
  std::vector<std::uint8_t> level(static_cast<std::size_t>(grid.size()[2]), anywhere ? 1 : 0);
  for (const double height_m : rule.layers_m) {
    if (!std::isfinite(height_m)) continue;
    const int z = grid.index_of({0.0, 0.0, height_m}).z;
    if (z >= 0 && z < grid.size()[2]) level[static_cast<std::size_t>(z)] = 1;
  }
  return level;
}

bool stays_in_slice(const std::vector<std::uint8_t>& level, const VoxelIndex& a, const VoxelIndex& b) {
  if (a.x == b.x && a.y == b.y) return true;
  return a.z == b.z && level[static_cast<std::size_t>(a.z)] != 0;
}

HeightRange useful_heights(const std::vector<std::uint8_t>& level, int start_z, int goal_z) {
  HeightRange range{std::min(start_z, goal_z), std::max(start_z, goal_z)};
  for (int z = 0; z < static_cast<int>(level.size()); ++z) {
    if (level[static_cast<std::size_t>(z)] == 0) continue;
    range.lo = std::min(range.lo, z);
    range.hi = std::max(range.hi, z);
  }
  return range;
}

}  // namespace stairwell::planning3d
