/// The rays of a panorama, four at a time with vector instructions; for view_gain.cpp and its tests.
#pragma once

#include "core/aabb.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::coverage3d::gain_rays {

constexpr std::size_t kLanes = 4;

/// What every ray of a panorama does: its points, what the unknown adds at each, and how much of it ends the ray.
struct Steps {
  std::vector<double> r_m;
  std::vector<double> value_m3;  ///< 0 nearer than the sensor sees
  std::int64_t most_unknown = 0;
};

/// Rays of four sectors, row by row.
struct Bundle {
  /// One ray of each sector, all equally steep.
  struct Row {
    alignas(32) std::array<double, kLanes> x, y, z;  ///< of the directions
  };
  std::vector<Row> rows;
};

/// Whether `sum` may be asked: the processor can, and every point in the box is a voxel of the map.
bool usable(const mapping::OccupancyMap& map, const Aabb& box);

/// What the unknown on the rays from a point adds up to, for each of the four sectors: in the order in which ViewGain
/// adds it up ray by ray, so to the last digit. @pre usable(map, box)
std::array<double, kLanes> sum(const mapping::OccupancyMap& map, const Aabb& box, const Eigen::Vector3d& from_m,
                               const Steps& steps, const Bundle& bundle);

}  // namespace stairwell::coverage3d::gain_rays
