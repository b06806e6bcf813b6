#include "core/errors.hpp"
#include "toy_world.hpp"

#include <catch2/catch.hpp>

#include <cstdio>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

void report(const std::string& what, const toy::Outcome& o) {
  std::printf("%-28s known %.4f goals %3zu vain %3zu travel %6.1f m longest %6.1f s assign %5.1f ms (max %5.1f)%s\n",
              what.c_str(), o.known_part, o.goals, o.vain, o.travel_m, o.longest_s, o.assign_ms, o.assign_max_ms,
              o.finished ? "" : " NOT FINISHED");
}

toy::Scenario scenario_of(const std::string& name, const toy::World& world, const SensorModel& sensor,
                          std::vector<Eigen::Vector3d> starts_m) {
  toy::Scenario scenario{name, world, std::move(starts_m), toy::config_for(world, sensor), 400};
  scenario.seeable = toy::seeable_from(scenario);
  return scenario;
}

std::vector<toy::Scenario> scenarios() {
  return {
      scenario_of("storeys lidar", toy::two_storeys(0.2), toy::lidar(), {{1.5, 1.5, 1.2}}),
      scenario_of("storeys camera", toy::two_storeys(0.2), toy::camera(), {{1.5, 1.5, 1.2}}),
      scenario_of("corridor camera", toy::corridor(0.2), toy::camera(), {{1.0, 0.8, 1.2}}),
      scenario_of("box lidar", toy::World({{0, 0, 0}, {4, 4, 3}}, 0.1), toy::lidar(), {{2.0, 2.0, 1.2}}),
  };
}

}  // namespace

TEST_CASE("an office with four UAVs, for timing", "[.office]") {
  toy::Scenario scenario{"office lidar x4",
                         toy::office(0.1),
                         {{1.0, 10.0, 1.2}, {2.0, 9.4, 1.2}, {2.0, 10.6, 1.2}, {3.0, 10.0, 1.2}},
                         {},
                         60,
                         {}};
  scenario.config = toy::config_for(scenario.world, toy::lidar());
  scenario.seeable.assign(scenario.world.grid().voxel_count(), 0);  // only the costs are of interest
  report(scenario.name, toy::run(scenario, *make_strategy("frontiers", scenario.config)));
}

TEST_CASE("every strategy sees the whole world") {
  for (const toy::Scenario& base : scenarios()) {
    for (const std::string_view name : strategy_names()) {
      for (const bool slice : {false, true}) {
        toy::Scenario scenario = base;
        scenario.config.slice = slice;
        const auto strategy = make_strategy(name, scenario.config);
        const toy::Outcome outcome = toy::run(scenario, *strategy);
        report(scenario.name + " " + std::string(name) + (slice ? " slice" : ""), outcome);
        INFO(scenario.name << ' ' << name << (slice ? " slice" : " volume"));
        CHECK(outcome.finished);
        CHECK(outcome.known_part >= 0.99);
        CHECK(outcome.goals < 150);
      }
    }
  }
}

TEST_CASE("a world without free space ends at once") {
  toy::World world({{0, 0, 0}, {4, 4, 3}}, 0.2);
  world.fill({{0, 0, 0}, {4, 4, 3}}, true);
  const toy::Scenario scenario = scenario_of("solid", world, toy::lidar(), {{2.0, 2.0, 1.2}});
  for (const std::string_view name : strategy_names()) {
    const auto strategy = make_strategy(name, scenario.config);
    const toy::Outcome outcome = toy::run(scenario, *strategy);
    CHECK(outcome.finished);
    CHECK(outcome.goals == 0);
  }
}

TEST_CASE("unknown strategies and damaged states are refused") {
  const toy::World world({{0, 0, 0}, {4, 4, 3}}, 0.2);
  const CoverageConfig config = toy::config_for(world, toy::lidar());
  CHECK_THROWS_AS(make_strategy("nearby", config), InputError);
  CoverageConfig endless = config;
  endless.hybrid_first = "hybrid";
  CHECK_THROWS_AS(make_strategy("hybrid", endless), InputError);
  for (const std::string_view name : strategy_names()) {
    const auto strategy = make_strategy(name, config);
    CHECK(strategy->name() == name);
    Goal goal;
    strategy->report_failure(goal, 3.0);
    const std::string state = strategy->save_state();
    const auto other = make_strategy(name, config);
    other->load_state(state);
    CHECK(other->save_state() == state);
    for (std::size_t length = 0; length < state.size(); length += 7)
      CHECK_THROWS_AS(other->load_state(state.substr(0, length)), InputError);
    CHECK_THROWS_AS(other->load_state("[]"), InputError);
    CHECK(other->save_state() == state);
  }
}
