/// OctoMap files of a map without OctoMap's tree.
#pragma once

#include "mapping/occupancy_map.hpp"
#include "mapping/octomap_check.hpp"

#include <iosfwd>
#include <string>
#include <string_view>

namespace stairwell::mapping {

/// Writes, byte for byte, what OctoMap writes for `map.octree()` (for `.bt` brought to maximum likelihood and pruned,
/// as its `writeBinary` does), and flushes. The tree is not made: beside the map it takes about 16 bytes for each block
/// of 8x8x8 voxels. The stream's state tells whether it worked.
void write_octomap(const OccupancyMap& map, std::ostream& stream, OctomapFormat format);

/// Sets every voxel of the map that a leaf of a `.ot` file covers to the leaf's log-odds; nothing else is kept in memory.
/// @param name begins every message. @throws InputError for a damaged file, a `.bt` file or another resolution than the
/// map's
void read_octomap(std::string_view content, const std::string& name, OccupancyMap& map);

}  // namespace stairwell::mapping
