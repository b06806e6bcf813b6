#include "planning3d/storey_portals.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "learning/train/training_world.hpp"
#include "planning3d/agent_view.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

/// Three storeys of 2.8 m; two holes in the lower slab, one in the upper.
train::VoxelScene tower() {
  train::VoxelScene scene(Aabb{{0, 0, 0}, {10, 8, 8.4}}, 0.1);
  for (const double z : {2.7, 5.5}) scene.fill(Aabb{{0, 0, z}, {10, 8, z + 0.2}}, true);
  scene.fill(Aabb{{1, 1, 2.7}, {2.2, 2.2, 2.9}}, false);
  scene.fill(Aabb{{7, 5, 2.7}, {9, 7, 2.9}}, false);
  scene.fill(Aabb{{7, 1, 5.5}, {8.4, 2.4, 5.7}}, false);
  scene.fill(Aabb{{4, 4, 1.0}, {6, 6, 1.1}}, true);  // a table is no slab
  return scene;
}

}  // namespace

TEST_CASE("openings between storeys are found, and the nearest chain of them", "[agent]") {
  const train::TrainingWorld world(tower(), Robot{0.25, 0.0});
  const StoreyPortals portals(world.space());
  REQUIRE(portals.slabs().size() == 2);
  REQUIRE(portals.slabs()[0].size() == 2);
  REQUIRE(portals.slabs()[1].size() == 1);
  const Eigen::Vector3d small(1.6, 1.6, 2.8), large(8.0, 6.0, 2.8), upper(7.7, 1.7, 5.6);
  CHECK((portals.slabs()[0][0].center_m - small).norm() < 0.15);
  CHECK((portals.slabs()[0][1].center_m - large).norm() < 0.15);
  CHECK((portals.slabs()[1][0].center_m - upper).norm() < 0.15);
  CHECK(portals.slabs()[0][1].voxels > portals.slabs()[0][0].voxels);

  const Eigen::Vector3d low(2, 2, 1), middle(2, 2, 4), high(2, 6, 7);
  CHECK((portals.towards(low, middle).place_m - small).norm() < 0.5);
  CHECK(portals.towards(low, middle).place_m.z() > 2.8);  // behind it
  CHECK(portals.towards(middle, low).place_m.z() < 2.8);
  // Up to the top the small hole is nearer, but not with what comes after it: 4.7 + 4.3 against 1.9 + 6.7 m.
  const Eigen::Vector3d from(6, 5, 1);
  const auto heading = portals.towards(from, high);
  CHECK((heading.place_m - large).norm() < 0.5);
  const Eigen::Vector3d beyond(0, 0, 0.3);
  CHECK(heading.rest_m == Approx((upper - large).norm() + (high - upper - beyond).norm()).margin(0.3));
  CHECK(portals.towards(low, {6, 6, 1}).place_m == Eigen::Vector3d(6, 6, 1));
  CHECK(portals.towards(low, {6, 6, 1}).rest_m == 0.0);
}

TEST_CASE("what has not been seen is no opening", "[agent]") {
  const train::VoxelScene scene = tower();
  std::vector<std::uint8_t> seen(scene.solid.size(), 1);
  for (int z = 0; z < 55; ++z) {
    for (int y = 40; y < 80; ++y) {
      for (int x = 60; x < 100; ++x) seen[scene.grid.linear({x, y, z})] = 0;
    }
  }
  const train::TrainingWorld world(scene, Robot{0.25, 0.0}, &seen);
  const StoreyPortals portals(world.space());
  REQUIRE(portals.slabs().size() == 2);
  REQUIRE(portals.slabs()[0].size() == 1);
  CHECK(portals.slabs()[0][0].center_m.x() < 3.0);
}

TEST_CASE("an agent of portals is shown the next opening instead of a goal in another storey", "[agent]") {
  const train::TrainingWorld world(tower(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  AgentInput input = AgentInput::volume();
  input.attraction = AgentInput::Attraction::kPortals;
  CHECK(AgentInput::parse(input.text()) == input);
  const Eigen::Vector3d at_m(3.05, 3.05, 1.05);
  const auto goal_seen = [&](const Eigen::Vector3d& goal_m) {
    const SegmentCheck check(space, {}, at_m);
    ArrivalField field(ArrivalField::Config{});
    field.compute(space, check, goal_m, at_m);
    AgentView view(input);
    view.begin(space, {}, field);
    Observation seen;
    view.look(at_m, seen);
    const float* goal = seen.features.data() + 12;
    CHECK(view.way_left_m() >= (goal_m - at_m).norm() - 1e-9);
    return turned({goal[0], goal[1], goal[2]}, seen.yaw_rad);
  };
  const Eigen::Vector3d up = goal_seen({8.05, 1.05, 4.05}), level = goal_seen({8.05, 1.05, 1.05});
  CHECK(up.x() < -0.3);  // to the small hole, behind it
  CHECK(up.y() < -0.3);
  CHECK(level.x() > 0.5);
  AgentInput plane = AgentInput::slice();
  plane.attraction = AgentInput::Attraction::kPortals;
  CHECK_THROWS_AS(AgentView(plane), InputError);
}
