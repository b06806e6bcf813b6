#include "explore/fleet.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "sim3d/ground_truth.hpp"
#include "tests/explore/toy_building.hpp"
#include "tests/test_folder.hpp"

#include <octomap/OcTree.h>
#include <catch2/catch.hpp>

#include <filesystem>
#include <limits>
#include <map>
#include <string>

using namespace stairwell;
using explore::Fleet;
using explore::StopReason;
using test::no_clock;
using test::only;
using test::RecordingLog;
using test::ToySimulation;

namespace {

/// Share of the voxels strictly inside the rooms that are known.
double known_share(const mapping::OccupancyMap& map) {
  std::size_t known = 0;
  std::size_t all = 0;
  for (double z = 0.15; z < 2.3; z += 0.1) {
    for (double y = 0.15; y < 3.9; y += 0.1) {
      for (double x = 0.15; x < 5.9; x += 0.1) {
        if (std::abs(x - 3.0) < 0.2) continue;
        ++all;
        if (map.at(Eigen::Vector3d(x, y, z)) != Occupancy::kUnknown) ++known;
      }
    }
  }
  return static_cast<double>(known) / static_cast<double>(all);
}

/// Sees nothing any more from some time on.
class BlindedSensor final : public DepthSource {
 public:
  BlindedSensor(DepthSource& sensor, double from_s) : sensor_(sensor), from_s_(from_s) {}
  const SensorModel& model() const override { return sensor_.model(); }
  Scan capture(const Pose& T_world_sensor, double time_s) override {
    Scan scan = sensor_.capture(T_world_sensor, time_s);
    if (time_s >= from_s_) scan.points_m.clear();
    return scan;
  }

 private:
  DepthSource& sensor_;
  double from_s_;
};

/// Who looks for a goal hovers; only an emergency stop makes a UAV look for one while it still brakes.
bool searching_in_flight(const Fleet& fleet, RecordingLog& log) {
  for (const auto& [uav, searching] : log.searching) {
    if (searching && fleet.uav_state(uav).velocity_mps.norm() > 1e-3) return log.events["emergency_stop"] == 0;
  }
  return false;
}

/// Distance of a point in test::two_rooms() from what is solid.
double clearance_in_two_rooms(const Eigen::Vector3d& at_m) {
  const Aabb rooms{{0.0, 0.0, 0.0}, {6.0, 4.0, 2.4}};
  double least_m = std::min((at_m - rooms.min_m).minCoeff(), (rooms.max_m - at_m).minCoeff());
  for (const Aabb& wall : {Aabb{{2.95, 0.0, 0.0}, {3.05, 1.5, 2.4}}, Aabb{{2.95, 2.6, 0.0}, {3.05, 4.0, 2.4}}}) {
    least_m = std::min(least_m, (at_m.cwiseMax(wall.min_m).cwiseMin(wall.max_m) - at_m).norm());
  }
  return least_m;
}

double least_distance(const Fleet& fleet) {
  double least_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    for (std::size_t j = i + 1; j < fleet.size(); ++j) {
      least_m = std::min(least_m, (fleet.uav_state(i).position_m - fleet.uav_state(j).position_m).norm());
    }
  }
  return least_m;
}

}  // namespace

TEST_CASE("a fleet that sees all round explores without turning") {
  explore::FleetConfig config = test::toy_config();
  config.sensor.kind = SensorKind::kLidar;
  config.sensor.azimuth_fov_rad = 2.0 * kPi;
  config.sensor.rays_azimuth = 360;
  ToySimulation simulation(test::two_rooms(), config, {{1.0, 1.0, 1.0}, {1.0, 3.0, 1.0}});
  RecordingLog log;
  Fleet fleet(config, simulation.doors(), log, no_clock);
  double flown_m = 0.0;
  Eigen::Vector3d last_m = fleet.uav_state(0).position_m;
  while (fleet.step()) {
    flown_m += (fleet.uav_state(0).position_m - last_m).norm();
    last_m = fleet.uav_state(0).position_m;
    for (std::size_t uav = 0; uav < fleet.size(); ++uav) REQUIRE(fleet.uav_state(uav).yaw_rad == 0.0);
  }
  CHECK(flown_m > 1.0);
  CHECK(known_share(fleet.map()) > 0.97);
}

TEST_CASE("UAVs side by side share the first look round") {
  struct FirstGoal final : explore::ExplorationLog {
    void on_goal(double time_s, std::size_t uav, const Eigen::Vector3d&, double, std::string_view) override {
      at_s.emplace(uav, time_s);
    }
    std::map<std::size_t, double> at_s;
  };
  const auto first_goals_s = [](const std::vector<Eigen::Vector3d>& starts_m) {
    const auto config = test::toy_config();
    ToySimulation sim(test::two_rooms(), config, starts_m);
    FirstGoal log;
    Fleet fleet(config, sim.doors(), log, no_clock);
    while (log.at_s.size() < starts_m.size() && fleet.time_s() < 20.0 && fleet.step()) {
    }
    return log.at_s;
  };
  const double alone_s = first_goals_s({{1.0, 1.0, 1.0}})[0];
  REQUIRE(alone_s > 2.0);
  auto beside_s = first_goals_s({{1.0, 1.0, 1.0}, {1.0, 1.8, 1.0}});
  CHECK(beside_s[0] < alone_s - 0.5);
  CHECK(beside_s[1] < alone_s - 0.5);
  CHECK(first_goals_s({{1.0, 1.0, 1.0}, {5.0, 2.0, 1.0}})[0] == Approx(alone_s));  // too far to look for each other
}

TEST_CASE("one UAV explores two rooms in either mode and says that nothing is left") {
  const bool slice = GENERATE(false, true);
  auto config = test::toy_config();
  config.mode = slice ? explore::Mode::kSlice : explore::Mode::kVolume;
  config.coverage = slice ? "layers" : "frontiers";
  ToySimulation sim(test::two_rooms(), config, {{1.0, 1.0, 1.0}});
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  const sim3d::GroundTruth truth({"two rooms", test::two_rooms(), config.task_box}, GridSpec(config.task_box, 0.1));
  bool touched = false;
  while (fleet.step()) {
    touched = touched || !truth.sphere_free(fleet.uav_state(0).position_m, config.robot.radius_m - 0.002);
  }
  INFO("slice " << slice << ", ended at " << fleet.time_s() << " s");
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(known_share(fleet.map()) >= 0.98);
  CHECK_FALSE(touched);
  CHECK(fleet.stats().fallbacks == 0);
}

TEST_CASE("a fleet stops when goal after goal shows nothing") {
  auto config = test::toy_config();
  config.patience_s = 1e6;
  const auto explored = [](const explore::FleetConfig& some) {
    ToySimulation sim(test::two_rooms(), some, {{1.0, 1.0, 1.0}});
    BlindedSensor sensor(*sim.sensors[0], 4.0);
    RecordingLog log;
    Fleet fleet(some, {{&sensor, sim.vehicles[0].get()}}, log, no_clock);
    while (fleet.step()) {
    }
    return log.events;
  };
  config.fruitless_visits = 1000;
  auto events = explored(config);
  CHECK(events["goal_failed"] > 6);
  CHECK(events["winding_down"] == 0);
  config.fruitless_visits = 6;
  events = explored(config);
  CHECK(events["goal_failed"] == 12);  // over the first six the map had grown from nothing
  CHECK(events["winding_down"] == 1);
  config.min_growth = 0.0;  // nothing is less
  CHECK(explored(config)["winding_down"] == 0);
}

TEST_CASE("UAVs keep their distance in a small building and share the work") {
  auto config = test::toy_config();
  ToySimulation sim(test::two_rooms(), config, {{0.6, 0.6, 1.0}, {0.6, 2.0, 1.0}, {0.6, 3.4, 1.0}});
  RecordingLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  double least_m = least_distance(fleet);
  bool searched_in_flight = false;
  while (fleet.step()) {
    least_m = std::min(least_m, least_distance(fleet));
    searched_in_flight = searched_in_flight || searching_in_flight(fleet, log);
  }
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(known_share(fleet.map()) >= 0.98);
  CHECK(least_m >= config.fellow_clearance_m - 0.02);
  CHECK_FALSE(searched_in_flight);
  CHECK(log.events["command_refused"] == 0);
  // Who was told that there is nothing for it asks again twice a second, not at every tick.
  CHECK(static_cast<double>(fleet.stats().plan_ms.size()) <= 4.0 * fleet.time_s());
}

TEST_CASE("UAVs that have come nearer to each other than they may part and explore on") {
  auto config = test::toy_config();
  config.time_limit_s = 120.0;
  const Eigen::Vector3d apart_m = GENERATE(Eigen::Vector3d(0.35, 0.0, 0.0), Eigen::Vector3d(0.0, 0.35, 0.0),
                                           Eigen::Vector3d(-0.25, -0.25, 0.0), Eigen::Vector3d(0.1, 0.2, 0.2));
  const Eigen::Vector3d start_m(1.6, 2.0, 1.2);
  ToySimulation sim(test::two_rooms(), config, {start_m, start_m + apart_m});
  RecordingLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  double least_m = least_distance(fleet);
  const double near_m = least_m;
  while (fleet.step()) least_m = std::min(least_m, least_distance(fleet));
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(known_share(fleet.map()) >= 0.98);
  CHECK(least_m >= near_m - 1e-3);
  CHECK(least_distance(fleet) >= config.fellow_clearance_m);
}

TEST_CASE("UAVs that avoid each other reciprocally explore a small building without touching") {
  auto config = test::toy_config();
  config.avoidance = explore::Avoidance::kOrca;
  ToySimulation sim(test::two_rooms(), config, {{0.6, 0.6, 1.0}, {0.6, 2.0, 1.0}, {0.6, 3.4, 1.0}});
  RecordingLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  double least_m = least_distance(fleet);
  double clearance_m = std::numeric_limits<double>::infinity();
  while (fleet.step()) {
    least_m = std::min(least_m, least_distance(fleet));
    for (std::size_t i = 0; i < fleet.size(); ++i) {
      clearance_m = std::min(clearance_m, clearance_in_two_rooms(fleet.uav_state(i).position_m));
    }
  }
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(known_share(fleet.map()) >= 0.98);
  CHECK(least_m > 2.0 * config.robot.radius_m);
  CHECK(clearance_m > config.robot.radius_m);
  CHECK(log.events["avoiding"] > 0);
}

TEST_CASE("a landed UAV takes off, explores and lands again") {
  auto config = test::toy_config();
  ToySimulation sim(test::two_rooms(), config, {{1.0, 1.0, 0.0}}, true);
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  double highest_m = 0.0;
  while (fleet.step()) highest_m = std::max(highest_m, fleet.uav_state(0).position_m.z());
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(highest_m >= 0.9);
  CHECK(fleet.uav_state(0).position_m.z() < 0.6);
  CHECK(fleet.exploration_end_s() <= fleet.time_s());
}

TEST_CASE("the same seed flies the same way when planning time is not charged, by any number of threads") {
  auto config = test::toy_config();
  config.threads = GENERATE(1, 2, 3);
  std::vector<Eigen::Vector3d> ends_m;
  for (int run = 0; run < 2; ++run) {
    if (run == 1) config.threads = 1;
    ToySimulation sim(test::two_rooms(), config, {{1.0, 1.0, 1.0}, {1.0, 3.0, 1.0}});
    explore::ExplorationLog log;
    Fleet fleet(config, sim.doors(), log, no_clock);
    while (fleet.time_s() < 12.0 && fleet.step()) {
    }
    ends_m.push_back(fleet.uav_state(0).position_m);
    ends_m.push_back(fleet.uav_state(1).position_m);
  }
  CHECK(ends_m[0] == ends_m[2]);
  CHECK(ends_m[1] == ends_m[3]);
}

TEST_CASE("a fleet loaded from its saved state carries on to the end") {
  const auto config = test::toy_config();
  const auto file = testing::test_folder() / "fleet_state.ot";
  std::string state;
  double saved_at_s = 0.0;
  std::vector<bool> hits;
  const auto hits_of = [](const mapping::OccupancyMap& map) {
    std::vector<bool> all(map.grid().voxel_count());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = map.ever_hit(map.grid().voxel(i));
    return all;
  };
  {
    ToySimulation sim(test::two_rooms(), config, {{1.0, 1.0, 1.0}});
    explore::ExplorationLog log;
    Fleet fleet(config, sim.doors(), log, no_clock);
    while (fleet.time_s() < 6.0 && fleet.step()) {
    }
    state = fleet.save_state();
    saved_at_s = fleet.time_s();
    hits = hits_of(fleet.map());
    mapping::save_octomap(fleet.map(), file);
  }
  ToySimulation sim(test::two_rooms(), config, {{1.0, 1.0, 1.0}});
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  fleet.load_state(state, only(mapping::map_from_octree(*mapping::load_octree(file), fleet.map().grid())));
  CHECK(fleet.time_s() == Approx(saved_at_s));
  CHECK(hits_of(fleet.map()) == hits);
  while (fleet.step()) {
  }
  CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  CHECK(known_share(fleet.map()) >= 0.98);

  SECTION("a damaged state is refused") {
    ToySimulation other(test::two_rooms(), config, {{1.0, 1.0, 1.0}});
    Fleet fresh(config, other.doors(), log, no_clock);
    for (const std::size_t length : {std::size_t{0}, state.size() / 2, state.size() - 1}) {
      CHECK_THROWS_AS(fresh.load_state(state.substr(0, length), only(mapping::OccupancyMap(fresh.map().grid()))),
                      InputError);
    }
  }
}

TEST_CASE("a fleet refuses what it cannot fly with") {
  explore::ExplorationLog log;
  auto config = test::toy_config();
  CHECK_THROWS_AS(Fleet(config, {}, log, no_clock), InputError);
  config.avoidance = explore::Avoidance::kOrca;
  config.motion = explore::MotionModel::kStep;
  CHECK(config.problems().size() == 1);
  config.resolution_m = std::numeric_limits<double>::quiet_NaN();
  ToySimulation sim(test::two_rooms(), test::toy_config(), {{1.0, 1.0, 1.0}});
  CHECK_THROWS_AS(Fleet(config, sim.doors(), log, no_clock), InputError);
}

TEST_CASE("settings that must be positive are named when they are not") {
  using explore::FleetConfig;
  CHECK(test::toy_config().problems().empty());
  for (double FleetConfig::*const setting :
       {&FleetConfig::resolution_m, &FleetConfig::step_delta_m, &FleetConfig::step_period_s, &FleetConfig::time_limit_s,
        &FleetConfig::radial_scan_radps, &FleetConfig::replan_period_s, &FleetConfig::patience_s,
        &FleetConfig::blacklist_radius_m, &FleetConfig::blacklist_time_s}) {
    for (const double value : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
      FleetConfig config = test::toy_config();
      config.*setting = value;
      CHECK(config.problems().size() == 1);
    }
  }
}

TEST_CASE("the run stops when asked and at its time limit") {
  auto config = test::toy_config();
  config.time_limit_s = 3.0;
  ToySimulation sim(test::two_rooms(), config, {{1.0, 1.0, 1.0}});
  explore::ExplorationLog log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  SECTION("limit") {
    while (fleet.step()) {
    }
    CHECK(fleet.stop_reason() == StopReason::kTimeLimit);
    CHECK(fleet.time_s() == Approx(3.0));
  }
  SECTION("asked") {
    fleet.step();
    fleet.stop(StopReason::kInterrupted);
    CHECK_FALSE(fleet.step());
    CHECK(fleet.stop_reason() == StopReason::kInterrupted);
  }
}
