#include "planning3d/ompl_planner.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/segment_check.hpp"
#include "planning3d/shorten_path.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <string>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

std::string answer_problem(const FreeSpace& space, const PlanRequest& request, const PlanResult& result) {
  if ((result.path_m.front() - request.start_m).norm() > 1e-12) return "does not start at the start";
  if ((result.path_m.back() - request.goal_m).norm() > 1e-12) return "does not end at the goal";
  if (!SafetyCheck{}.check_path(space, result.path_m).safe()) return "fails the safety check";
  const SegmentCheck check(space, request.keep_out, request.start_m);
  for (std::size_t i = 0; i + 1 < result.path_m.size(); ++i) {
    if (!check.segment_free(result.path_m[i], result.path_m[i + 1])) return "segment " + std::to_string(i);
  }
  if (std::abs(result.length_m - path_length_m(result.path_m)) > 1e-9) return "names another length";
  return checkers::path_problem(space, result.path_m);
}

/// A clock that moves on by a millisecond whenever it is read.
struct CountedClock {
  int reads = 0;
  std::function<double()> function() {
    return [this] { return 1e-3 * ++reads; };
  }
};

/// Two rooms with a doorway between them; `door` false: a wall without one.
TestWorld two_rooms(bool door) {
  TestWorld world({6.0, 6.0, 2.5}, 0.1);
  world.fill({{2.8, 0.0, 0.0}, {3.2, door ? 4.5 : 6.0, 2.5}}, true);
  world.fill({{2.8, 5.5, 0.0}, {3.2, 6.0, 2.5}}, true);
  world.fill({{2.8, 4.5, 2.0}, {3.2, 5.5, 2.5}}, true);
  return world;
}

PlanRequest across() {
  PlanRequest request;
  request.start_m = {1.05, 1.05, 1.25};
  request.goal_m = {5.05, 1.05, 1.25};
  return request;
}

}  // namespace

TEST_CASE("sampled paths are free, exact and hardly longer than the best", "[ompl]") {
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    Rng rng = make_rng(11, "ompl-worlds");
    const auto planner = make_planner(name);
    CHECK(planner->name() == name);
    AstarPlanner search;
    double length_m = 0.0;
    double searched_m = 0.0;
    int reached = 0;
    int asked = 0;
    for (int round = 0; round < 14; ++round) {
      TestWorld world({6.0, 6.0, 2.5}, 0.1, {0.2, round % 3 == 0 ? 0.05 : 0.0});
      world.clutter(rng, 25, 1.8);
      const Eigen::Vector3d unseen_m(rng.uniform(0.0, 5.0), rng.uniform(0.0, 5.0), 0.0);
      const FreeSpace space = world.space();
      PlanRequest request;
      request.clearance_weight = 0.0;
      request.seed = static_cast<std::uint64_t>(round);
      request.max_checks = 10'000;
      const auto jitter = [&rng] {
        return Eigen::Vector3d(rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03));
      };
      const SegmentCheck check(space, {}, request.start_m);
      do {
        request.start_m = world.random_place(space, rng) + jitter();
      } while (!check.fits(request.start_m));
      do {
        request.goal_m = world.random_place(space, rng) + jitter();
      } while (!check.fits(request.goal_m));
      const PlanResult best = search.plan(space, request);
      const PlanResult result = planner->plan(space, request);
      if (best.status != PlanStatus::kReached) {
        CHECK(result.status != PlanStatus::kReached);
        continue;
      }
      ++asked;
      if (result.status != PlanStatus::kReached) {
        CHECK(result.status == PlanStatus::kTimedOut);
        CHECK(result.path_m.empty());
        CHECK(std::isnan(result.length_m));
        continue;
      }
      ++reached;
      CHECK(answer_problem(space, request, result) == "");
      length_m += result.length_m;
      searched_m += best.length_m;
    }
    CHECK(asked >= 10);
    CHECK(reached >= asked - 4);
    CHECK(length_m <= (name == "rrtconnect" ? 1.3 : 1.15) * searched_m);
  }
}

TEST_CASE("sampled paths never enter what is unknown", "[ompl]") {
  TestWorld world({6.0, 6.0, 2.5}, 0.1);
  mapping::OccupancyMap seen(world.map.grid());
  for (int z = 0; z < 25; ++z) {
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        // A strip right across was never seen but for a gap at one end.
        if (x < 28 || x > 32 || y > 50) seen.set_log_odds({x, y, z}, -1.0F);
      }
    }
  }
  world.map = std::move(seen);
  const FreeSpace space = world.space();
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    const PlanResult result = make_planner(name)->plan(space, across());
    REQUIRE(result.status == PlanStatus::kReached);
    CHECK(answer_problem(space, across(), result) == "");
    CHECK(result.length_m > 8.0);
  }
}

TEST_CASE("goals that are closed off are named within the deadline", "[ompl]") {
  TestWorld world = two_rooms(false);
  const FreeSpace space = world.space();
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    CHECK(make_planner(name)->plan(space, across()).status == PlanStatus::kNoPath);
    // Without looking for pockets, until the time is up; the clock moves only when it is read.
    OmplPlanner::Config config;
    config.flood_voxels = 0;
    for (const auto algorithm : {OmplPlanner::Algorithm::kRrtConnect, OmplPlanner::Algorithm::kRrtStar,
                                 OmplPlanner::Algorithm::kInformedRrtStar, OmplPlanner::Algorithm::kBitStar,
                                 OmplPlanner::Algorithm::kAbitStar, OmplPlanner::Algorithm::kPrmStar}) {
      OmplPlanner planner(algorithm, config);
      if (planner.name() != name) continue;
      for (const int budget : {1, 100, 3000}) {
        CountedClock clock;
        PlanRequest request = across();
        request.max_checks = 20'000;
        request.clock_s = clock.function();
        request.deadline_s = 1e-3 * budget;
        CHECK(planner.plan(space, request).status == PlanStatus::kTimedOut);
        CHECK(clock.reads <= 1.1 * budget + 1);
      }
      PlanRequest request = across();
      request.max_checks = 2000;
      const PlanResult result = planner.plan(space, request);
      CHECK(result.status == PlanStatus::kTimedOut);
      CHECK(result.expansions == 2001);
    }
  }
}

TEST_CASE("no motion is granted once the checks or the time are spent", "[ompl]") {
  // Whatever question happens to be the last one allowed: a motion granted behind it would lead through the wall, and
  // the answer would no longer be that the budget is spent.
  TestWorld shut = two_rooms(false);
  const FreeSpace space = shut.space();
  OmplPlanner::Config config;
  config.flood_voxels = 0;
  for (const auto algorithm :
       {OmplPlanner::Algorithm::kRrtConnect, OmplPlanner::Algorithm::kRrtStar, OmplPlanner::Algorithm::kInformedRrtStar,
        OmplPlanner::Algorithm::kBitStar, OmplPlanner::Algorithm::kAbitStar, OmplPlanner::Algorithm::kPrmStar}) {
    OmplPlanner planner(algorithm, config);
    for (int budget = 1; budget <= 40; ++budget) {
      CAPTURE(planner.name(), budget);
      PlanRequest request = across();
      request.max_checks = static_cast<std::size_t>(budget);
      const PlanResult result = planner.plan(space, request);
      CHECK(result.status == PlanStatus::kTimedOut);
      CHECK(result.expansions == request.max_checks + 1);
      CountedClock clock;
      request.max_checks = 20'000;
      request.clock_s = clock.function();
      request.deadline_s = 1e-3 * budget;
      CHECK(planner.plan(space, request).status == PlanStatus::kTimedOut);
    }
  }
}

TEST_CASE("what is found is found within the checks that were allowed", "[ompl]") {
  TestWorld open = two_rooms(true);
  const FreeSpace space = open.space();
  const auto planner = make_planner("rrtconnect");  // the one that stops at the first path
  int reached = 0;
  int spent = 0;
  for (std::size_t budget = 1; budget <= 400; ++budget) {
    CAPTURE(budget);
    PlanRequest request = across();
    request.seed = budget % 7;
    request.max_checks = budget;
    const PlanResult result = planner->plan(space, request);
    if (result.status == PlanStatus::kReached) {
      ++reached;
      CHECK(result.expansions <= budget);
    } else {
      ++spent;
      CHECK(result.status == PlanStatus::kTimedOut);
      CHECK(result.expansions == budget + 1);
    }
  }
  CHECK(reached > 20);
  CHECK(spent > 20);
}

TEST_CASE("an open door is found before the deadline and the path is cut no longer than it allows", "[ompl]") {
  TestWorld world = two_rooms(true);
  const FreeSpace space = world.space();
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    CountedClock clock;
    PlanRequest request = across();
    request.clock_s = clock.function();
    request.deadline_s = 5.0;
    const PlanResult result = make_planner(name)->plan(space, request);
    REQUIRE(result.status == PlanStatus::kReached);
    CHECK(answer_problem(space, request, result) == "");
    CHECK(clock.reads <= 5500);
    CHECK(result.length_m < 9.6);  // least: 8.5 m
  }
}

TEST_CASE("the same seed and iteration budget give the same path", "[ompl]") {
  TestWorld world = two_rooms(true);
  const FreeSpace space = world.space();
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    PlanRequest request = across();
    request.seed = 7;
    request.max_checks = 4000;
    const auto planner = make_planner(name);
    const PlanResult first = planner->plan(space, request);
    REQUIRE(first.status == PlanStatus::kReached);
    request.seed = 8;
    const PlanResult other = planner->plan(space, request);
    request.seed = 7;
    for (int round = 0; round < 3; ++round) {
      const PlanResult again = make_planner(name)->plan(space, request);
      CHECK(again.path_m == first.path_m);
      CHECK(again.expansions == first.expansions);
    }
    CHECK(other.path_m != first.path_m);
  }
}

TEST_CASE("in slices sampled paths stay in one layer", "[ompl]") {
  TestWorld world = two_rooms(true);
  const FreeSpace space = world.space();
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    const auto planner = make_planner(name);
    PlanRequest request = across();
    request.rule = MotionRule::slice({0.65, 1.25});
    PlanResult result = planner->plan(space, request);
    REQUIRE(result.status == PlanStatus::kReached);
    CHECK(answer_problem(space, request, result) == "");
    CHECK(checkers::slice_problem(space.grid(), result.path_m, request.rule.layers_m) == "");
    request.goal_m.z() = 0.95;  // both off the layers
    request.start_m.z() = 1.75;
    result = planner->plan(space, request);
    REQUIRE(result.status == PlanStatus::kReached);
    CHECK(answer_problem(space, request, result) == "");
    CHECK(checkers::slice_problem(space.grid(), result.path_m, request.rule.layers_m) == "");
    request.rule = MotionRule::slice({2.3});  // the door is lower, and this layer is in the ceiling
    CHECK(planner->plan(space, request).status == PlanStatus::kNoPath);
    request.rule = MotionRule::slice({});
    CHECK(planner->plan(space, request).status == PlanStatus::kNoPath);
    request.goal_m = {1.05, 1.05, 0.85};
    CHECK(planner->plan(space, request).status == PlanStatus::kReached);
  }
}

TEST_CASE("sampled paths keep out of spheres and can leave one", "[ompl]") {
  TestWorld world({6.0, 6.0, 2.5}, 0.1);
  const FreeSpace space = world.space();
  PlanRequest request = across();
  request.keep_out = {{{3.0, 1.05, 1.25}, 0.9}};
  PlanRequest inside = across();
  inside.keep_out = {{{1.3, 1.05, 1.25}, 0.8}};
  for (const std::string_view name : OmplPlanner::names()) {
    INFO(name);
    const PlanResult around = make_planner(name)->plan(space, request);
    REQUIRE(around.status == PlanStatus::kReached);
    for (std::size_t i = 0; i + 1 < around.path_m.size(); ++i) {
      for (double u = 0.0; u <= 1.0; u += 0.02) {
        const Eigen::Vector3d at_m = around.path_m[i] + u * (around.path_m[i + 1] - around.path_m[i]);
        CHECK((at_m - request.keep_out[0].center_m).norm() >= 0.9 - 1e-6);
      }
    }
    CHECK(make_planner(name)->plan(space, inside).status == PlanStatus::kReached);
  }
}

TEST_CASE("shortened paths are free and shorter, and stopping keeps what there is", "[ompl]") {
  TestWorld world = two_rooms(true);
  const FreeSpace space = world.space();
  const SegmentCheck check(space, {}, across().start_m);
  std::vector<Eigen::Vector3d> path_m{across().start_m,   {1.05, 3.05, 0.65}, {1.05, 5.05, 1.25},
                                      {3.05, 5.05, 1.25}, {5.05, 5.05, 0.85}, across().goal_m};
  Rng rng = make_rng(1, "shorten");
  const auto cut_m = shorten_path(check, path_m, rng, [] { return false; });
  CHECK(path_length_m(cut_m) < 9.0);
  CHECK(path_length_m(path_m) > 12.0);
  PlanResult result;
  result.path_m = cut_m;
  result.length_m = path_length_m(cut_m);
  CHECK(answer_problem(space, across(), result) == "");
  CHECK(path_length_m(shorten_path(check, path_m, rng, [] { return true; })) <= path_length_m(path_m));
}
