/// The recorder against the map itself: what the records add up to is what the map holds.
#include "apps/replay_recorder.hpp"
#include "apps/byte_codec.hpp"
#include "core/rng.hpp"
#include "coverage3d/frontier_finder.hpp"
#include "replay_state.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <memory>
#include <random>

namespace stairwell::apps {

namespace {

constexpr double kTick_s = 0.1;

explore::FleetConfig small_fleet() {
  explore::FleetConfig fleet;
  fleet.task_box = {{0.0, 0.0, 0.0}, {2.0, 1.6, 1.2}};
  return fleet;
}

mapping::ExpectedOccupancy nothing_there(const VoxelIndex&) { return mapping::ExpectedOccupancy::kFree; }

}  // namespace

TEST_CASE("records add up to the map, whenever a run is broken off and resumed") {
  const auto folder = testing::fresh_folder("recorder");
  const explore::FleetConfig fleet = small_fleet();
  const GridSpec grid(fleet.task_box, fleet.resolution_m);
  mapping::OccupancyMap map(grid, fleet.occupancy);
  Rng rng = make_rng(3, "recorder");
  std::uniform_int_distribution<std::size_t> voxel(0, grid.voxel_count() - 1), uav(0, 2), rare(0, 40);
  auto recorder = std::make_unique<ReplayRecorder>(folder, fleet, grid, 3, 0);
  for (int tick = 1; tick <= 600; ++tick) {
    const double time_s = tick * kTick_s;
    for (int scan = 0; scan < 3; ++scan) {
      for (int i = 0; i < 30; ++i) map.update(grid.voxel(voxel(rng)), rare(rng) % 2 == 0);
      recorder->on_scan(uav(rng), map);
    }
    recorder->record(time_s, kTick_s, map);
    if (rare(rng) != 0) continue;
    const std::uint64_t keep = recorder->flush();
    if (rare(rng) % 2 == 0) {  // what comes after the checkpoint is lost, with the map of then
      recorder->on_trajectory(time_s, 0, Trajectory::hover(time_s, {1.0, 1.0, 1.0}, 0.0));
      recorder->publish(map, nothing_there);
    }
    recorder = std::make_unique<ReplayRecorder>(folder, fleet, grid, 3, keep);
    recorder->resume(map);
  }
  recorder->publish(map, nothing_there);
  const testing::ReplayState state = testing::replayed(folder / "replay.bin");
  CHECK(state.plans == 0);
  CHECK(state.known == map.known_voxels());
  CHECK(state.occupied == testing::occupied_cells(map));
  CHECK(state.false_occupied == state.occupied.size());
  CHECK(state.open_sides == state.occupied.size());
  coverage3d::FrontierConfig config;
  config.box = fleet.task_box;
  coverage3d::FrontierFinder finder(grid, config);
  finder.update(map);
  std::set<std::uint64_t> frontier;
  const CellOrder coarse{{10, 8, 6}};
  for (const auto& [id, cluster] : finder.clusters())
    for (const VoxelIndex& v : cluster.cells) frontier.insert(coarse.cell({v.x / 2, v.y / 2, v.z / 2}));
  CHECK(state.frontier == frontier);
}

}  // namespace stairwell::apps
