/// Random contents for maps.
#pragma once

#include "core/rng.hpp"
#include "mapping/occupancy_map.hpp"

namespace stairwell::mapping::test {

inline VoxelIndex random_voxel(Rng& rng, const GridSpec& grid) {
  return {rng.uniform_int(0, grid.size()[0] - 1), rng.uniform_int(0, grid.size()[1] - 1),
          rng.uniform_int(0, grid.size()[2] - 1)};
}

/// Free cubes and occupied plates.
inline void scribble(Rng& rng, OccupancyMap& map, int strokes) {
  for (int i = 0; i < strokes; ++i) {
    const VoxelIndex at = random_voxel(rng, map.grid());
    const int reach = rng.uniform_int(0, 4);
    const bool occupied = rng.uniform_int(0, 9) == 0;
    for (int dz = -reach; dz <= reach; ++dz) {
      for (int dy = -reach; dy <= reach; ++dy) {
        for (int dx = -reach; dx <= reach; ++dx) {
          if (!occupied || dx == 0) {
            map.update(at + VoxelIndex{dx, dy, dz}, occupied);
          }
        }
      }
    }
  }
}

}  // namespace stairwell::mapping::test
