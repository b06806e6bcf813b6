#include "learning/train/training_world.hpp"

#include "core/errors.hpp"
#include "learning/random_network.hpp"
#include "learning/train/evaluation.hpp"
#include "learning/train/teacher.hpp"
#include "learning/train/widest_planner.hpp"

#include <catch2/catch.hpp>

#include <limits>

using namespace stairwell;
using namespace stairwell::train;

namespace {
const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

TEST_CASE("slices have as many obstacles as asked for, and a border", "[worlds]") {
  for (const double wanted : {0.07, 0.2, 0.34}) {
    SliceWorldConfig config;
    config.least_obstacles = config.most_obstacles = wanted;
    Rng rng = make_rng(1, "slices");
    const VoxelScene scene = make_slice_scene(config, rng);
    CHECK(scene.solid_fraction() >= wanted);
    CHECK(scene.solid_fraction() < wanted + 0.07);
    CHECK(scene.solid[scene.grid.linear({0, 50, 10})] == 1);
    Rng again = make_rng(1, "slices"), other = make_rng(2, "slices");
    CHECK(make_slice_scene(config, again).solid == scene.solid);
    CHECK(make_slice_scene(config, other).solid != scene.solid);
  }
}

TEST_CASE("storeys are joined", "[worlds]") {
  StoreyWorldConfig config;
  config.least_storeys = config.most_storeys = 3;
  config.resolution_m = 0.2;
  int joined = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Rng rng = make_rng(seed, "storeys");
    const TrainingWorld world(make_storey_scene(config, rng), Robot{0.25, 0.0});
    const auto space = world.space();
    const auto low = random_place(space, 1.0, rng);
    REQUIRE(low);
    const planning3d::SegmentCheck check(space, {}, *low);
    planning3d::ArrivalField field(planning3d::ArrivalField::Config{});
    field.compute(space, check, *low, kNowhere);
    const double top = space.grid().box().max_m.z();
    for (int i = 0; i < 20; ++i) {
      const auto high = random_place(space, top - 1.2, rng);
      if (high && field.value_m(*high) < 1e3F) {
        ++joined;
        break;
      }
    }
  }
  CHECK(joined >= 4);
}

TEST_CASE("a sensor sees up to walls, not beyond", "[worlds]") {
  VoxelScene scene(Aabb{{0, 0, 0}, {6, 4, 2}}, 0.1);
  scene.fill(Aabb{{3.0, 0, 0}, {3.2, 4, 2}}, true);
  const auto seen = seen_from(scene, {{1.0, 2.0, 1.0}}, 5.0);
  CHECK(seen[scene.grid.linear({20, 20, 10})] == 1);
  CHECK(seen[scene.grid.linear({30, 20, 10})] == 1);
  CHECK(seen[scene.grid.linear({33, 20, 10})] == 0);
  CHECK(seen[scene.grid.linear({45, 20, 10})] == 0);
  const TrainingWorld world(scene, Robot{0.2, 0.0}, &seen);
  CHECK(world.map().at(VoxelIndex{30, 20, 10}) == Occupancy::kOccupied);
  CHECK(world.map().at(VoxelIndex{45, 20, 10}) == Occupancy::kUnknown);
}

TEST_CASE("the teacher keeps its distance and goes round", "[teacher]") {
  VoxelScene scene(Aabb{{0, 0, 0}, {8, 8, 2}}, 0.1);
  scene.fill(Aabb{{3.8, 0, 0}, {4.2, 6.0, 2}}, true);
  const TrainingWorld world(scene, Robot{0.25, 0.0});
  const auto space = world.space();
  const planning3d::SegmentCheck check(space, {}, kNowhere);
  for (const bool plane : {true, false}) {
    Teacher teacher({.plane = plane});
    teacher.begin(space, check, {6.05, 4.05, 1.05});
    Eigen::Vector3d direction;
    REQUIRE(teacher.direction({2.05, 4.05, 1.05}, direction));
    CHECK(direction.norm() == Approx(1.0));
    CHECK(direction.y() > 0.4);
    REQUIRE(teacher.direction({3.45, 5.0, 1.05}, direction));  // 0.1 m off the wall's margin: along it and away
    CHECK(direction.x() < 0.0);
    CHECK(direction.y() > 0.5);
    CHECK_FALSE(teacher.direction({4.0, 3.0, 1.05}, direction));
  }
}

TEST_CASE("the widest way takes the wider gap, and the shortest way through it", "[evaluation]") {
  VoxelScene scene(Aabb{{0, 0, 0}, {8, 8, 2}}, 0.1);
  scene.fill(Aabb{{3.9, 0, 0}, {4.1, 8, 2}}, true);
  scene.fill(Aabb{{3.9, 2.0, 0}, {4.1, 2.8, 2}}, false);  // 0.8 m wide, straight ahead
  scene.fill(Aabb{{3.9, 6.0, 0}, {4.1, 7.1, 2}}, false);  // 1.1 m
  const TrainingWorld world(scene, Robot{0.25, 0.0});
  mapping::DistanceField solid(scene.grid, 2.0, mapping::Obstacles::kOccupied);
  solid.update(world.map());
  planning3d::PlanRequest request;
  request.start_m = {2.05, 2.45, 1.05};
  request.goal_m = {6.05, 2.45, 1.05};
  for (const bool plane : {true, false}) {
    WidestPlanner widest(plane);
    widest.set_solid(solid);
    const planning3d::PlanResult plan = widest.plan(world.space(), request);
    REQUIRE(plan.status == planning3d::PlanStatus::kReached);
    CHECK(plan.path_m.front() == request.start_m);
    CHECK(plan.path_m.back() == request.goal_m);
    int narrowest = 1'000'000;
    double farthest_y = 0.0;
    for (const Eigen::Vector3d& p : plan.path_m) {
      narrowest = std::min<int>(narrowest, solid.squared_cells(scene.grid.index_of(p)));
      farthest_y = std::max(farthest_y, p.y());
    }
    CHECK(narrowest == 36);                           // half of 11 voxels, and the voxel in the middle
    CHECK(farthest_y == Approx(6.55));                // no farther than the gap's middle
    CHECK(plan.length_m < 2.0 * (2.0 + 4.1) + 0.01);  // single moves along two diagonals at the most
  }
  scene.fill(Aabb{{3.9, 0, 0}, {4.1, 8, 2}}, true);
  const TrainingWorld closed(scene, Robot{0.25, 0.0});
  WidestPlanner widest(true);
  widest.set_solid(solid);
  CHECK(widest.plan(closed.space(), request).status == planning3d::PlanStatus::kNoPath);
}

TEST_CASE("an evaluation counts, and is repeated by its seed", "[evaluation]") {
  EvaluationSuite suite;
  suite.name = "test";
  suite.plane = true;
  suite.worlds = 2;
  suite.tasks_per_world = 3;
  nn::Model model = testing::random_agent(planning3d::AgentInput::slice());
  model.parameters[model.parameters.size() - 2] = -50.0F;  // the bias of x: away from where it should go
  const EvaluationResult one = evaluate(suite, model), two = evaluate(suite, model);
  CHECK(one.raw.episodes == 6);
  CHECK(one.raw.success < 0.5);
  CHECK(one.net.success == 1.0);
  CHECK(one.astar.success == 1.0);
  CHECK(one.strict.success <= one.raw.success);
  CHECK(one.teacher.success == 1.0);
  CHECK(one.way.success == 1.0);
  CHECK(one.astar.length_over_optimum > 0.999);
  CHECK(one.astar.length_over_optimum < 1.2);
  CHECK(one.astar.length_over_optimum == two.astar.length_over_optimum);
  CHECK(one.astar.min_clearance_m > 0.2);
  CHECK(one.widest.episodes == 0);
  EvaluationOptions options;
  options.widest = true;
  const EvaluationResult measured = evaluate(suite, model, options);
  CHECK(measured.widest.success == 1.0);
  CHECK(measured.widest.min_clearance_m > one.teacher.min_clearance_m - 0.02);
  suite.plane = false;
  CHECK_THROWS_WITH(evaluate(suite, model), Catch::Contains("another agent"));
  suite.worlds = 0;
  CHECK_THROWS_WITH(evaluate(suite, model), Catch::Contains("worlds"));
}
