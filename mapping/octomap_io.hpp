/// OctoMap files. Adaptor header: names octomap types.
#pragma once

#include "mapping/occupancy_map.hpp"
#include "mapping/octomap_check.hpp"

#include <filesystem>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>

namespace octomap {
class OcTree;
}

namespace stairwell::mapping {

/// Writes `.bt` (maximum likelihood, binary) or `.ot` (full log-odds), by extension: to a temporary name beside the
/// target, flushed, checked, renamed. The map itself is not changed (no clamping to maximum likelihood), and of an
/// OccupancyMap no OcTree is made (octree_stream.hpp).
/// @throws RunError naming the file when it cannot be written (unwritable, disk full), leaving no partial file;
/// InputError for another extension.
void save_octomap(const OccupancyMap& map, const std::filesystem::path& file);
void save_octomap(const octomap::OcTree& tree, const std::filesystem::path& file);

/// By extension. @throws InputError for another one.
OctomapFormat octomap_format_of(const std::filesystem::path& file);
/// Writes and flushes; the stream's state tells whether it worked. The tree is not changed.
void write_octomap(const octomap::OcTree& tree, std::ostream& stream, OctomapFormat format);

/// Reads `.bt` or `.ot`. @throws InputError naming the file when it is missing, empty, truncated or not an OcTree.
std::unique_ptr<octomap::OcTree> load_octree(const std::filesystem::path& file);
/// The same from a file's content; `name` begins every message.
std::unique_ptr<octomap::OcTree> parse_octree(std::string_view content, const std::string& name);

/// Copies the tree's leaves (expanded to single voxels) and its sensor model into a map over the tree's own bounding
/// box, or over `grid`. @throws InputError for an empty tree, another resolution, more than 5e8 voxels, or a
/// tree's own box of more than 8e9.
OccupancyMap map_from_octree(const octomap::OcTree& tree);
OccupancyMap map_from_octree(const octomap::OcTree& tree, const GridSpec& grid);

}  // namespace stairwell::mapping
