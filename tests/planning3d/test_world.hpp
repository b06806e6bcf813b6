#pragma once

#include "core/rng.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/occupancy_words.hpp"
#include "planning3d/free_space.hpp"

#include <ctime>

namespace stairwell::test {

/// Processor time, which other programs on the machine do not lengthen.
inline double cpu_ms_since(std::clock_t begin) {
  return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

/// A known box with obstacles, and what planning needs of it.
struct TestWorld {
  TestWorld(const Eigen::Vector3d& size_m, double resolution_m, Robot body = {0.2, 0.0})
      : map(GridSpec({Eigen::Vector3d::Zero(), size_m}, resolution_m)),
        field(map.grid(), 1.0, mapping::Obstacles::kBlocked),
        words(map.grid(), mapping::Obstacles::kBlocked),
        robot(body),
        box{Eigen::Vector3d::Zero(), size_m} {
    fill(box, false);
  }

  void fill(const Aabb& region, bool occupied) {
    const VoxelIndex lo = map.grid().index_of(region.min_m + Eigen::Vector3d::Constant(1e-6));
    const VoxelIndex hi = map.grid().index_of(region.max_m - Eigen::Vector3d::Constant(1e-6));
    for (int z = lo.z; z <= hi.z; ++z) {
      for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) map.set_log_odds({x, y, z}, occupied ? 2.0F : -1.0F);
      }
    }
  }

  void clutter(Rng& rng, int boxes, double largest_m) {
    for (int i = 0; i < boxes; ++i) {
      Aabb block;
      for (int axis = 0; axis < 3; ++axis) {
        const double edge_m = rng.uniform(0.2, largest_m);
        block.min_m[axis] = rng.uniform(0.0, box.max_m[axis] - edge_m);
        block.max_m[axis] = block.min_m[axis] + edge_m;
      }
      fill(block, true);
    }
  }

  planning3d::FreeSpace space() {
    field.update(map);
    words.update(map);
    return {map, field, robot, box, &words};
  }

  /// A random traversable voxel centre.
  Eigen::Vector3d random_place(const planning3d::FreeSpace& space, Rng& rng) const {
    for (;;) {
      const VoxelIndex v{rng.uniform_int(0, map.grid().size()[0] - 1), rng.uniform_int(0, map.grid().size()[1] - 1),
                         rng.uniform_int(0, map.grid().size()[2] - 1)};
      if (space.traversable(v)) return map.grid().center_of(v);
    }
  }

  mapping::OccupancyMap map;
  mapping::DistanceField field;
  mapping::OccupancyWords words;
  Robot robot;
  Aabb box;
};

}  // namespace stairwell::test
