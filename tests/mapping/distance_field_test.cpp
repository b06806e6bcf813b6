#include "mapping/distance_field.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "mapping/worker_pool.hpp"
#include "scribble.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

GridSpec random_grid(Rng& rng, int max_cells) {
  const double resolution_m = 0.1;
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min_m[axis] = resolution_m * rng.uniform_int(-30, 20);
    box.max_m[axis] = box.min_m[axis] + resolution_m * rng.uniform_int(1, max_cells);
  }
  return {box, resolution_m};
}

bool is_obstacle(const OccupancyMap& map, Obstacles obstacles, const VoxelIndex& v) {
  return obstacles == Obstacles::kBlocked ? map.blocked(v) : map.at(v) == Occupancy::kOccupied;
}

/// By looking at every voxel in reach, those outside the grid included.
int squared_by_search(const OccupancyMap& map, Obstacles obstacles, const VoxelIndex& v, int truncation) {
  int nearest = truncation * truncation;
  for (int dz = -truncation; dz <= truncation; ++dz) {
    for (int dy = -truncation; dy <= truncation; ++dy) {
      for (int dx = -truncation; dx <= truncation; ++dx) {
        const int squared = dx * dx + dy * dy + dz * dz;
        if (squared < nearest && is_obstacle(map, obstacles, v + VoxelIndex{dx, dy, dz})) {
          nearest = squared;
        }
      }
    }
  }
  return nearest;
}

}  // namespace

TEST_CASE("distance field equals a search through all voxels", "[distance]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  Rng rng = make_rng(3, "edt-search");
  for (int round = 0; round < 12; ++round) {
    OccupancyMap map(random_grid(rng, 22));
    DistanceField field(map.grid(), 0.1 * rng.uniform_int(1, 7), obstacles);
    for (int change = 0; change < 3; ++change) {
      scribble(rng, map, 8);
      field.update(map);
      for (std::size_t i = 0; i < map.grid().voxel_count(); i += 3) {
        const VoxelIndex v = map.grid().voxel(i);
        REQUIRE(field.squared_cells(v) == squared_by_search(map, obstacles, v, field.truncation_cells()));
      }
    }
  }
}

TEST_CASE("distance field kept up to date equals a fresh one", "[distance]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  Rng rng = make_rng(4, "edt-increments");
  for (int round = 0; round < 4; ++round) {
    OccupancyMap map(random_grid(rng, 90));
    DistanceField kept(map.grid(), 1.0, obstacles);
    for (int change = 0; change < 12; ++change) {
      scribble(rng, map, change % 3);
      if (change == 5) {
        map.assume_free(map.grid().box().center_m(), 0.7);
      }
      if (change == 8) {
        for (int i = 0; i < 50; ++i) {
          map.set_log_odds(random_voxel(rng, map.grid()), std::nanf(""));
        }
      }
      kept.update(map);
      DistanceField fresh(map.grid(), 1.0, obstacles);
      fresh.update(map);
      REQUIRE(kept.data() == fresh.data());
    }
  }
}

TEST_CASE("distance field shared by threads is the same, changes included", "[distance]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  Rng rng = make_rng(7, "edt-threads");
  WorkerPool pool(3);
  const auto changed_since = [](const DistanceField& field, std::uint64_t revision) {
    std::vector<std::size_t> blocks;
    field.for_each_block_changed_since(revision,
                                       [&](const VoxelBox& block) { blocks.push_back(field.grid().linear(block.lo)); });
    return blocks;
  };
  for (int round = 0; round < 4; ++round) {
    OccupancyMap map(random_grid(rng, 90));
    DistanceField one(map.grid(), 0.4, obstacles);
    DistanceField shared(map.grid(), 0.4, obstacles);
    for (int change = 0; change < 12; ++change) {
      for (int i = 0; i < 6; ++i) map.update(random_voxel(rng, map.grid()), i % 2 == 0);  // boxes far apart, some not
      if (change % 4 == 0) scribble(rng, map, 2);
      const std::uint64_t before = one.revision();
      one.update(map);
      shared.read_changes(map);
      shared.recompute_changed(&pool);
      REQUIRE(shared.data() == one.data());
      REQUIRE(shared.revision() == one.revision());
      REQUIRE(changed_since(shared, before) == changed_since(one, before));
    }
  }
}

TEST_CASE("distance field's revision counts real changes only", "[distance]") {
  OccupancyMap map(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(2.0)}, 0.1));
  DistanceField field(map.grid(), 0.5, Obstacles::kOccupied);
  field.update(map);
  const std::uint64_t first = field.revision();
  map.update({3, 3, 3}, false);  // free: no obstacle came or went
  field.update(map);
  CHECK(field.revision() == first);
  map.update({4, 4, 4}, true);
  field.update(map);
  CHECK(field.revision() == first + 1);
  CHECK(field.distance_m({4, 4, 6}) == Approx(0.2));
}

TEST_CASE("distance field names the blocks whose distances changed, and no others", "[distance]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  Rng rng = make_rng(5, "edt-changes");
  for (int round = 0; round < 6; ++round) {
    OccupancyMap map(random_grid(rng, 90));
    DistanceField field(map.grid(), 0.6, obstacles);
    std::vector<std::pair<std::uint64_t, std::vector<std::uint16_t>>> history{{0, field.data()}};
    for (int change = 0; change < 6; ++change) {
      scribble(rng, map, change % 3);
      field.update(map);
      const auto& [since, before] = history[static_cast<std::size_t>(rng.uniform_int(0, change))];
      std::vector<bool> visited(field.data().size(), false);
      field.for_each_block_changed_since(since, [&](const VoxelBox& block) {
        for (int z = block.lo.z; z <= block.hi.z; ++z)
          for (int y = block.lo.y; y <= block.hi.y; ++y)
            for (int x = block.lo.x; x <= block.hi.x; ++x) visited[map.grid().linear({x, y, z})] = true;
      });
      for (std::size_t i = 0; i < visited.size(); ++i)
        if (before[i] != field.data()[i]) REQUIRE(visited[i]);
      history.emplace_back(field.revision(), field.data());
    }
    int named = 0;
    field.for_each_block_changed_since(field.revision(), [&](const VoxelBox&) { ++named; });
    CHECK(named == 0);
    map.update({0, 0, 0}, true);  // far from most blocks
    map.update({0, 0, 0}, true);
    const std::uint64_t last = field.revision();
    field.update(map);
    field.for_each_block_changed_since(last, [&](const VoxelBox& block) {
      CHECK(std::max({block.lo.x, block.lo.y, block.lo.z}) <= field.truncation_cells());
    });
  }
}

TEST_CASE("distance field refuses truncations it cannot hold", "[distance]") {
  const GridSpec grid({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 0.1);
  CHECK_THROWS_AS(DistanceField(grid, 0.0, Obstacles::kOccupied), InputError);
  CHECK_THROWS_AS(DistanceField(grid, std::nan(""), Obstacles::kOccupied), InputError);
  CHECK_THROWS_AS(DistanceField(grid, 13.0, Obstacles::kOccupied), InputError);
  CHECK(DistanceField(grid, 12.7, Obstacles::kOccupied).truncation_cells() == 127);
}

TEST_CASE("clearance in cells keeps a sphere off the obstacle voxel", "[distance]") {
  CHECK(min_squared_cells_for(0.0, 0.1) == 1);
  CHECK(min_squared_cells_for(0.05, 0.1) == 1);  // touches exactly: allowed
  Rng rng = make_rng(6, "clearance");
  for (int round = 0; round < 60; ++round) {
    const double resolution_m = rng.uniform(0.05, 0.3);
    const double radius_m = rng.uniform(0.0, 6.0 * resolution_m);
    const int needed = min_squared_cells_for(radius_m, resolution_m);
    int largest_hit = 0;
    for (int x = -8; x <= 8; ++x) {
      for (int y = -8; y <= 8; ++y) {
        for (int z = -8; z <= 8; ++z) {
          const Eigen::Vector3d lo = resolution_m * (Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(0.5));
          const Eigen::Vector3d hi = lo + Eigen::Vector3d::Constant(resolution_m);
          const Eigen::Vector3d nearest = Eigen::Vector3d::Zero().cwiseMax(lo).cwiseMin(hi);
          if (nearest.norm() < radius_m - 1e-9) {
            largest_hit = std::max(largest_hit, x * x + y * y + z * z);
          }
        }
      }
    }
    REQUIRE(needed == largest_hit + 1);
  }
}
