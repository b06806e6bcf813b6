#pragma once

#include "coverage3d/frontier_voxels.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::coverage3d {

/// The frontier in cells of 2 x 2 x 2 voxels, for pictures: which cells hold a frontier voxel, and which began or
/// ceased to. Kept up to date from the blocks of the map that changed, without the clusters of a FrontierFinder.
class FrontierCells {
 public:
  static constexpr int kEdge = 2;  ///< voxels

  /// @throws InputError when the config has problems or the box does not meet the grid.
  FrontierCells(const GridSpec& grid, const FrontierConfig& config);

  /// Cells that differ from those of the last update; all that there are in the first one. In no special order.
  struct Changes {
    std::vector<VoxelIndex> added, removed;
  };
  /// @param workers  may be null @pre map.grid() is the grid given
  Changes update(const mapping::OccupancyMap& map, mapping::WorkerPool* workers = nullptr);

 private:
  FrontierConfig config_;
  mapping::VoxelBox box_;
  std::array<int, 3> blocks_;
  std::vector<std::uint64_t> cells_;  ///< by block of 8 x 8 x 8 voxels: bit `16 * z + 4 * y + x`
  std::uint64_t revision_ = 0;
};

}  // namespace stairwell::coverage3d
