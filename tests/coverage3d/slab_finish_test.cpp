#include "coverage3d/slab_finish.hpp"

#include "toy_world.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::coverage3d;

namespace {

const Aabb kBox{{0.0, 0.0, 0.0}, {12.0, 6.0, 2.0}};

/// A hall with walls of a voxel around it, known where `known` says so.
template <typename Known>
mapping::OccupancyMap hall(const Known& known) {
  mapping::OccupancyMap map(GridSpec(kBox, 0.1));
  const GridSpec& grid = map.grid();
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const bool wall = v.x == 0 || v.y == 0 || v.x == grid.size()[0] - 1 || v.y == grid.size()[1] - 1;
    if (known(v)) map.update(v, wall);
  }
  return map;
}

SlabFinish judged(const mapping::OccupancyMap& map, double lo_m = 1.0, double hi_m = 1.5, bool past_walls = false) {
  FrontierFinder finder(map.grid(), slab_frontiers(kBox, lo_m, hi_m));
  finder.update(map);
  SlabFinish finish(past_walls);
  finish.update(map, finder);
  std::size_t counted = 0;
  for (const auto& [id, cluster] : finder.clusters()) counted += finish.counts(id) ? 1 : 0;
  CHECK((counted == 0) == finish.met());
  return finish;
}

}  // namespace

TEST_CASE("a slab is explored when no frontier in it is left") {
  CHECK(judged(hall([](const VoxelIndex&) { return true; })).met());
  CHECK(judged(hall([](const VoxelIndex&) { return false; })).met());
  const auto half = hall([](const VoxelIndex& v) { return v.x < 60; });
  CHECK_FALSE(judged(half).met());
  // 5.8 m of frontier, cut until all of a piece lies within 3 m of its mean.
  CHECK(judged(half).open_pieces() == 1);
  const auto along = hall([](const VoxelIndex& v) { return v.y < 30; });
  CHECK(judged(along).open_pieces() == 2);
}

TEST_CASE("what is unknown above or below the slab does not count") {
  const auto map = hall([](const VoxelIndex& v) { return v.z >= 10 && v.z < 15; });
  CHECK(judged(map).met());
  const auto below = hall([](const VoxelIndex& v) { return v.z >= 10 || v.x < 60; });
  CHECK(judged(below).met());
  CHECK_FALSE(judged(below, 0.5, 1.5).met());
}

TEST_CASE("stretches of wall that nobody has hit are frontiers, small gaps are not") {
  const auto unseen_wall = [](int from_y, int to_y) {
    return hall([=](const VoxelIndex& v) { return v.x > 0 || v.y < from_y || v.y >= to_y; });
  };
  // Eleven gaps of the wall and a free voxel beside each of their ends: 13 x 5 voxels, of which 7 x 5 are more than two
  // voxels away from what was hit.
  CHECK_FALSE(judged(unseen_wall(20, 31)).met());
  CHECK(judged(unseen_wall(20, 30)).met());
}

TEST_CASE("what hugs a known wall counts only in the stricter rule") {
  const auto striped_wall = [](int every) {
    return hall([=](const VoxelIndex& v) { return v.x > 0 || v.y % every == 0; });
  };
  CHECK(judged(striped_wall(4)).met());
  CHECK_FALSE(judged(striped_wall(4), 1.0, 1.5, true).met());
  CHECK_FALSE(judged(striped_wall(20)).met());
}

TEST_CASE("a frontier that no pose beside it sees is ignored") {
  // A free strip two voxels wide between a wall and unknown space: no pose is clear of the wall.
  const auto map = [](int strip) {
    auto made = hall([&](const VoxelIndex& v) { return v.x < 1 + strip; });
    return made;
  };
  CHECK(judged(map(3)).met());
  CHECK_FALSE(judged(map(20)).met());
}

TEST_CASE("a strategy that explores a slab ends when the rule is met, before all is seen") {
  const toy::World world = toy::office(0.1);
  toy::Scenario scenario{"office", world, {{1.0, 1.0, 1.2}, {1.5, 1.0, 1.2}}, toy::config_for(world, toy::lidar())};
  const auto everything = toy::run(scenario, *make_strategy("frontiers", scenario.config));
  scenario.config.finish = FinishSlab{1.0, 1.5};
  const auto slab = toy::run(scenario, *make_strategy("frontiers", scenario.config));
  CHECK(everything.finished);
  CHECK(slab.finished);
  CHECK(slab.known_part > 0.8);
  CHECK(slab.goals < everything.goals);
}
