#include "core/errors.hpp"
#include "toy_building.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

using namespace stairwell;
using explore::Fleet;
using explore::ReturnTo;
using explore::StopReason;
using test::no_clock;
using test::ToySimulation;

namespace {

const std::vector<Eigen::Vector3d> kTwoStarts_m{{0.8, 0.8, 1.0}, {0.8, 3.2, 1.0}};

/// When each event first came, and goals by UAV.
struct EventLog final : explore::ExplorationLog {
  void on_event(double time_s, std::size_t uav, std::string_view event, std::string_view) override {
    first_s.try_emplace({std::string(event), uav}, time_s);
  }
  void on_goal(double time_s, std::size_t uav, const Eigen::Vector3d& goal_m, double, std::string_view) override {
    goals[uav].emplace_back(time_s, goal_m);
  }
  std::map<std::pair<std::string, std::size_t>, double> first_s;
  std::map<std::size_t, std::vector<std::pair<double, Eigen::Vector3d>>> goals;
};

void finish(Fleet& fleet) {
  while (fleet.step()) {
  }
}

}  // namespace

TEST_CASE("at the end UAVs go home, land or stay") {
  auto config = test::toy_config();
  config.return_to = GENERATE(ReturnTo::kHome, ReturnTo::kLand, ReturnTo::kStay);
  const bool landed = GENERATE(false, true);
  const double start_z_m = landed ? 0.0 : 1.0;
  ToySimulation sim(test::two_rooms(), config, {{0.8, 0.8, start_z_m}, {0.8, 3.2, start_z_m}}, landed);
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  finish(fleet);
  REQUIRE(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(fleet.exploration_end_s() <= fleet.time_s());
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const Eigen::Vector3d at_m = fleet.uav_state(i).position_m;
    const double aside_m = (at_m - kTwoStarts_m[i]).head<2>().norm();
    INFO("UAV " << i << " ends at " << at_m.transpose());
    if (config.return_to == ReturnTo::kHome) CHECK(aside_m < 0.3);
    if (landed && config.return_to != ReturnTo::kStay) CHECK(at_m.z() < 0.6);
  }
  if (config.return_to == ReturnTo::kStay) CHECK(fleet.time_s() - fleet.exploration_end_s() < 1.5);
}

TEST_CASE("a UAV goes back before its battery is empty, and others do its work") {
  auto config = test::toy_config();
  config.return_to = ReturnTo::kHome;
  config.battery_s = 34.0;
  ToySimulation sim(test::two_rooms(), config, {{0.8, 0.8, 0.0}}, true);
  EventLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  finish(fleet);
  REQUIRE(log.first_s.contains({"returns", 0}));
  CHECK(fleet.time_s() <= config.battery_s);
  CHECK(fleet.stop_reason() == StopReason::kBattery);
  CHECK(fleet.stats().out_of_battery == 1);
  CHECK(fleet.stats().open_targets > 0);
  CHECK((fleet.uav_state(0).position_m - Eigen::Vector3d(0.8, 0.8, 0.0)).head<2>().norm() < 0.3);
  CHECK(fleet.uav_state(0).position_m.z() < 0.6);
}

TEST_CASE("nobody lands on a fellow") {
  auto config = test::toy_config();
  config.battery_s = 3.0;
  config.return_to = ReturnTo::kLand;
  const double lower_z_m = GENERATE(0.6, 0.75);
  ToySimulation sim(test::two_rooms(), config, {{0.8, 0.8, lower_z_m + 0.65}, {0.9, 0.8, lower_z_m}});
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  double least_m = 1e9;
  do {
    least_m = std::min(least_m, (fleet.uav_state(0).position_m - fleet.uav_state(1).position_m).norm());
  } while (fleet.step());
  CHECK(least_m > 0.5);
  CHECK(fleet.uav_state(1).position_m.z() < 0.6);
}

TEST_CASE("a lost UAV stays an obstacle and gives its task back after a time-out") {
  auto config = test::toy_config();
  config.losses = {{1, 4.0}};
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  EventLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  Eigen::Vector3d lost_m = Eigen::Vector3d::Zero();
  double least_m = 1e9;
  while (fleet.step()) {
    if (fleet.time_s() < 6.0) lost_m = fleet.uav_state(1).position_m;
    least_m = std::min(least_m, (fleet.uav_state(0).position_m - fleet.uav_state(1).position_m).norm());
  }
  CHECK(log.first_s.at({"lost", 1}) == Approx(4.0));
  CHECK(fleet.uav_state(1).position_m == lost_m);
  for (const auto& [time_s, goal_m] : log.goals[1]) CHECK(time_s <= 4.0);
  CHECK(least_m >= config.fellow_clearance_m - 0.02);
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(fleet.stats().lost == 1);
  std::size_t unknown = 0;
  for (double y = 0.3; y < 3.8; y += 0.1)
    for (double x = 3.4; x < 5.8; x += 0.1)
      unknown += fleet.map().at(Eigen::Vector3d(x, y, 1.0)) == Occupancy::kUnknown ? 1 : 0;
  CHECK(unknown == 0);
}

TEST_CASE("a fleet that lost all its UAVs stops and says so") {
  auto config = test::toy_config();
  config.losses = {{0, 2.0}, {1, 3.0}};
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  finish(fleet);
  CHECK(fleet.stop_reason() == StopReason::kAllLost);
  CHECK(fleet.time_s() < 10.0);
}

TEST_CASE("a fleet whose UAVs are lost or go home is saved and carries on") {
  auto config = test::toy_config();
  config.return_to = ReturnTo::kHome;
  config.battery_s = 40.0;
  config.losses = {{1, 3.0}};
  std::string state;
  std::vector<mapping::OccupancyMap> maps;
  explore::ExplorationLog log;
  {
    ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
    Fleet fleet(config, sim.doors(), log, no_clock);
    while (fleet.time_s() < 5.0 && fleet.step()) {
    }
    state = fleet.save_state();
    maps.push_back(fleet.map().clone());
  }
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  Fleet fleet(config, sim.doors(), log, no_clock);
  fleet.load_state(state, std::move(maps));
  const Eigen::Vector3d lost_m = fleet.uav_state(1).position_m;
  finish(fleet);
  CHECK(fleet.stats().lost == 1);
  CHECK((fleet.uav_state(1).position_m - lost_m).norm() < 0.2);
  CHECK((fleet.uav_state(0).position_m - kTwoStarts_m[0]).head<2>().norm() < 0.3);
}
