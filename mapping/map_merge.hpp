#pragma once

#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <cstdint>

namespace stairwell::mapping {

/// What a merge did.
struct MergeEffect {
  std::size_t sent = 0;     ///< known voxels in the blocks that changed
  std::size_t changed = 0;  ///< of these, voxels that the receiver did not know so
};

/// What one UAV tells another about its map: the blocks of `from` in which a class changed after revision `since` (0 =
/// all). A voxel known to both keeps the surer of its two values, the occupied one where both are as sure, and returns
/// that either has seen stay noted: nothing counts twice, however often and by whichever way maps are told.
/// @pre both maps have the same grid and parameters
MergeEffect merge_changes(const OccupancyMap& from, std::uint64_t since, OccupancyMap& into);

}  // namespace stairwell::mapping
