#include "planning3d/planner.hpp"

#include "checkers/path_checker.hpp"
#include "core/errors.hpp"
#include "models.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <queue>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::cpu_ms_since;
using stairwell::test::TestWorld;

namespace {

/// Plain Dijkstra over voxels, 26 moves (slice: 8 in layers, 2 vertical), no shortcuts.
std::vector<double> dijkstra_m(const FreeSpace& space, const VoxelIndex& from, const std::vector<int>* layers,
                               bool exact_diagonals) {
  const GridSpec& grid = space.grid();
  std::vector<double> cost(grid.voxel_count(), INFINITY);
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[grid.linear(from)] = 0.0;
  open.push({0.0, grid.linear(from)});
  while (!open.empty()) {
    const auto [c, i] = open.top();
    open.pop();
    if (c > cost[i]) continue;
    const VoxelIndex v = grid.voxel(i);
    const bool level = layers == nullptr || std::count(layers->begin(), layers->end(), v.z) > 0;
    for (int move = 0; move < 27; ++move) {
      const VoxelIndex d{move % 3 - 1, move / 3 % 3 - 1, move / 9 - 1};
      if (move == 13) continue;
      if (layers != nullptr && (d.z == 0 ? !level : d.x != 0 || d.y != 0)) continue;
      const VoxelIndex to = v + d;
      if (!space.traversable(to)) continue;
      const double length_m = (grid.center_of(to) - grid.center_of(v)).norm();
      if (exact_diagonals && length_m > 1.1 * grid.resolution_m() &&
          !space.sphere_free(0.5 * (grid.center_of(v) + grid.center_of(to)), space.robot().radius_m)) {
        continue;
      }
      if (c + length_m >= cost[grid.linear(to)]) continue;
      cost[grid.linear(to)] = c + length_m;
      open.push({c + length_m, grid.linear(to)});
    }
  }
  return cost;
}

}  // namespace

TEST_CASE("A* finds the least cost a plain Dijkstra finds", "[astar]") {
  Rng rng = make_rng(3, "astar");
  AstarPlanner planner;
  int reached = 0;
  int cut_off = 0;
  for (int round = 0; round < 60; ++round) {
    TestWorld world({5.0, 5.0, 2.0}, 0.1, {0.2, round % 3 == 0 ? 0.1 : 0.0});
    world.clutter(rng, 30, 1.5);
    const FreeSpace space = world.space();
    const bool slice = round % 2 == 1;
    const std::vector<double> layers_m{0.65, 1.45};
    const std::vector<int> layers{6, 14};
    PlanRequest request;
    request.clearance_weight = 0.0;
    if (slice) request.rule = MotionRule::slice(layers_m);
    request.start_m = world.random_place(space, rng);
    request.goal_m = world.random_place(space, rng);
    const auto cost_m = dijkstra_m(space, space.grid().index_of(request.start_m), slice ? &layers : nullptr, true);
    const double least_m = cost_m[space.grid().linear(space.grid().index_of(request.goal_m))];
    const PlanResult result = planner.plan(space, request);
    if (std::isinf(least_m)) {
      CHECK(result.status == PlanStatus::kNoPath);
      CHECK(result.path_m.empty());
      CHECK(std::isnan(result.length_m));
      ++cut_off;
      continue;
    }
    REQUIRE(result.status == PlanStatus::kReached);
    ++reached;
    CHECK(planner.lattice_cost_m() == Approx(least_m).epsilon(1e-4));
    CHECK(result.length_m <= least_m * 1.02 + 0.01);
    CHECK((result.path_m.front() - request.start_m).norm() < 1e-12);
    CHECK((result.path_m.back() - request.goal_m).norm() < 1e-12);
    CHECK(checkers::path_problem(space, result.path_m) == "");
    CHECK(SafetyCheck{}.check_path(space, result.path_m).safe());
    if (slice) CHECK(checkers::slice_problem(space.grid(), result.path_m, layers_m) == "");
  }
  CHECK(reached > 30);
  CHECK(cut_off > 0);
}

TEST_CASE("a long search of A* led by regions finds what there is, and hardly longer ways", "[astar]") {
  Rng rng = make_rng(21, "astar-led");
  AstarPlanner::Config led_config;
  led_config.led_from = 0;
  led_config.led_after = 100;
  AstarPlanner led(led_config);
  AstarPlanner exact;
  int fewer = 0;
  int cut_off = 0;
  double led_m = 0.0;
  double exact_m = 0.0;
  for (int round = 0; round < 60; ++round) {
    TestWorld world({6.0, 5.0, 2.0}, 0.1);
    world.clutter(rng, 40, 1.8);
    const FreeSpace space = world.space();
    PlanRequest request;
    request.start_m = world.random_place(space, rng);
    request.goal_m = world.random_place(space, rng);
    if (round % 3 == 0) request.keep_out.push_back({world.random_place(space, rng), 0.7});
    const PlanResult best = exact.plan(space, request);
    const PlanResult result = led.plan(space, request);
    REQUIRE(result.status == best.status);
    if (best.status == PlanStatus::kNoPath) {
      ++cut_off;
      if (request.keep_out.empty()) CHECK(result.expansions <= 101);  // the regions say so at once
    }
    if (best.status != PlanStatus::kReached) continue;
    CHECK(checkers::path_problem(space, result.path_m) == "");
    CHECK(led.lattice_cost_m() <= 1.6 * exact.lattice_cost_m() + 1e-3);
    led_m += led.lattice_cost_m();
    exact_m += exact.lattice_cost_m();
    if (result.expansions < best.expansions) ++fewer;
    request.max_expansions = 120;  // the budget is for both searches together
    CHECK(led.plan(space, request).expansions <= 121);
  }
  CHECK(led_m < 1.1 * exact_m);
  CHECK(fewer > 10);
  CHECK(cut_off > 0);
}

TEST_CASE("what a led search remembers of the last one changes no path", "[astar]") {
  Rng rng = make_rng(22, "astar-led-kept");
  AstarPlanner::Config config;
  config.led_from = 0;
  config.led_after = 50;
  AstarPlanner kept(config);
  int reached = 0;
  for (int round = 0; round < 30; ++round) {
    TestWorld world({6.0, 5.0, 2.0}, 0.1);
    world.clutter(rng, 30, 1.8);
    PlanRequest request;
    request.start_m = world.random_place(world.space(), rng);
    request.goal_m = world.random_place(world.space(), rng);
    for (int time = 0; time < 4; ++time) {  // the same request, round fellows, in a world that changed, both
      if (time == 2) world.clutter(rng, 10, 1.5);
      const FreeSpace space = world.space();
      request.keep_out.clear();
      if (time % 2 == 1) request.keep_out.push_back({world.random_place(space, rng), 0.5});
      AstarPlanner fresh(config);
      const PlanResult expected = fresh.plan(space, request);
      const PlanResult result = kept.plan(space, request);
      REQUIRE(result.status == expected.status);
      REQUIRE(result.expansions == expected.expansions);
      REQUIRE(result.path_m == expected.path_m);
      if (result.status == PlanStatus::kReached && result.expansions > config.led_after) ++reached;
    }
  }
  CHECK(reached > 30);
}

TEST_CASE("paths keep away from walls, fit the robot anywhere and are found fast", "[astar]") {
  Rng rng = make_rng(4, "astar-speed");
  AstarPlanner exact;
  const auto planner = make_planner("astar");
  double length_m = 0.0;
  double exact_length_m = 0.0;
  std::vector<double> all_ms;
  TestWorld world({20.0, 20.0, 3.0}, 0.1, {0.2, 0.05});
  world.clutter(rng, 150, 2.5);
  const FreeSpace space = world.space();
  for (int round = 0; round < 40; ++round) {
    PlanRequest request;
    const auto jitter = [&rng] { return Eigen::Vector3d(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)); };
    request.start_m = world.random_place(space, rng) + 0.04 * jitter();
    request.goal_m = world.random_place(space, rng) + 0.04 * jitter();
    const std::clock_t begin = std::clock();
    const PlanResult result = planner->plan(space, request);
    all_ms.push_back(cpu_ms_since(begin));
    const PlanResult best = exact.plan(space, request);
    CHECK(best.status == result.status);
    if (result.status != PlanStatus::kReached) continue;
    length_m += result.length_m;
    exact_length_m += best.length_m;
    CHECK(checkers::path_problem(space, result.path_m) == "");
  }
  CHECK(length_m <= 1.1 * exact_length_m);
  std::sort(all_ms.begin(), all_ms.end());
  WARN("A* 20x20x3 m at 0.1 m: median " << all_ms[20] << " ms, worst " << all_ms.back() << " ms, length "
                                        << length_m / exact_length_m << " of the exact search's");
}

TEST_CASE("planners name what is wrong", "[planner]") {
  TestWorld world({6.0, 6.0, 3.0}, 0.1);
  world.fill({{2.8, 0.0, 0.0}, {3.2, 6.0, 3.0}}, true);
  const FreeSpace space = world.space();
  const Eigen::Vector3d near_m(1.05, 3.05, 1.55);
  const Eigen::Vector3d far_m(5.05, 3.05, 1.55);
  const Eigen::Vector3d wall_m(3.0, 3.0, 1.5);
  const Eigen::Vector3d nan_m(std::nan(""), 0.0, 0.0);
  for (const std::string_view name : planner_names()) {
    const auto planner = make_planner(name, test::with_models());
    CHECK(planner->name() == name);
    const auto status = [&](const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                            std::vector<KeepOut> keep_out = {}) {
      PlanRequest request;
      request.start_m = from_m;
      request.goal_m = to_m;
      request.keep_out = std::move(keep_out);
      return planner->plan(space, request).status;
    };
    CHECK(status(nan_m, far_m) == PlanStatus::kStartBlocked);
    CHECK(status(near_m, nan_m) == PlanStatus::kGoalBlocked);
    CHECK(status(wall_m, near_m) == PlanStatus::kStartBlocked);
    CHECK(status(near_m, wall_m) == PlanStatus::kGoalBlocked);
    CHECK(status(near_m, {40.0, 0.0, 0.0}) == PlanStatus::kGoalBlocked);
    CHECK(status(near_m, {1.05, 4.55, 1.55}, {{{1.0, 4.5, 1.5}, 0.5}}) == PlanStatus::kGoalBlocked);
    CHECK(status(near_m, {1.05, 4.55, 1.55}) == PlanStatus::kReached);
    CHECK(status(near_m, near_m) == PlanStatus::kReached);
    const PlanStatus through = status(near_m, far_m);
    CHECK((through == PlanStatus::kNoPath || through == PlanStatus::kLocalMinimum));
  }
  PlanRequest short_of_time;
  short_of_time.start_m = near_m;
  short_of_time.goal_m = {1.05, 4.55, 1.55};
  short_of_time.max_expansions = 3;
  CHECK(make_planner("astar")->plan(space, short_of_time).status == PlanStatus::kTimedOut);
  CHECK_THROWS_WITH(make_planner("teleport"), Catch::Contains("astar") && Catch::Contains("apf"));
}

TEST_CASE("keep-out spheres are flown around and can be left", "[astar]") {
  TestWorld world({6.0, 6.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  PlanRequest request;
  request.start_m = {1.05, 3.05, 1.55};
  request.goal_m = {5.05, 3.05, 1.55};
  request.keep_out = {{{3.0, 3.0, 1.5}, 0.8}};
  const PlanResult around = make_planner("astar")->plan(space, request);
  REQUIRE(around.status == PlanStatus::kReached);
  for (std::size_t i = 0; i + 1 < around.path_m.size(); ++i) {
    for (double u = 0.0; u <= 1.0; u += 0.02) {
      CHECK((around.path_m[i] + u * (around.path_m[i + 1] - around.path_m[i]) - request.keep_out[0].center_m).norm() >=
            0.8 - 0.02);
    }
  }
  request.keep_out = {{{1.3, 3.05, 1.55}, 0.8}};  // starts inside
  CHECK(make_planner("astar")->plan(space, request).status == PlanStatus::kReached);
}

TEST_CASE("potential field descends where nothing traps it and admits when trapped", "[apf]") {
  Rng rng = make_rng(5, "apf");
  const auto planner = make_planner("apf");
  int reached = 0;
  for (int round = 0; round < 40; ++round) {
    TestWorld world({8.0, 8.0, 3.0}, 0.1, {0.2, 0.05});
    world.clutter(rng, 12, 1.0);
    const FreeSpace space = world.space();
    PlanRequest request;
    request.start_m = world.random_place(space, rng);
    request.goal_m = world.random_place(space, rng);
    const bool slice = round % 2 == 1;
    if (slice) {
      request.goal_m.z() = request.start_m.z();
      request.rule = MotionRule::slice({request.start_m.z()});
    }
    const PlanResult result = planner->plan(space, request);
    if (result.status != PlanStatus::kReached) continue;
    ++reached;
    CHECK(checkers::path_problem(space, result.path_m) == "");
    if (slice) CHECK(checkers::slice_problem(space.grid(), result.path_m, request.rule.layers_m) == "");
  }
  CHECK(reached > 20);
  TestWorld pocket({6.0, 6.0, 3.0}, 0.1);
  pocket.fill({{3.0, 1.0, 0.0}, {3.2, 5.0, 3.0}}, true);
  PlanRequest request;
  request.start_m = {1.05, 3.05, 1.55};
  request.goal_m = {5.05, 3.05, 1.55};
  CHECK(planner->plan(pocket.space(), request).status == PlanStatus::kLocalMinimum);
}
