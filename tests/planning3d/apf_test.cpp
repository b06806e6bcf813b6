#include "planning3d/apf_planner.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

std::unique_ptr<Planner> apf(Attraction attraction, bool experience) {
  return make_planner("apf", {attraction, experience, {}});
}

/// A wall with arms towards the start, from floor to ceiling; the goal lies behind it.
TestWorld u_trap() {
  TestWorld world({8.0, 8.0, 2.0}, 0.1);
  world.fill({{4.5, 2.0, 0.0}, {4.7, 6.0, 2.0}}, true);
  world.fill({{3.0, 2.0, 0.0}, {4.5, 2.2, 2.0}}, true);
  world.fill({{3.0, 5.8, 0.0}, {4.5, 6.0, 2.0}}, true);
  return world;
}

PlanRequest through_the_trap() {
  PlanRequest request;
  request.start_m = {1.05, 4.05, 1.05};
  request.goal_m = {6.95, 4.05, 1.05};
  return request;
}

void check_answer(const FreeSpace& space, const PlanRequest& request, const PlanResult& result) {
  REQUIRE(result.status == PlanStatus::kReached);
  CHECK((result.path_m.front() - request.start_m).norm() < 1e-12);
  CHECK((result.path_m.back() - request.goal_m).norm() < 1e-12);
  CHECK(checkers::path_problem(space, result.path_m) == "");
  CHECK(SafetyCheck{}.check_path(space, result.path_m).safe());
  if (request.rule.kind == MotionRule::Kind::kSlice) {
    CHECK(checkers::slice_problem(space.grid(), result.path_m, request.rule.layers_m) == "");
  }
}

}  // namespace

TEST_CASE("the navigation function is the exact search's cost and falls along its way", "[navigation]") {
  Rng rng = make_rng(21, "navigation");
  NavigationFunction field;
  AstarPlanner astar;
  int reached = 0;
  int apart = 0;
  for (int round = 0; round < 16; ++round) {
    TestWorld world({4.0, 4.0, 2.0}, 0.1);
    world.clutter(rng, 25, 1.3);
    const FreeSpace space = world.space();
    PlanRequest request;
    request.clearance_weight = 0.0;
    if (round % 2 == 1) request.rule = MotionRule::slice({0.65, 1.45});
    request.start_m = world.random_place(space, rng);
    const VoxelIndex goal = space.grid().index_of(request.start_m);
    const SegmentCheck check(space, {}, request.start_m);
    REQUIRE(field.compute(space, request, check, {goal, {}, 1.0, {}}) == PlanStatus::kReached);
    for (int k = 0; k < 12; ++k) {
      request.goal_m = world.random_place(space, rng);
      const VoxelIndex v = space.grid().index_of(request.goal_m);
      if (astar.plan(space, request).status != PlanStatus::kReached) {
        CHECK(field.at(v) == NavigationFunction::kUnreachable);
        CHECK(field.value(request.goal_m) == NavigationFunction::kUnreachable);
        CHECK_FALSE(field.next(v));
        ++apart;
        continue;
      }
      ++reached;
      CHECK(field.at(v) == Approx(astar.lattice_cost_m()).epsilon(1e-4).margin(1e-6));
      CHECK(field.value(request.goal_m) == Approx(field.at(v)).margin(1e-6));
      const auto on = field.next(v);
      REQUIRE(on.has_value() == (v != goal));
      if (on) CHECK(field.at(*on) < field.at(v));
    }
  }
  CHECK(reached > 80);
  CHECK(apart > 10);
}

TEST_CASE("a hill beside the navigation function leaves no minimum on the voxels", "[navigation]") {
  TestWorld world = u_trap();
  const FreeSpace space = world.space();
  const PlanRequest request = through_the_trap();
  const VoxelIndex goal = space.grid().index_of(request.goal_m);
  const SegmentCheck check(space, {}, request.start_m);
  // Walls of height 1 across the way, with gaps where the hill is lower.
  const auto hill = [](const VoxelIndex& v) { return v.x % 7 == 0 ? 1.0 + 0.1 * (v.y % 5) : 0.05 * (v.z % 3); };
  NavigationFunction field;
  REQUIRE(field.compute(space, request, check, {goal, {}, 2.0, hill}) == PlanStatus::kReached);
  for (std::size_t i = 0; i < space.grid().voxel_count(); i += 7) {
    const VoxelIndex v = space.grid().voxel(i);
    const auto on = field.next(v);
    if (!on) continue;
    const double length_m = (space.grid().center_of(*on) - space.grid().center_of(v)).norm();
    REQUIRE(field.at(v) + hill(v) >= field.at(*on) + hill(*on) + 2.0 * length_m - 1e-4);
  }
}

TEST_CASE("the wave stops beyond the start, at the deadline and at the budget", "[navigation]") {
  TestWorld world = u_trap();
  const FreeSpace space = world.space();
  PlanRequest request = through_the_trap();
  request.start_m = {5.95, 4.05, 1.05};
  const VoxelIndex goal = space.grid().index_of(request.goal_m);
  const VoxelIndex start = space.grid().index_of(request.start_m);
  const SegmentCheck check(space, {}, request.start_m);
  NavigationFunction field;
  CHECK(field.compute(space, request, check, {goal, start, 1.0, {}}) == PlanStatus::kReached);
  CHECK(field.at(start) == Approx(1.0));
  CHECK(field.at(space.grid().index_of({1.05, 4.05, 1.05})) == NavigationFunction::kUnreachable);
  request.max_expansions = 50;
  CHECK(field.compute(space, request, check, {goal, start, 1.0, {}}) == PlanStatus::kTimedOut);
  request.max_expansions = 1'000'000;
  request.clock_s = [] { return 1.0; };
  request.deadline_s = 0.5;
  CHECK(field.compute(space, request, check, {goal, start, 1.0, {}}) == PlanStatus::kTimedOut);
}

TEST_CASE("with geodesic attraction the descent reaches every goal that A* reaches", "[apf]") {
  Rng rng = make_rng(22, "apf");
  AstarPlanner astar;
  const auto geodesic = apf(Attraction::kGeodesic, false);
  const auto cone = apf(Attraction::kCone, false);
  int reached = 0;
  int apart = 0;
  int by_cone = 0;
  double length_m = 0.0;
  double astar_m = 0.0;
  for (int round = 0; round < 60; ++round) {
    TestWorld world({5.0, 5.0, 2.4}, 0.1, {0.2, round % 3 == 0 ? 0.1 : 0.0});
    world.clutter(rng, 35, 1.5);
    const FreeSpace space = world.space();
    PlanRequest request;
    if (round % 2 == 1) request.rule = MotionRule::slice({0.65, 1.25, 1.85});
    request.start_m = world.random_place(space, rng);
    request.goal_m = world.random_place(space, rng);
    if (round % 5 == 0) request.keep_out = {{world.random_place(space, rng), 0.5}};
    const PlanResult best = astar.plan(space, request);
    const PlanResult result = geodesic->plan(space, request);
    INFO(round);
    REQUIRE(result.status == best.status);
    if (best.status != PlanStatus::kReached) {
      ++apart;
      continue;
    }
    ++reached;
    check_answer(space, request, result);
    by_cone += cone->plan(space, request).status == PlanStatus::kReached ? 1 : 0;
    length_m += result.length_m;
    astar_m += best.length_m;
  }
  CHECK(reached > 25);
  CHECK(apart > 3);
  CHECK(by_cone < reached);
  WARN("of " << reached << " goals that A* reaches: " << reached << " with geodesic attraction at "
             << length_m / astar_m << " of its length, " << by_cone << " with the cone");
}

TEST_CASE("experience fills the trap that the cone is caught in", "[apf]") {
  TestWorld world = u_trap();
  const FreeSpace space = world.space();
  for (const bool slice : {false, true}) {
    PlanRequest request = through_the_trap();
    if (slice) request.rule = MotionRule::slice({1.05});
    CHECK(apf(Attraction::kCone, false)->plan(space, request).status == PlanStatus::kLocalMinimum);
    check_answer(space, request, apf(Attraction::kGeodesic, false)->plan(space, request));
    ApfPlanner::Config config;
    config.most_pots = 300;
    ApfPlanner planner(config);
    const PlanResult filled = planner.plan(space, request);
    check_answer(space, request, filled);
    CHECK(filled.length_m < 20.0);  // loops are left out; the least is 9.4 m
    CHECK(planner.pots().size() > 2);
    WARN("slice " << slice << ": " << planner.pots().size() << " pots, " << filled.length_m << " m");
    config.most_pots = 1;
    CHECK(ApfPlanner(config).plan(space, request).status == PlanStatus::kLocalMinimum);
  }
}
