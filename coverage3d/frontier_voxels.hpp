#pragma once

#include "core/aabb.hpp"
#include "core/grid_spec.hpp"
#include "mapping/occupancy_map.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace stairwell::coverage3d {

/// What counts as a frontier, and how frontiers are cut into clusters.
struct FrontierConfig {
  Aabb box;                        ///< task box: frontiers and the unknown beyond them lie inside
  int min_free_neighbours = 3;     ///< of 26 (SPEC B4)
  int min_unknown_neighbours = 3;  ///< of 26 (SPEC B4)
  double split_size_m = 2.0;       ///< clusters are cut until no longer than this along their main axis
  double min_area_m2 = 0.08;       ///< smaller clusters are not worth a visit
  int min_cells = 5;               ///< and so are those of fewer voxels, on coarse maps
  /// Instead of the neighbours above: a free voxel with an unknown one among its eight neighbours at the same height
  /// (C2-Explorer's frontiers), walls not seen from near included.
  bool planar = false;
  double deep_m3 = 2.0;  ///< larger pockets behind a cluster are not measured to their end

  std::vector<std::string> problems() const;
};

/// Voxels whose centres lie inside the task box.
/// @throws InputError when the box does not meet the grid, or holds no voxel's centre
mapping::VoxelBox voxels_inside(const GridSpec& grid, const Aabb& box);

/// Blocks that may have another frontier, in a fixed order: those of which a voxel or its neighbour changed.
/// @param box  of the task, in voxels
std::vector<VoxelIndex> blocks_to_examine(const std::vector<mapping::VoxelBox>& changed, const mapping::VoxelBox& box);

/// The definition, for one voxel: free and never hit, inside the box, at least one unknown 6-neighbour inside the box,
/// and enough free and unknown voxels among its 26 neighbours.
bool is_frontier(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                 const VoxelIndex& v);

/// Steps to the six voxels that share a face with one.
inline constexpr std::array<VoxelIndex, 6> kFaceSteps{
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

/// A set of voxels of a block of 8 x 8 x 8: bit `8 * y + x` of word `z`.
using BlockBits = std::array<std::uint64_t, 8>;

/// `is_frontier` of all voxels of a block at once. @param block  its voxels are 8 * block + (0..7) per axis
BlockBits frontier_bits(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                        const VoxelIndex& block);

/// The lowest voxel of a block.
inline VoxelIndex origin_of(const VoxelIndex& block) { return {8 * block.x, 8 * block.y, 8 * block.z}; }

inline bool holds(const mapping::VoxelBox& box, const VoxelIndex& v) {
  return v.x >= box.lo.x && v.y >= box.lo.y && v.z >= box.lo.z && v.x <= box.hi.x && v.y <= box.hi.y && v.z <= box.hi.z;
}

/// How many voxels the set has.
int count(const BlockBits& bits);

/// Calls `visit(VoxelIndex)` with the place in the block of each voxel of the set, x fastest.
template <typename Visit>
void for_each_voxel(const BlockBits& bits, const Visit& visit) {
  for (int z = 0; z < 8; ++z) {
    for (std::uint64_t rest = bits[static_cast<std::size_t>(z)]; rest != 0; rest &= rest - 1) {
      const int at = std::countr_zero(rest);
      visit(VoxelIndex{at & 7, at >> 3, z});
    }
  }
}

/// The parts of a set that connect over faces, edges and corners, cut along their longest side until none is longer
/// than `longest` voxels.
std::vector<BlockBits> connected_parts(const BlockBits& bits, int longest);

}  // namespace stairwell::coverage3d
