#pragma once

#include "core/grid_spec.hpp"

#include <vector>

namespace stairwell::sim3d {

/// Spreads from the voxels in `open` over voxel faces. `enter(voxel, linear index)` marks what it is asked about and
/// says whether to go on from there; it is asked again about the same voxel.
template <typename Enter>
void flood(const GridSpec& grid, std::vector<VoxelIndex> open, const Enter& enter) {
  while (!open.empty()) {
    const VoxelIndex v = open.back();
    open.pop_back();
    for (const int step : {-1, 1}) {
      for (const VoxelIndex& to :
           {v + VoxelIndex{step, 0, 0}, v + VoxelIndex{0, step, 0}, v + VoxelIndex{0, 0, step}}) {
        if (grid.contains(to) && enter(to, grid.linear(to))) open.push_back(to);
      }
    }
  }
}

}  // namespace stairwell::sim3d
