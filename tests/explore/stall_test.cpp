#include "toy_building.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

using namespace stairwell;
using explore::Fleet;
using explore::StopReason;
using test::ToySimulation;

namespace {

double no_clock() { return 0.0; }

const std::vector<Eigen::Vector3d> kTwoStarts_m{{0.8, 0.8, 1.0}, {0.8, 3.2, 1.0}};

/// Events of UAV 1, and goals of all.
struct StallLog final : explore::ExplorationLog {
  void on_event(double time_s, std::size_t uav, std::string_view event, std::string_view) override {
    if (uav == 1) events[std::string(event)].push_back(time_s);
  }
  void on_goal(double time_s, std::size_t uav, const Eigen::Vector3d& goal_m, double, std::string_view) override {
    goals.push_back({time_s, uav, goal_m});
  }
  struct Given {
    double time_s;
    std::size_t uav;
    Eigen::Vector3d goal_m;
  };
  std::map<std::string, std::vector<double>> events;
  std::vector<Given> goals;
};

/// Sends two UAVs from corner to corner of the first room, across each other's ways.
class ToAndFro final : public coverage3d::CoverageStrategy {
 public:
  std::string_view name() const override { return "to and fro"; }
  planning3d::MotionRule motion_rule() const override { return planning3d::MotionRule::volume(); }
  coverage3d::Assignment assign(const planning3d::FreeSpace&, const coverage3d::AssignmentRequest& request) override {
    static const std::vector<Eigen::Vector3d> kCorners_m{
        {0.6, 0.6, 1.0}, {2.4, 3.4, 1.0}, {2.4, 0.6, 1.0}, {0.6, 3.4, 1.0}};
    coverage3d::Assignment assignment;
    assignment.open_targets = 1;
    for (std::size_t i = 0; i < request.uavs.size(); ++i) {
      std::optional<coverage3d::Goal>& goal = assignment.goals.emplace_back();
      const coverage3d::UavView& uav = request.uavs[i];
      if (!uav.wants_goal) continue;
      const bool there = (uav.position_m - kCorners_m[2 * i]).norm() < (uav.position_m - kCorners_m[2 * i + 1]).norm();
      goal.emplace();
      goal->position_m = goal->target_m = kCorners_m[2 * i + (there ? 1 : 0)];
      goal->yaw_rad = uav.yaw_rad;
      goal->gain_m3 = 10.0;
    }
    return assignment;
  }
  bool still_useful(const planning3d::FreeSpace&, const coverage3d::Goal&) override { return false; }
  void report_failure(const coverage3d::Goal&, double) override {}
  std::string save_state() const override { return {}; }
  void load_state(const std::string&) override {}
};

/// In the second room.
std::size_t unknown_voxels(const mapping::OccupancyMap& map) {
  std::size_t unknown = 0;
  for (double y = 0.3; y < 3.8; y += 0.1)
    for (double x = 3.4; x < 5.8; x += 0.1)
      unknown += map.at(Eigen::Vector3d(x, y, 1.0)) == Occupancy::kUnknown ? 1 : 0;
  return unknown;
}

/// Least distance between UAVs 0 and 1 until the end.
double fly(Fleet& fleet) {
  double least_m = 1e9;
  while (fleet.step())
    least_m = std::min(least_m, (fleet.uav_state(0).position_m - fleet.uav_state(1).position_m).norm());
  return least_m;
}

}  // namespace

TEST_CASE("a stalled UAV stays an obstacle and gives its task back after a time-out") {
  auto config = test::toy_config();
  const bool landed = GENERATE(false, true);
  config.return_to = GENERATE(explore::ReturnTo::kHome, explore::ReturnTo::kLand);
  config.stalls = {{1, landed ? 0.0 : 1.5}};
  config.stalled_after_s = 5.0;
  std::vector<Eigen::Vector3d> starts_m = kTwoStarts_m;
  if (landed) {
    for (Eigen::Vector3d& start_m : starts_m) start_m.z() = 0.0;
  }
  ToySimulation sim(test::two_rooms(), config, starts_m, landed);
  StallLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  const double least_m = fly(fleet);
  REQUIRE(log.events.contains("stalled"));
  CHECK(log.events["stalled"].front() >= config.stalls.front().from_s + 5.0 - 0.2);
  CHECK(log.events["stalled"].front() <= config.stalls.front().from_s + 8.0);
  CHECK(log.events["goal_failed"].empty());
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(fleet.time_s() < 100.0);
  CHECK(fleet.stats().stalls == 1);
  CHECK(fleet.stats().stalled == 1);
  CHECK(least_m >= config.fellow_clearance_m - 0.02);
  CHECK(unknown_voxels(fleet.map()) == 0);
}

TEST_CASE("a UAV that stalls for a while goes on afterwards, alone or not") {
  auto config = test::toy_config();
  config.stalls = {{1, 1.5, 40.0}};
  config.stalled_after_s = 4.0;
  const bool alone = GENERATE(false, true);
  if (alone) config.losses = {{0, 2.0}};
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  StallLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  const double least_m = fly(fleet);
  CHECK(log.events["task_given_back"].size() >= 1);
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(unknown_voxels(fleet.map()) == 0);
  CHECK(least_m >= config.fellow_clearance_m - 0.02);
  CHECK(fleet.stats().stalls == 1);
  if (!alone) return;
  REQUIRE(log.events.contains("moves_again"));
  CHECK(log.events["moves_again"].front() > 40.0);
  CHECK(log.events["moves_again"].front() < 40.0 + config.stalled_after_s + 3.0);
}

TEST_CASE("UAVs keep clear of one that brakes in their way, whenever it does") {
  auto config = test::toy_config();
  config.resolution_m = 0.15;
  config.time_limit_s = 60.0;
  config.sensor.rate_hz = GENERATE(10.0, 2.0);  // and ticks
  config.own_coverage = [](const coverage3d::CoverageConfig&) { return std::make_unique<ToAndFro>(); };
  explore::ExplorationLog log;
  double least_m = 1e9;
  for (double from_s = 4.0; from_s < 7.0; from_s += 0.3) {
    config.stalls.clear();
    for (double at_s = from_s; at_s < config.time_limit_s; at_s += 2.9) config.stalls.push_back({1, at_s, at_s + 1.6});
    ToySimulation sim(test::two_rooms(), config, {{0.6, 0.6, 1.0}, {2.4, 0.6, 1.0}});
    Fleet fleet(config, sim.doors(), log, no_clock);
    least_m = std::min(least_m, fly(fleet));
  }
  CHECK(least_m >= config.fellow_clearance_m - 0.02);
}

TEST_CASE("a UAV that stalls beside a lost one goes on afterwards, however little the fleet sees meanwhile") {
  auto config = test::toy_config();
  config.stalls = {{1, 1.5, 40.0}};
  config.losses = {{0, 2.0}};
  config.stalled_after_s = 4.0;
  config.patience_s = 6.0;
  config.remainder_gain_m3 = 1e9;
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  StallLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  fly(fleet);
  CHECK(log.events.contains("moves_again"));
  CHECK(unknown_voxels(fleet.map()) == 0);
}

TEST_CASE("what a stalled UAV out of radio reach answered for is taken over by others") {
  auto config = test::toy_config();
  config.stalls = {{GENERATE(0u, 1u), GENERATE(0.5, 4.0)}};
  config.stalled_after_s = 4.0;
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  const sim3d::RangeRadio radio(0.3);
  StallLog log;
  Fleet fleet(config, sim.doors(), log, no_clock, &radio);
  const double least_m = fly(fleet);
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(fleet.time_s() < 100.0);
  CHECK(unknown_voxels(fleet.map_of(1 - config.stalls.front().uav)) == 0);
  CHECK(least_m >= config.fellow_clearance_m - 0.02);
}

TEST_CASE("a fleet with a stalled UAV is saved and carries on to the end") {
  auto config = test::toy_config();
  config.stalls = {{1, 1.5, 12.0}};
  config.stalled_after_s = 4.0;
  std::string state;
  std::vector<mapping::OccupancyMap> maps;
  explore::ExplorationLog log;
  const auto run = [&](Fleet& fleet) {
    while (fleet.step()) {
      if (state.empty() && fleet.time_s() > 7.0) {
        state = fleet.save_state();
        maps.push_back(fleet.map().clone());
      }
    }
    CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
    CHECK(fleet.stats().stalls == 1);
    CHECK(unknown_voxels(fleet.map()) == 0);
  };
  {
    ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
    Fleet fleet(config, sim.doors(), log, no_clock);
    run(fleet);
  }
  ToySimulation sim(test::two_rooms(), config, kTwoStarts_m);
  Fleet fleet(config, sim.doors(), log, no_clock);
  fleet.load_state(state, std::move(maps));
  CHECK(fleet.stats().stalled == 1);
  run(fleet);
}
