#pragma once

#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

namespace octomap {
class OcTree;
}

namespace stairwell::mapping {

/// What a voxel should be. kEither: right whatever the map says (a surface runs through it); kIgnore: not counted
/// at all (nothing is known about it).
enum class ExpectedOccupancy : std::uint8_t { kFree, kOccupied, kEither, kIgnore };

/// Voxel counts at the map's resolution.
struct MapComparison {
  std::size_t expected_voxels = 0;  ///< the reference says something about them
  std::size_t observed_voxels = 0;  ///< of these, known in the map
  std::size_t correct_voxels = 0;   ///< of these, as expected
  std::size_t false_occupied = 0;   ///< occupied in the map, free in the reference
  std::size_t false_free = 0;       ///< free in the map, occupied in the reference
  std::size_t missing_voxels = 0;   ///< expected, but unknown in the map
  std::size_t unjudged_voxels = 0;  ///< known in the map, but the reference says nothing
  double correct_fraction = std::numeric_limits<double>::quiet_NaN();  ///< of the observed
  double missing_fraction = std::numeric_limits<double>::quiet_NaN();  ///< of the expected
};

/// Over the map's box.
MapComparison compare_map(const OccupancyMap& map, const std::function<ExpectedOccupancy(const VoxelIndex&)>& expected);

/// Over the union of both boxes. A reference of another resolution is looked up at the map's voxel centres.
MapComparison compare_maps(const OccupancyMap& map, const OccupancyMap& reference);
MapComparison compare_maps(const octomap::OcTree& map, const octomap::OcTree& reference);

}  // namespace stairwell::mapping
