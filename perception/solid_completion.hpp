#pragma once

#include "core/grid_spec.hpp"
#include "core/occupancy.hpp"

#include <span>
#include <string>
#include <vector>

namespace stairwell::perception {

/// What is taken for solid behind a surface.
struct SolidConfig {
  /// Unknown regions that reach the grid's border count as enclosed too (the ground below the floor, the outside of
  /// closed outer walls). False: only what is closed within the grid.
  bool through_border = true;
  double max_wall_m = 0.4;  ///< thickest inside of a wall between two parallel faces; 0 = off

  std::vector<std::string> problems() const;
};

/// The unknown voxels that no sensor can see because they lie inside solids (SPEC A3), in the grid's order:
/// - unknown regions that no chain of unknown face neighbours connects to a free voxel, and
/// - runs of unknown voxels along an axis, at most max_wall_m long, between two occupied voxels, none of which has a
///   free face neighbour (walls whose faces are seen, but whose ends still leak).
/// For planning and accounting only: the map itself never gets these voxels, since nothing was measured there.
/// @param cells one per voxel of `grid`, x fastest. @throws InputError for a bad config or another number of cells
std::vector<VoxelIndex> complete_solids(std::span<const Occupancy> cells, const GridSpec& grid,
                                        const SolidConfig& config = {});

}  // namespace stairwell::perception
