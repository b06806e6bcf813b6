/// OctoMap files. Adaptor header: names octomap types.
#pragma once

#include "mapping/occupancy_map.hpp"

#include <filesystem>
#include <memory>

namespace octomap {
class OcTree;
}

namespace stairwell::mapping {

/// Writes `.bt` (maximum likelihood, binary) or `.ot` (full log-odds), by extension: to a temporary name beside the
/// target, flushed, checked, renamed. The map itself is not changed (no clamping to maximum likelihood).
/// @throws RunError naming the file when it cannot be written (unwritable, disk full), leaving no partial file;
/// InputError for another extension.
void save_octomap(const OccupancyMap& map, const std::filesystem::path& file);
void save_octomap(const octomap::OcTree& tree, const std::filesystem::path& file);

/// Reads `.bt` or `.ot`. @throws InputError naming the file when it is missing, empty, truncated or not an OcTree.
std::unique_ptr<octomap::OcTree> load_octree(const std::filesystem::path& file);

/// Copies the tree's leaves (expanded to single voxels) into a map over the tree's own bounding box, or over `grid`.
OccupancyMap map_from_octree(const octomap::OcTree& tree);
OccupancyMap map_from_octree(const octomap::OcTree& tree, const GridSpec& grid);

}  // namespace stairwell::mapping
