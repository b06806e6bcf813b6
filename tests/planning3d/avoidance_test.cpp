/// Reciprocal avoidance in closed loop; benchmarks/avoidance_scenarios runs the same with a hundred seeds.
#include "avoidance_scenarios.hpp"

#include "planning3d/path_follower.hpp"
#include "planning3d/right_of_way.hpp"

#include <catch2/catch.hpp>

#include <string>

using namespace stairwell;
using namespace stairwell::planning3d;
using namespace stairwell::test;

TEST_CASE("Scenarios of reciprocal avoidance end without collisions and without deadlocks") {
  for (const std::string_view name : avoidance_scenario_names()) {
    const std::uint64_t seeds = name == "sphere_swap" ? 2 : 4;
    for (std::uint64_t seed = 0; seed < seeds; ++seed) {
      const OrcaConfig config;
      const AvoidanceOutcome outcome = run_avoidance(make_avoidance_scenario(name, seed), config);
      INFO(std::string(name) << ", seed " << seed);
      CHECK(outcome.collisions == 0);
      CHECK(outcome.not_arrived == 0);
      CHECK(outcome.max_speed_mps <= config.limits.speed_mps);
      CHECK(outcome.max_acceleration_mps2 <= config.limits.acceleration_mps2);
    }
  }
}

TEST_CASE("The same seed gives the same flights") {
  const AvoidanceScenario scenario = make_avoidance_scenario("doorway", 3);
  const AvoidanceOutcome first = run_avoidance(scenario, {});
  const AvoidanceOutcome second = run_avoidance(scenario, {});
  CHECK(first.finish_s == second.finish_s);
  CHECK(first.min_distance_m == second.min_distance_m);
}

TEST_CASE("A hatch is narrow, a hall is not") {
  const AvoidanceScenario scenario = make_avoidance_scenario("doorway", 0);
  const FreeSpace space = scenario.world->space();
  const PathFollower through({{2.0, 3.0, 1.6}, {10.0, 3.0, 1.6}}, {}, 1.0);
  const auto sections = narrow_sections(space, through, 0.6);
  REQUIRE(sections.size() == 1);
  CHECK(sections[0].from_m < 4.0);
  CHECK(sections[0].from_m > 3.2);
  CHECK(sections[0].to_m > 4.0);
  CHECK(sections[0].to_m < 4.8);
  const PathFollower hall({{2.0, 1.0, 1.6}, {2.0, 5.0, 1.6}}, {}, 1.0);
  CHECK(narrow_sections(space, hall, 0.6).empty());
}

TEST_CASE("At a hatch the nearer UAV goes first, and nobody enters towards one inside") {
  const AvoidanceScenario scenario = make_avoidance_scenario("doorway", 0);
  const FreeSpace space = scenario.world->space();
  PathFollower path({{4.5, 3.0, 1.6}, {10.0, 3.0, 1.6}}, {}, 1.0);
  const auto sections = narrow_sections(space, path, 0.6);
  const OrcaConfig config;
  const SeenUav own{{4.5, 3.0, 1.6}, {1.0, 0.0, 0.0}, 0};
  const auto held = [&](const SeenUav& fellow) {
    return RightOfWay(sections, 0.6).stop_arc_m(path, own, {fellow}, config) < 1.0;
  };
  CHECK(held({{7.0, 3.0, 1.6}, {-1.0, 0.0, 0.0}, 1}));
  CHECK_FALSE(held({{8.0, 3.0, 1.6}, {-1.0, 0.0, 0.0}, 1}));
  CHECK_FALSE(held({{7.0, 3.0, 1.6}, {1.0, 0.0, 0.0}, 1}));  // leaves
  CHECK(held({{6.0, 3.0, 1.6}, {0.0, 0.0, 0.0}, 1}));        // stands inside
  CHECK_FALSE(held({{6.0, 3.0, 1.6}, {1.0, 0.0, 0.0}, 1}));  // same direction
  CHECK_FALSE(held({{7.0, 3.0, 1.6}, {0.0, 0.0, 0.0}, 1}));  // hovers, wants nothing
}

TEST_CASE("Who is stopped for seconds by a fellow with a lower number goes back for a while") {
  const AvoidanceScenario scenario = make_avoidance_scenario("head_on", 0);
  const FreeSpace space = scenario.world->space();
  PathFollower path({{2.0, 3.0, 3.0}, {10.0, 3.0, 3.0}}, {}, 1.0);
  const SeenUav own{{5.0, 3.0, 3.0}, Eigen::Vector3d::Zero(), 1};
  path.seek(own.position_m);
  const OrcaConfig config;
  const auto periods_going_back = [&](std::size_t number_of_fellow) {
    RightOfWay way(narrow_sections(space, path, 0.6), 0.6);
    const SeenUav fellow{{5.7, 3.0, 3.0}, Eigen::Vector3d::Zero(), number_of_fellow};
    int count = 0;
    for (int i = 0; i < 70; ++i) {
      const bool back = way.stop_arc_m(path, own, {fellow}, config) < 2.0;
      CHECK_FALSE((back && i < 15));
      count += back ? 1 : 0;
    }
    return count;
  };
  CHECK(periods_going_back(0) >= 35);
  CHECK(periods_going_back(2) == 0);
}
