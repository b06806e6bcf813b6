#include "coverage3d/viewpoints.hpp"

#include "coverage3d/frontier_finder.hpp"
#include "mapping/distance_field.hpp"
#include "toy_world.hpp"

#include <catch2/catch.hpp>

#include <optional>
#include <vector>

using namespace stairwell;
using namespace stairwell::coverage3d;

namespace {

constexpr int kWall = 20;  // voxels of 0.1 m from the room's end
constexpr int kDoor[] = {3, 11};

/// A room, a wall one voxel thick and half a room behind it, then unknown. Rays that grazed the wall made it free.
struct GrazedWall {
  explicit GrazedWall(bool has_door)
      : grid({{0.0, 0.0, 0.0}, {5.0, 4.0, 2.0}}, 0.1), map(grid), distance(grid, 1.0, mapping::Obstacles::kBlocked) {
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      const VoxelIndex v = grid.voxel(i);
      if (v.x > kWall + 10) continue;
      const bool opening = has_door && v.y >= kDoor[0] && v.y < kDoor[1];
      if (v.x == kWall && !opening) map.update(v, true);
      for (int misses = 0; misses < 8; ++misses) map.update(v, false);
      REQUIRE(map.at(v) == Occupancy::kFree);
    }
    distance.update(map);
    robot.radius_m = 0.2;
    FrontierConfig frontier;
    frontier.box = grid.box();
    finder.emplace(grid, frontier);
    finder->update(map);
  }

  /// From this side of the wall.
  std::vector<Viewpoint> views(const FrontierCluster& cluster) const {
    ViewpointConfig config;
    config.sensor = toy::lidar();
    config.box = grid.box();
    ViewpointPlaces places;
    places.reachable = [](const VoxelIndex& v) { return v.x < kWall; };
    return ViewpointSampler(config).search({map, distance, robot, grid.box()}, cluster, places);
  }

  GridSpec grid;
  mapping::OccupancyMap map;
  mapping::DistanceField distance;
  Robot robot;
  std::optional<FrontierFinder> finder;
};

}  // namespace

TEST_CASE("nothing is seen through a surface that grazing rays have made free") {
  const GrazedWall scene(false);
  REQUIRE(!scene.finder->clusters().empty());
  for (const auto& [id, cluster] : scene.finder->clusters()) CHECK(scene.views(cluster).empty());
}

TEST_CASE("through an opening beside such a surface all views lead") {
  const GrazedWall scene(true);
  std::size_t seen = 0;
  for (const auto& [id, cluster] : scene.finder->clusters()) {
    for (const Viewpoint& view : scene.views(cluster)) {
      CHECK(view.voxel.x < kWall);
      for (const VoxelIndex& cell : view.seen_cells) {
        const Eigen::Vector3d to_m = scene.grid.center_of(cell);
        const double along = (0.1 * (kWall + 0.5) - view.position_m.x()) / (to_m.x() - view.position_m.x());
        const double y_m = view.position_m.y() + along * (to_m.y() - view.position_m.y());
        CHECK(y_m > 0.1 * kDoor[0] - 0.06);
        CHECK(y_m < 0.1 * kDoor[1] + 0.06);
        ++seen;
      }
    }
  }
  CHECK(seen > 10);
}
