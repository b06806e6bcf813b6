#include "coverage3d/viewpoints.hpp"

#include "coverage3d/frontier_finder.hpp"
#include "mapping/distance_field.hpp"
#include "toy_world.hpp"

#include <catch2/catch.hpp>

#include <optional>
#include <set>
#include <tuple>
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

  planning3d::FreeSpace space() const { return {map, distance, robot, grid.box()}; }

  ViewpointSampler sampler(const SensorModel& sensor = toy::lidar()) const {
    ViewpointConfig config;
    config.sensor = sensor;
    config.box = grid.box();
    return ViewpointSampler(config);
  }

  /// From this side of the wall.
  std::vector<Viewpoint> views(const FrontierCluster& cluster) const {
    ViewpointPlaces places;
    places.reachable = [](const VoxelIndex& v) { return v.x < kWall; };
    return sampler().search(space(), cluster, places);
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

TEST_CASE("a thorough search leaves out only places from which nothing can be in the field of view") {
  const GrazedWall scene(true);
  std::size_t left_out = 0, asked_after = 0, seeing = 0;
  using Band = std::pair<double, double>;
  for (const Band& band : {Band{-0.2, 0.2}, {-0.1, 0.6}, {0.1, 0.5}, {-0.7, -0.2}, {-1.7, 1.7}}) {
    SensorModel sensor = toy::lidar();
    sensor.max_range_m = 3.0;
    std::tie(sensor.elevation_lo_rad, sensor.elevation_hi_rad) = band;
    const ViewpointSampler sampler = scene.sampler(sensor);
    for (const auto& [id, cluster] : scene.finder->clusters()) {
      std::set<std::size_t> asked;
      ViewpointPlaces places;
      places.reachable = [&](const VoxelIndex& v) {
        asked.insert(scene.grid.linear(v));
        return true;
      };
      sampler.search(scene.space(), cluster, places);
      const double reach_m = sampler.config().range_fraction * sensor.max_range_m;
      for (std::size_t i = 0; i < scene.grid.voxel_count(); ++i) {
        Viewpoint view;
        view.voxel = scene.grid.voxel(i);
        view.position_m = scene.grid.center_of(view.voxel);
        if (view.voxel.x % 2 + view.voxel.y % 2 + view.voxel.z % 2 > 0) continue;  // it takes every other one
        if (!scene.space().traversable(view.voxel)) continue;
        if (!cluster.bounds_m.inflated(reach_m).contains(view.position_m)) continue;
        const bool sees = sampler.seen_part(scene.space(), view, cluster) > 0.0;
        const bool searched = asked.contains(i);
        if (!searched) REQUIRE_FALSE(sees);
        left_out += !searched;
        asked_after += searched;
        seeing += sees;
      }
    }
  }
  CHECK(left_out > 100);
  CHECK(seeing > asked_after / 10);
}
