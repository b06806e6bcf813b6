#include "mapping/distance_field.hpp"
#include "scribble.hpp"

#include <dynamicEDT3D/dynamicEDTOctomap.h>
#include <octomap/OcTree.h>

#include <catch2/catch.hpp>

#include <algorithm>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

TEST_CASE("distance field equals dynamicEDT3D where that is exact", "[distance]") {
  Rng rng = make_rng(5, "edt-dynamic");
  const double resolution_m = 0.1;
  const GridSpec grid({{-1.5, -2.0, 0.0}, {2.5, 1.0, 2.0}}, resolution_m);
  OccupancyMap map(grid);
  scribble(rng, map, 60);
  DistanceField field(grid, 1.0, Obstacles::kOccupied);
  field.update(map);
  octomap::OcTree tree(map.octree());
  const octomap::point3d lo(-1.45F, -1.95F, 0.05F), hi(2.45F, 0.95F, 1.95F);
  DynamicEDTOctomap reference(1.0F, &tree, lo, hi, false);
  reference.update();
  std::size_t larger = 0;
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const Eigen::Vector3f c = grid.center_of(v).cast<float>();
    const double theirs =
        std::min(static_cast<double>(reference.getDistance(octomap::point3d(c.x(), c.y(), c.z()))), 1.0);
    const double ours = field.distance_m(v);
    // Brushfire propagation may overestimate where its wave fronts cut a corner; it never underestimates.
    REQUIRE(theirs >= ours - 1e-4);
    larger += theirs > ours + 1e-4 ? 1U : 0U;
  }
  CHECK(static_cast<double>(larger) < 0.01 * static_cast<double>(grid.voxel_count()));
}
