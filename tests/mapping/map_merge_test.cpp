#include "mapping/map_merge.hpp"

#include "core/rng.hpp"
#include "mapping/octomap_io.hpp"

#include <octomap/OcTree.h>

#include <catch2/catch.hpp>

#include <cmath>
#include <sstream>
#include <tuple>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

const GridSpec kGrid({{0.03, -1.0, 0.0}, {2.6, 1.7, 1.9}}, 0.1);

/// Hits and misses in a random box.
void scribble_somewhere(Rng& rng, OccupancyMap& map) {
  const auto& size = map.grid().size();
  const VoxelIndex lo{rng.uniform_int(0, size[0] - 1), rng.uniform_int(0, size[1] - 1),
                      rng.uniform_int(0, size[2] - 1)};
  for (int z = 0; z < 5; ++z)
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 7; ++x) map.update(lo + VoxelIndex{x, y, z}, rng.uniform() < 0.3);
}

using Cell = std::tuple<Occupancy, float, bool, bool>;
std::vector<Cell> cells_of(const OccupancyMap& map) {
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    const VoxelIndex v = map.grid().voxel(i);
    const float value = map.log_odds(v);
    cells.emplace_back(map.at(v), std::isnan(value) ? 99.0F : value, map.ever_hit(v), map.blocked(v));
  }
  return cells;
}

OccupancyMap random_map(Rng& rng, int boxes) {
  OccupancyMap map(kGrid);
  map.assume_free({1.0, 0.0, 1.0}, 0.3);
  for (int i = 0; i < boxes; ++i) scribble_somewhere(rng, map);
  return map;
}

OccupancyMap merged(const OccupancyMap& a, const OccupancyMap& b) {
  OccupancyMap sum = a.clone();
  merge_changes(b, 0, sum);
  return sum;
}

}  // namespace

TEST_CASE("merging maps does not depend on order, nesting or repetition") {
  Rng rng = make_rng(3, "merge");
  for (int round = 0; round < 10; ++round) {
    const OccupancyMap a = random_map(rng, 6);
    const OccupancyMap b = random_map(rng, 9);
    const OccupancyMap c = random_map(rng, 4);
    const auto ab = cells_of(merged(a, b));
    CHECK(ab == cells_of(merged(b, a)));
    CHECK(cells_of(merged(merged(a, b), c)) == cells_of(merged(a, merged(b, c))));
    CHECK(cells_of(merged(merged(a, b), b)) == ab);
    CHECK(cells_of(merged(a, a)) == cells_of(a));
    const OccupancyMap both = merged(a, b);
    std::size_t known = 0;
    for (std::size_t i = 0; i < kGrid.voxel_count(); ++i) {
      const VoxelIndex v = kGrid.voxel(i);
      const bool either = a.at(v) != Occupancy::kUnknown || b.at(v) != Occupancy::kUnknown;
      REQUIRE((both.at(v) != Occupancy::kUnknown) == either);
      REQUIRE(both.ever_hit(v) == (a.ever_hit(v) || b.ever_hit(v)));
      known += either ? 1 : 0;
    }
    CHECK(both.known_voxels() == known);
  }
}

TEST_CASE("telling only what changed since the last exchange leaves nothing unknown that telling all would not") {
  Rng rng = make_rng(4, "deltas");
  OccupancyMap teller(kGrid);
  OccupancyMap listener(kGrid);
  OccupancyMap told_all(kGrid);
  std::uint64_t told = 0;
  std::size_t sent = 0;
  for (int round = 0; round < 20; ++round) {
    scribble_somewhere(rng, teller);
    sent += merge_changes(teller, told, listener).sent;
    told = teller.revision();
    merge_changes(teller, 0, told_all);
    for (std::size_t i = 0; i < kGrid.voxel_count(); ++i) {
      const VoxelIndex v = kGrid.voxel(i);
      REQUIRE((listener.at(v) == Occupancy::kUnknown) == (told_all.at(v) == Occupancy::kUnknown));
    }
  }
  CHECK(merge_changes(teller, told, listener).sent == 0);
  CHECK(sent < 20 * teller.known_voxels());
}

TEST_CASE("a clone is the same map, goes its own way from there, and shares revisions") {
  Rng rng = make_rng(5, "clone");
  OccupancyMap map = random_map(rng, 8);
  map.octree();
  OccupancyMap copy = map.clone();
  CHECK(cells_of(copy) == cells_of(map));
  CHECK(copy.revision() == map.revision());
  CHECK(copy.known_voxels() == map.known_voxels());
  CHECK(copy.occupied_voxels() == map.occupied_voxels());
  CHECK(copy.octree() == map.octree());
  const auto before = cells_of(map);
  const std::uint64_t parted = copy.revision();
  scribble_somewhere(rng, copy);
  CHECK(cells_of(map) == before);
  std::size_t blocks = 0;
  copy.for_each_block_changed_since(parted, [&](const VoxelBox&) { ++blocks; });
  CHECK(blocks > 0);
  map.for_each_block_changed_since(parted, [&](const VoxelBox&) { FAIL("the original changed"); });
  merge_changes(copy, parted, map);
  for (std::size_t i = 0; i < kGrid.voxel_count(); ++i) {
    const VoxelIndex v = kGrid.voxel(i);
    REQUIRE((map.at(v) == Occupancy::kUnknown) == (copy.at(v) == Occupancy::kUnknown));
  }
}
