/// What the map commands do, without the command line.
#pragma once

#include "mapping/map_compare.hpp"
#include "mapping/occupancy_map.hpp"
#include "sim3d/ground_truth.hpp"
#include "sim3d/world.hpp"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>

namespace stairwell::apps {

/// `.bt` or `.ot`.
bool is_octomap_file(const std::filesystem::path& file);

/// resolution_m, leaves, known/occupied/free volumes, bounds of the known space, memory.
nlohmann::ordered_json map_info(const std::filesystem::path& file);

/// What the world says about a voxel of its lattice.
mapping::ExpectedOccupancy expected_occupancy(const sim3d::GroundTruth& truth, const VoxelIndex& v);

/// The map against another map, or against a world: free and surface voxels must be so; voxels on whose face a surface
/// lies are right either way; unknown voxels count as missing only where they are connected to the map's free space.
mapping::MapComparison compare_with(const std::filesystem::path& map, const std::filesystem::path& reference,
                                    const sim3d::WorldOptions& options);
mapping::MapComparison compare_with_world(const mapping::OccupancyMap& map, const sim3d::World& world);
nlohmann::ordered_json to_json(const mapping::MapComparison& comparison);

/// To `.bt`, `.ot`, or the centres of the occupied voxels as `.pcd` or `.ply`.
void convert_map(const std::filesystem::path& from, const std::filesystem::path& to);

/// The world's surface voxels as an OctoMap. Where a surface lies exactly on a voxel face, the voxels on both sides
/// are taken.
mapping::OccupancyMap voxelised(const sim3d::World& world, double resolution_m);

}  // namespace stairwell::apps
