#include "mapping/occupancy_map.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "octomap_reference.hpp"
#include "scribble.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <set>
#include <tuple>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

constexpr double kResolution_m = 0.1;

GridSpec grid_between(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
  return {{min_m, max_m}, kResolution_m};
}

octomap::OcTreeKey key_of(const GridSpec& grid, const VoxelIndex& v) {
  const auto& first = grid.first_cell();
  return {static_cast<octomap::key_type>(first[0] + v.x + 32768),
          static_cast<octomap::key_type>(first[1] + v.y + 32768),
          static_cast<octomap::key_type>(first[2] + v.z + 32768)};
}

/// Every voxel of the box, as a flight through it leaves many of them: several times in the same direction.
template <typename Update>
void fill(Rng& rng, const GridSpec& grid, const Update& update) {
  const VoxelIndex at = random_voxel(rng, grid);
  const int reach = rng.uniform_int(0, 12);
  const bool occupied = rng.uniform_int(0, 3) == 0;
  const int times = rng.uniform_int(1, 8);
  for (int z = std::max(0, at.z - reach); z <= std::min(grid.size()[2] - 1, at.z + reach); ++z) {
    for (int y = std::max(0, at.y - reach); y <= std::min(grid.size()[1] - 1, at.y + reach); ++y) {
      for (int x = std::max(0, at.x - reach); x <= std::min(grid.size()[0] - 1, at.x + reach); ++x) {
        for (int i = 0; i < times; ++i) {
          update(VoxelIndex{x, y, z}, occupied);
        }
      }
    }
  }
}

}  // namespace

TEST_CASE("single updates leave OctoMap's tree, pruned and clamped alike", "[map]") {
  const OccupancyParams params =
      GENERATE(OccupancyParams{}, OccupancyParams{0.9, 0.2, 0.3, 0.8, 0.7}, OccupancyParams{0.5, 0.5, 0.1, 0.9, 0.5});
  Rng rng = make_rng(11, "updates");
  const GridSpec grid = grid_between({-1.3, -0.7, -2.1}, {2.0, 1.9, 1.1});
  OccupancyMap map(grid, params);
  octomap::OcTree tree(kResolution_m);
  set_params(tree, params);
  for (int round = 0; round < 40; ++round) {
    fill(rng, grid, [&](const VoxelIndex& v, bool occupied) {
      map.update(v, occupied);
      tree.updateNode(key_of(grid, v), occupied);
    });
    REQUIRE((ot_bytes(map.octree()) == ot_bytes(tree)));
  }
}

TEST_CASE("look-ups agree with the tree and counts with the look-ups", "[map]") {
  Rng rng = make_rng(12, "look-ups");
  const GridSpec grid = grid_between({-1.0, -1.0, -1.0}, {1.0, 1.5, 0.7});
  OccupancyMap map(grid);
  for (int round = 0; round < 10; ++round) {
    fill(rng, grid, [&](const VoxelIndex& v, bool occupied) { map.update(v, occupied); });
    const octomap::OcTree& tree = map.octree();
    std::size_t known = 0, occupied = 0;
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      const VoxelIndex v = grid.voxel(i);
      const octomap::OcTreeNode* node = tree.search(key_of(grid, v));
      REQUIRE((node == nullptr) == (map.at(v) == Occupancy::kUnknown));
      if (node != nullptr) {
        ++known;
        occupied += tree.isNodeOccupied(node) ? 1U : 0U;
        REQUIRE(node->getLogOdds() == map.log_odds(v));
        REQUIRE(tree.isNodeOccupied(node) == (map.at(v) == Occupancy::kOccupied));
      }
      REQUIRE(map.blocked(v) == (map.at(v) != Occupancy::kFree || map.ever_hit(v)));
    }
    CHECK(map.known_voxels() == known);
    CHECK(map.occupied_voxels() == occupied);
    CHECK(map.known_volume_m3() == Approx(static_cast<double>(known) * 1e-3));
  }
}

TEST_CASE("outside the grid nothing is known, stored or open", "[map]") {
  OccupancyMap map(grid_between(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()));
  for (const VoxelIndex v : {VoxelIndex{-1, 0, 0}, VoxelIndex{0, 10, 0}, VoxelIndex{0, 0, 1000000}}) {
    map.update(v, false);
    map.set_log_odds(v, 1.0F);
    CHECK(map.at(v) == Occupancy::kUnknown);
    CHECK(std::isnan(map.log_odds(v)));
    CHECK(map.blocked(v));
  }
  BlockMask everything;
  everything.miss.fill(~std::uint64_t{0});
  for (int z = 0; z < map.block_count()[2]; ++z) {
    for (int y = 0; y < map.block_count()[1]; ++y) {
      for (int x = 0; x < map.block_count()[0]; ++x) {
        map.apply({x, y, z}, everything);
      }
    }
  }
  CHECK(map.known_voxels() == map.grid().voxel_count());
}

TEST_CASE("hits win over misses within a block mask", "[map]") {
  OccupancyMap map(grid_between(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()));
  BlockMask mask;
  mask.hit[2] = mask.miss[2] = 1ULL << (8 * 3 + 4);
  const OccupancyMap::ScanEffect effect = map.apply({0, 0, 0}, mask);
  CHECK(effect.updated == 1);
  CHECK(effect.changed == 1);
  CHECK(map.at(VoxelIndex{4, 3, 2}) == Occupancy::kOccupied);
}

TEST_CASE("a voxel that was ever hit stays closed to flight, however many rays pass it", "[map]") {
  OccupancyMap map(grid_between(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(1.0)));
  const VoxelIndex v{4, 5, 6};
  map.update(v, false);
  CHECK_FALSE(map.ever_hit(v));
  CHECK_FALSE(map.blocked(v));
  const std::uint64_t before = map.revision();
  for (int i = 0; i < 10; ++i) map.update(v, false);
  map.update(v, true);  // the class does not change, but flight must hear of it
  CHECK(map.at(v) == Occupancy::kFree);
  CHECK(map.ever_hit(v));
  CHECK(map.blocked(v));
  CHECK(map.revision() > before);
  map.set_log_odds(v, std::nanf(""));
  CHECK_FALSE(map.ever_hit(v));
}

TEST_CASE("assumed-free space is open to flight but not part of the map", "[map]") {
  OccupancyMap map(grid_between(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(2.0)));
  map.update({10, 10, 12}, true);
  const std::uint64_t before = map.revision();
  map.assume_free({1.05, 1.05, 1.05}, 0.35);
  CHECK(map.revision() > before);
  CHECK_FALSE(map.blocked({10, 10, 10}));
  CHECK_FALSE(map.blocked({13, 10, 10}));
  CHECK(map.blocked({14, 10, 10}));
  CHECK(map.blocked({10, 10, 12}));  // occupied stays occupied
  CHECK(map.at(VoxelIndex{10, 10, 10}) == Occupancy::kUnknown);
  CHECK(map.known_voxels() == 1);
  map.update({10, 10, 10}, true);
  CHECK(map.blocked({10, 10, 10}));
  map.set_log_odds({10, 10, 10}, std::nanf(""));
  CHECK_FALSE(map.blocked({10, 10, 10}));  // unknown again, and assumed free
  map.assume_free({std::nan(""), 1.0, 1.0}, 0.3);
  map.assume_free({50.0, 50.0, 50.0}, 0.3);
  CHECK(map.blocked({0, 0, 0}));
  map.assume_free({1.0, 1.0, 1.0}, 1e300);
  CHECK_FALSE(map.blocked({0, 0, 0}));
  CHECK_FALSE(map.blocked({19, 19, 19}));
}

TEST_CASE("changed blocks are exactly those with a changed class", "[map]") {
  Rng rng = make_rng(13, "changes");
  const GridSpec grid = grid_between({-1.1, -2.3, -0.5}, {3.3, 1.7, 2.2});
  OccupancyMap map(grid);
  std::uint64_t seen = 0;
  for (int round = 0; round < 200; ++round) {
    std::set<std::tuple<int, int, int>> expected;
    for (int i = 0; i < rng.uniform_int(0, 30); ++i) {
      const VoxelIndex v = random_voxel(rng, grid);
      const Occupancy before = map.at(v);
      map.update(v, rng.uniform_int(0, 1) == 0);
      if (map.at(v) != before) {
        const auto& offset = map.block_offset();
        expected.insert({(v.x + offset[0]) / 8, (v.y + offset[1]) / 8, (v.z + offset[2]) / 8});
      }
    }
    std::set<std::tuple<int, int, int>> found;
    map.for_each_block_changed_since(seen, [&](const VoxelBox& box) {
      const auto& offset = map.block_offset();
      REQUIRE(grid.contains(box.lo));
      REQUIRE(grid.contains(box.hi));
      REQUIRE(
          found.insert({(box.lo.x + offset[0]) / 8, (box.lo.y + offset[1]) / 8, (box.lo.z + offset[2]) / 8}).second);
    });
    REQUIRE(found == expected);
    seen = map.revision();
  }
}

TEST_CASE("forgetting voxels leaves the tree that never knew them", "[map]") {
  Rng rng = make_rng(14, "forget");
  const GridSpec grid = grid_between(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(2.4));
  OccupancyMap map(grid);
  fill(rng, grid, [&](const VoxelIndex& v, bool occupied) { map.update(v, occupied); });
  map.octree();
  OccupancyMap other(grid);
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    if (rng.uniform_int(0, 4) == 0) {
      map.set_log_odds(v, std::nanf(""));
    } else if (map.at(v) != Occupancy::kUnknown) {
      other.set_log_odds(v, map.log_odds(v));
    }
  }
  CHECK(map.known_voxels() == other.known_voxels());
  CHECK((ot_bytes(map.octree()) == ot_bytes(other.octree())));
}

TEST_CASE("unusable maps are refused", "[map]") {
  const GridSpec grid = grid_between(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  CHECK(OccupancyParams{}.problems().empty());
  CHECK_THROWS_AS(OccupancyMap(grid, OccupancyParams{1.5, 0.4, 0.1, 0.9, 0.5}), InputError);
  CHECK_THROWS_AS(OccupancyMap(grid, OccupancyParams{0.3, 0.4, 0.1, 0.9, 0.5}), InputError);
  CHECK_THROWS_AS(OccupancyMap(grid, OccupancyParams{0.7, 0.6, 0.1, 0.9, 0.5}), InputError);
  CHECK_THROWS_AS(OccupancyMap(grid, OccupancyParams{0.7, 0.4, 0.9, 0.1, 0.5}), InputError);
  CHECK_THROWS_AS(OccupancyMap(grid, OccupancyParams{0.7, std::nan(""), 0.1, 0.9, 0.5}), InputError);
  CHECK_THROWS_AS(OccupancyMap(GridSpec{}), InputError);
  const GridSpec huge({Eigen::Vector3d::Constant(-3000.0), Eigen::Vector3d::Constant(3000.0)}, kResolution_m);
  CHECK_THROWS_AS(OccupancyMap(huge), InputError);
}

TEST_CASE("pruning reaches beyond a block and back", "[map]") {
  const GridSpec grid = grid_between(Eigen::Vector3d::Constant(-0.4), Eigen::Vector3d::Constant(2.0));
  OccupancyMap map(grid);
  octomap::OcTree tree(kResolution_m);
  const auto update = [&](const VoxelIndex& v, bool occupied) {
    map.update(v, occupied);
    tree.updateNode(key_of(grid, v), occupied);
  };
  for (int times = 0; times < 6; ++times) {  // 16 voxels a side from the origin on: two levels above a block's voxels
    for (int i = 0; i < 16 * 16 * 16; ++i) {
      update({4 + i % 16, 4 + i / 16 % 16, 4 + i / 256}, false);
    }
    REQUIRE((ot_bytes(map.octree()) == ot_bytes(tree)));
  }
  const std::size_t pruned = map.octree().size();
  CHECK(pruned < 20);
  update({10, 10, 10}, true);
  CHECK((ot_bytes(map.octree()) == ot_bytes(tree)));
  CHECK(map.octree().size() > pruned);
  update({10, 10, 10}, false);
  update({10, 10, 10}, false);
  update({10, 10, 10}, false);
  CHECK((ot_bytes(map.octree()) == ot_bytes(tree)));
  CHECK(map.octree().size() == pruned);
}
