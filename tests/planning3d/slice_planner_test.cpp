#include "planning3d/slice_planner.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/apf_planner.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/connectivity.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/volume_planner.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

/// Three storeys of 2 m with slabs of 0.4 m; the openings are at opposite ends, so that one has to walk between them.
TestWorld three_storeys(bool upper_opening = true) {
  TestWorld world({8.0, 4.0, 6.8}, 0.1);
  const auto slab = [&world](double z_m, double x0_m, double x1_m) {  // with an opening from x0 to x1
    world.fill({{0.0, 0.0, z_m}, {8.0, 1.0, z_m + 0.4}}, true);
    world.fill({{0.0, 3.0, z_m}, {8.0, 4.0, z_m + 0.4}}, true);
    world.fill({{0.0, 0.0, z_m}, {x0_m, 4.0, z_m + 0.4}}, true);
    world.fill({{x1_m, 0.0, z_m}, {8.0, 4.0, z_m + 0.4}}, true);
  };
  slab(2.0, 0.3, 1.6);
  slab(4.4, 6.4, upper_opening ? 7.7 : 6.5);
  return world;
}

PlanRequest upwards() {
  PlanRequest request;
  request.start_m = {6.55, 2.05, 1.05};
  request.goal_m = {1.05, 2.05, 5.85};
  request.clearance_weight = 0.0;
  return request;
}

void check_answer(const FreeSpace& space, const PlanRequest& request, const PlanResult& result,
                  const std::vector<double>* layers_m) {
  REQUIRE(result.status == PlanStatus::kReached);
  CHECK((result.path_m.front() - request.start_m).norm() < 1e-12);
  CHECK((result.path_m.back() - request.goal_m).norm() < 1e-12);
  CHECK(checkers::path_problem(space, result.path_m) == "");
  CHECK(SafetyCheck{}.check_path(space, result.path_m).safe());
  if (layers_m != nullptr) CHECK(checkers::slice_problem(space.grid(), result.path_m, *layers_m) == "");
}

/// Plain flood fill.
std::vector<int> flooded(const FreeSpace& space, bool corners) {
  std::vector<int> part(space.grid().voxel_count(), -1);
  int parts = 0;
  for (std::size_t i = 0; i < part.size(); ++i) {
    if (part[i] >= 0 || !space.traversable(space.grid().voxel(i))) continue;
    std::vector<VoxelIndex> open{space.grid().voxel(i)};
    part[i] = parts;
    while (!open.empty()) {
      const VoxelIndex v = open.back();
      open.pop_back();
      for (int move = 0; move < 27; ++move) {
        const VoxelIndex d{move % 3 - 1, move / 3 % 3 - 1, move / 9 - 1};
        if (!corners && std::abs(d.x) + std::abs(d.y) + std::abs(d.z) != 1) continue;
        if (!space.traversable(v + d) || part[space.grid().linear(v + d)] >= 0) continue;
        part[space.grid().linear(v + d)] = parts;
        open.push_back(v + d);
      }
    }
    ++parts;
  }
  return part;
}

}  // namespace

TEST_CASE("connected parts are those of a flood fill", "[connectivity]") {
  Rng rng = make_rng(11, "connectivity");
  std::size_t most_parts = 0;
  for (int round = 0; round < 8; ++round) {
    TestWorld world({4.0, 4.0, 2.0}, 0.1, {round % 2 == 0 ? 0.01 : 0.2, 0.0});
    world.clutter(rng, 60, 1.2);
    for (int i = 0; i < 45'000 && round % 2 == 0; ++i) {  // three of four voxels: edges and corners matter
      world.map.set_log_odds({rng.uniform_int(0, 39), rng.uniform_int(0, 39), rng.uniform_int(0, 19)}, 2.0F);
    }
    if (round % 3 == 0) world.box = {{0.3, 0.4, 0.2}, {3.5, 3.8, 1.7}};
    const FreeSpace space = world.space();
    for (const bool corners : {false, true}) {
      const std::vector<int> expected = flooded(space, corners);
      const auto found =
          Connectivity::find(space, corners ? Connectivity::Neighbours::kAll : Connectivity::Neighbours::kFaces);
      REQUIRE(found);
      std::set<std::pair<int, std::uint32_t>> pairs;
      std::set<std::uint32_t> names;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const std::uint32_t part = found->part(space.grid().voxel(i));
        REQUIRE((part == Connectivity::kNone) == (expected[i] < 0));
        if (expected[i] >= 0) pairs.insert({expected[i], part});
        if (expected[i] >= 0) names.insert(part);
      }
      CHECK(pairs.size() == names.size());  // one part per name
      CHECK(static_cast<int>(names.size()) == 1 + *std::max_element(expected.begin(), expected.end()));
      most_parts = std::max(most_parts, pairs.size());
    }
    CHECK_FALSE(Connectivity::find(space, Connectivity::Neighbours::kAll, [] { return true; }));
  }
  CHECK(most_parts > 2);
}

TEST_CASE("the slice planner changes layers through the openings of the map", "[slice]") {
  TestWorld world = three_storeys();
  const FreeSpace space = world.space();
  const auto slice = make_planner("slice");
  const auto volume = make_planner("volume");
  PlanRequest request = upwards();
  SECTION("with layers of the request") {
    request.rule = MotionRule::slice({1.05, 3.45, 5.85});
    const PlanResult result = slice->plan(space, request);
    check_answer(space, request, result, &request.rule.layers_m);
    // At least to the first opening, over to the second and back, and the heights.
    CHECK(result.length_m > 4.5 + 4.4 + 4.5 + 4.8);
    CHECK(result.length_m < 1.1 * (4.9 + 5.2 + 5.3 + 4.8));
    request.rule = MotionRule::slice({1.05, 5.85});  // nothing leads from one opening to the other
    CHECK(slice->plan(space, request).status == PlanStatus::kNoPath);
    check_answer(space, request, volume->plan(space, request), nullptr);
  }
  SECTION("with layers of its own") {
    const PlanResult result = slice->plan(space, request);
    const SlicePlanner planner(make_planner("theta"));
    const MotionRule rule = planner.rule_for(space, request);
    check_answer(space, request, result, &rule.layers_m);
    const PlanResult free = volume->plan(space, request);
    check_answer(space, request, free, nullptr);
    CHECK(free.length_m < result.length_m);
    request.max_expansions = 100;
    CHECK(slice->plan(space, request).status == PlanStatus::kTimedOut);
  }
  SECTION("ends off the layers are reached straight up and down") {
    request.rule = MotionRule::slice({1.05, 3.45, 5.85});
    request.start_m = {6.55, 2.05, 0.45};
    request.goal_m = {1.02, 2.07, 6.4};
    check_answer(space, request, slice->plan(space, request), &request.rule.layers_m);
  }
  SECTION("layers without a connection") {
    TestWorld shut = three_storeys(false);
    CHECK(slice->plan(shut.space(), request).status == PlanStatus::kNoPath);
    CHECK(volume->plan(shut.space(), request).status == PlanStatus::kNoPath);
  }
  SECTION("keep-out spheres over an opening") {
    request.keep_out = {{{1.0, 2.0, 2.2}, 1.0}};
    CHECK(slice->plan(space, request).status == PlanStatus::kNoPath);
  }
  SECTION("the inner planner decides within the layers") {
    SlicePlanner by_field(std::make_unique<ApfPlanner>());
    const PlanResult result = by_field.plan(space, request);
    const MotionRule rule = by_field.rule_for(space, request);
    check_answer(space, request, result, &rule.layers_m);
  }
}

TEST_CASE("the slice planner reaches what the slice rule lets A* reach, at nearly its length", "[slice]") {
  Rng rng = make_rng(12, "slice");
  AstarPlanner astar;
  const auto slice = make_planner("slice");
  int reached = 0;
  int apart = 0;
  double length_m = 0.0;
  double astar_m = 0.0;
  for (int round = 0; round < 40; ++round) {
    TestWorld world({5.0, 5.0, 2.4}, 0.1, {0.2, round % 3 == 0 ? 0.1 : 0.0});
    world.clutter(rng, 30, 1.5);
    const FreeSpace space = world.space();
    PlanRequest request;
    request.clearance_weight = 0.0;
    request.rule = MotionRule::slice({0.65, 1.25, 1.85});
    request.start_m = world.random_place(space, rng);
    request.goal_m = world.random_place(space, rng);
    const PlanResult best = astar.plan(space, request);
    const PlanResult result = slice->plan(space, request);
    REQUIRE(result.status == best.status);
    if (best.status != PlanStatus::kReached) {
      ++apart;
      continue;
    }
    ++reached;
    check_answer(space, request, result, &request.rule.layers_m);
    length_m += result.length_m;
    astar_m += best.length_m;
  }
  CHECK(reached > 15);
  CHECK(apart > 3);
  CHECK(length_m < 1.05 * astar_m);
}

TEST_CASE("the volume planner ignores the slice rule", "[volume]") {
  TestWorld world = three_storeys();
  const FreeSpace space = world.space();
  PlanRequest request = upwards();
  const auto volume = make_planner("volume");
  const PlanResult free = volume->plan(space, request);
  request.rule = MotionRule::slice({1.05});
  CHECK(volume->plan(space, request).path_m == free.path_m);
}
