#pragma once

#include "mapping/occupancy_map.hpp"

namespace stairwell::test {

/// A hand-made explored building: storeys of 3.2 m with rooms, doors, a table and a stairwell opening. Outer walls and
/// roof were seen from inside only.
inline mapping::OccupancyMap explored_building(int storeys, double length_m = 16.0, double width_m = 12.0) {
  const double height_m = 3.2, res = 0.1;
  const GridSpec grid(Aabb{{-1.0, -1.0, -0.5}, {length_m + 1.0, width_m + 1.0, storeys * height_m + 0.5}}, res);
  mapping::OccupancyMap map(grid);
  const auto solid = [&](const Eigen::Vector3d& p) {
    const double above = p.z() - std::floor(p.z() / height_m) * height_m;
    const bool slab = above < 0.2 || p.z() < 0.0;
    const bool opening = p.z() > 0.5 && p.x() > length_m - 3.0 && p.x() < length_m - 0.5 && p.y() > 0.5 && p.y() < 4.0;
    if (slab && !(opening && p.z() < storeys * height_m)) return true;
    const bool door = above < 2.2 && std::abs(std::fmod(p.x(), 5.0) - 2.5) < 0.6;
    if (std::abs(p.y() - 0.5 * width_m) < 0.1 && !door) return true;
    const bool cross_door = above < 2.2 && std::abs(p.y() - 0.25 * width_m) < 0.6;
    if (p.x() > 1.0 && std::abs(std::fmod(p.x(), 5.0)) < 0.1 && !cross_door) return true;
    return above < 0.95 && p.x() > 1.5 && p.x() < 3.5 && p.y() > 8.0 && p.y() < 9.2;
  };
  const auto inside = [&](const Eigen::Vector3d& p) {
    return p.x() > 0.2 && p.y() > 0.2 && p.x() < length_m - 0.2 && p.y() < width_m - 0.2 && p.z() > 0.0 &&
           p.z() < storeys * height_m;
  };
  const auto shell = [&](const Eigen::Vector3d& p) {
    return p.x() > 0.0 && p.y() > 0.0 && p.x() < length_m && p.y() < width_m && p.z() > -0.2 &&
           p.z() < storeys * height_m + 0.2;
  };
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const Eigen::Vector3d p = grid.center_of(v);
    if (!shell(p)) continue;
    map.update(v, !inside(p) || solid(p));
  }
  return map;
}

}  // namespace stairwell::test
