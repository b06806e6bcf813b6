#pragma once

#include "core/grid_spec.hpp"

#include <vector>

namespace stairwell::sim3d {

/// Asks `enter(voxel, linear index)` about the six neighbours of a voxel and adds those it lets in to `entered`.
template <typename Enter>
void enter_neighbours(const GridSpec& grid, const VoxelIndex& v, const Enter& enter, std::vector<VoxelIndex>& entered) {
  for (const int step : {-1, 1}) {
    for (const VoxelIndex& to : {v + VoxelIndex{step, 0, 0}, v + VoxelIndex{0, step, 0}, v + VoxelIndex{0, 0, step}}) {
      if (grid.contains(to) && enter(to, grid.linear(to))) entered.push_back(to);
    }
  }
}

/// Spreads from the voxels in `open` over voxel faces. `enter(voxel, linear index)` marks what it is asked about and
/// says whether to go on from there; it is asked again about the same voxel. Breadth first: what is open at a time is a
/// surface, not the volume.
template <typename Enter>
void flood(const GridSpec& grid, std::vector<VoxelIndex> open, const Enter& enter) {
  std::vector<VoxelIndex> next;
  while (!open.empty()) {
    next.clear();
    for (const VoxelIndex& v : open) enter_neighbours(grid, v, enter, next);
    open.swap(next);
  }
}

}  // namespace stairwell::sim3d
