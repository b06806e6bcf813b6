#include "coverage3d/frontier_finder.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "mapping/worker_pool.hpp"

#include <catch2/catch.hpp>

#include <set>
#include <tuple>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

using Key = std::tuple<int, int, int>;
Key key_of(const VoxelIndex& v) { return {v.x, v.y, v.z}; }

std::set<Key> full_search(const mapping::OccupancyMap& map, const FrontierFinder& finder) {
  std::set<Key> found;
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    const VoxelIndex v = map.grid().voxel(i);
    if (is_frontier(map, finder.box(), finder.config(), v)) found.insert(key_of(v));
  }
  return found;
}

/// The clusters share out exactly the frontier voxels.
std::set<Key> clustered(const FrontierFinder& finder) {
  std::set<Key> found;
  std::size_t cells = 0;
  for (const auto& [id, cluster] : finder.clusters()) {
    cells += cluster.cells.size();
    for (const VoxelIndex& v : cluster.cells) {
      found.insert(key_of(v));
      REQUIRE(finder.contains(v));
    }
    REQUIRE(cluster.id == id);
  }
  REQUIRE(cells == found.size());
  REQUIRE(finder.voxel_count() == cells);
  return found;
}

void random_change(Rng& rng, mapping::OccupancyMap& map) {
  const auto& size = map.grid().size();
  const VoxelIndex lo{rng.uniform_int(0, size[0] - 1), rng.uniform_int(0, size[1] - 1),
                      rng.uniform_int(0, size[2] - 1)};
  const VoxelIndex extent{rng.uniform_int(1, 12), rng.uniform_int(1, 12), rng.uniform_int(1, 6)};
  const bool occupied = rng.uniform() < 0.2;
  for (int z = 0; z < extent.z; ++z)
    for (int y = 0; y < extent.y; ++y)
      for (int x = 0; x < extent.x; ++x)
        if (rng.uniform() < 0.97) map.update(lo + VoxelIndex{x, y, z}, occupied);
}

}  // namespace

TEST_CASE("frontiers kept up to date are those of a full search") {
  Rng rng = make_rng(5, "frontiers");
  for (int world = 0; world < 6; ++world) {
    const GridSpec grid({{0.0, 0.0, 0.0}, {5.0, 4.3, 2.7}}, 0.1);
    mapping::OccupancyMap map(grid);
    FrontierConfig config;
    config.box = {{0.25, -1.0, 0.2}, {4.4, 3.9, 9.0}};
    config.min_unknown_neighbours = world % 3 == 0 ? 0 : 3;
    config.planar = world % 2 == 1;
    FrontierFinder finder(grid, config);
    for (int round = 0; round < 40; ++round) {
      for (int i = rng.uniform_int(0, 4); i > 0; --i) random_change(rng, map);
      finder.update(map);
      const std::set<Key> expected = full_search(map, finder);
      const bool same = clustered(finder) == expected;
      REQUIRE(same);
    }
    REQUIRE(finder.voxel_count() > 100);
  }
}

TEST_CASE("clusters are the same with several threads, ids included") {
  Rng rng = make_rng(6, "frontiers of threads");
  const GridSpec grid({{0.0, 0.0, 0.0}, {9.0, 7.0, 2.7}}, 0.1);
  mapping::OccupancyMap map(grid);
  mapping::WorkerPool pool(3);
  FrontierConfig config;
  config.box = {{0.25, 0.0, 0.2}, {8.4, 6.9, 2.7}};
  FrontierFinder alone(grid, config);
  FrontierFinder shared(grid, config);
  for (int round = 0; round < 40; ++round) {
    for (int i = 0; i < 5; ++i) random_change(rng, map);
    alone.update(map);
    shared.update(map, &pool);
    REQUIRE(shared.clusters().size() == alone.clusters().size());
    auto expected = alone.clusters().begin();
    for (const auto& [id, cluster] : shared.clusters()) {
      REQUIRE(id == expected->first);
      REQUIRE(cluster.cells == expected->second.cells);
      REQUIRE(cluster.pocket_m3 == expected->second.pocket_m3);
      ++expected;
    }
  }
  CHECK(alone.clusters().size() > 20);
}

TEST_CASE("clusters are no longer than the split size") {
  const GridSpec grid({{0.0, 0.0, 0.0}, {8.0, 8.0, 2.0}}, 0.1);
  mapping::OccupancyMap map(grid);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 80; ++x) map.update(VoxelIndex{x, y, 10}, false);
  FrontierConfig config;
  config.box = grid.box();
  FrontierFinder finder(grid, config);
  finder.update(map);
  REQUIRE(finder.voxel_count() == 6400);
  REQUIRE(finder.clusters().size() >= 16);
  for (const auto& [id, cluster] : finder.clusters()) {
    CHECK(cluster.bounds_m.size_m().maxCoeff() <= 2.0 * 1.42 + 0.2);
    CHECK(cluster.bounds_m.contains(cluster.center_m));
  }
}

TEST_CASE("pockets behind clusters are measured up to a limit") {
  const GridSpec grid({{0.0, 0.0, 0.0}, {4.0, 4.0, 2.0}}, 0.1);
  FrontierConfig config;
  config.box = grid.box();
  const auto clusters_of = [&](const auto& known, const auto& occupied) {
    mapping::OccupancyMap map(grid);
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      const VoxelIndex v = grid.voxel(i);
      if (known(v)) map.update(v, occupied(v));
    }
    FrontierFinder finder(grid, config);
    finder.update(map);
    return finder;
  };
  const auto none = [](const VoxelIndex&) { return false; };
  SECTION("half the box is deep") {
    const auto finder = clusters_of([](const VoxelIndex& v) { return v.x < 20; }, none);
    REQUIRE(!finder.clusters().empty());
    for (const auto& [id, cluster] : finder.clusters()) {
      CHECK(cluster.pocket_m3 == Approx(config.deep_m3).margin(0.01));
      CHECK(finder.deep(cluster));
    }
  }
  SECTION("a hole of 8 x 6 x 4 voxels is as large as it is") {
    const auto finder = clusters_of(
        [](const VoxelIndex& v) { return v.x < 10 || v.x >= 18 || v.y < 10 || v.y >= 16 || v.z < 10 || v.z >= 14; },
        none);
    REQUIRE(finder.clusters().size() >= 1);
    for (const auto& [id, cluster] : finder.clusters()) {
      CHECK(cluster.pocket_m3 == Approx(0.192));
      CHECK(!finder.deep(cluster));
    }
  }
  SECTION("what few rays left out is no pocket") {
    const auto finder = clusters_of([](const VoxelIndex& v) { return v.x % 3 != 0 || v.y % 3 != 0; }, none);
    REQUIRE(!finder.clusters().empty());
    for (const auto& [id, cluster] : finder.clusters()) CHECK(cluster.pocket_m3 == 0.0);
  }
  SECTION("a hole of a voxel in a wall does not open what is behind it") {
    const auto wall = [](const VoxelIndex& v) { return v.x == 20 || v.x == 21; };
    const auto finder =
        clusters_of([](const VoxelIndex& v) { return v.x <= 21 && !(v.x >= 20 && v.y == 11 && v.z == 9); }, wall);
    for (const auto& [id, cluster] : finder.clusters()) CHECK(cluster.pocket_m3 == 0.0);
  }
}

TEST_CASE("a known map has no frontiers, nor has an unknown one") {
  const GridSpec grid({{0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}}, 0.1);
  mapping::OccupancyMap map(grid);
  FrontierConfig config;
  config.box = grid.box();
  FrontierFinder finder(grid, config);
  finder.update(map);
  CHECK(finder.clusters().empty());
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) map.update(grid.voxel(i), false);
  finder.update(map);
  CHECK(finder.clusters().empty());
}

TEST_CASE("unusable frontier settings are refused") {
  const GridSpec grid({{0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}}, 0.1);
  FrontierConfig config;
  CHECK_THROWS_AS(FrontierFinder(grid, config), InputError);
  config.box = {{5.0, 5.0, 5.0}, {6.0, 6.0, 6.0}};
  CHECK_THROWS_AS(FrontierFinder(grid, config), InputError);
  config.box = grid.box();
  config.split_size_m = 0.0;
  CHECK_THROWS_AS(FrontierFinder(grid, config), InputError);
}
