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
using test::ToySimulation;

namespace {

std::vector<mapping::OccupancyMap> only(mapping::OccupancyMap map) {
  std::vector<mapping::OccupancyMap> maps;
  maps.push_back(std::move(map));
  return maps;
}

double no_clock() { return 0.0; }

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

/// Counts events and notes who has just begun to look for a goal.
struct RecordingLog final : explore::ExplorationLog {
  void on_state(double, std::size_t uav, std::string_view state) override {
    searching[uav] = state == "find_goal" || state == "radial_scan";
  }
  void on_event(double, std::size_t, std::string_view event, std::string_view) override {
    ++events[std::string(event)];
  }

  std::map<std::string, int> events;
  std::map<std::size_t, bool> searching;
};

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

/// 2 m wide and 2.4 m high inside.
sim3d::TriangleMesh hall(float length_m) {
  sim3d::TriangleMesh mesh;
  const float end_m = length_m + 0.15F;
  test::add_box(mesh, {-0.15F, -0.15F, -0.15F}, {end_m, 2.15F, 0.0F});
  test::add_box(mesh, {-0.15F, -0.15F, 2.4F}, {end_m, 2.15F, 2.55F});
  test::add_box(mesh, {-0.15F, -0.15F, 0.0F}, {0.0F, 2.15F, 2.4F});
  test::add_box(mesh, {length_m, -0.15F, 0.0F}, {end_m, 2.15F, 2.4F});
  test::add_box(mesh, {0.0F, -0.15F, 0.0F}, {length_m, 0.0F, 2.4F});
  test::add_box(mesh, {0.0F, 2.0F, 0.0F}, {length_m, 2.15F, 2.4F});
  return mesh;
}

/// One UAV that sees all round, and far.
explore::FleetConfig hall_config(double length_m) {
  auto config = test::toy_config();
  config.task_box = {{0.0, 0.0, 0.0}, {length_m, 2.0, 2.4}};
  config.sensor.kind = SensorKind::kLidar;
  config.sensor.azimuth_fov_rad = 2.0 * kPi;
  config.sensor.elevation_lo_rad = rad_from_deg(-60.0);
  config.sensor.elevation_hi_rad = rad_from_deg(60.0);
  config.sensor.max_range_m = 12.0;
  config.sensor.rays_azimuth = 720;
  config.sensor.rays_elevation = 121;
  return config;
}

/// Makes up goals for one UAV, whatever is known.
struct MadeUpGoals : coverage3d::CoverageStrategy {
  virtual std::optional<Eigen::Vector3d> goal_m(const coverage3d::UavView& uav) const = 0;

  std::string_view name() const override { return "made up"; }
  planning3d::MotionRule motion_rule() const override { return planning3d::MotionRule::volume(); }
  coverage3d::Assignment assign(const planning3d::FreeSpace&, const coverage3d::AssignmentRequest& r) override {
    coverage3d::Assignment assignment{{std::nullopt}, 1, 0};
    const auto at_m = r.uavs[0].wants_goal ? goal_m(r.uavs[0]) : std::nullopt;
    if (!at_m) return assignment;
    coverage3d::Goal& goal = assignment.goals[0].emplace();
    goal.position_m = goal.target_m = *at_m;
    goal.gain_m3 = 10.0;
    return assignment;
  }
  bool still_useful(const planning3d::FreeSpace&, const coverage3d::Goal&) override { return true; }
  void report_failure(const coverage3d::Goal&, double) override {}
  std::string save_state() const override { return {}; }
  void load_state(const std::string&) override {}
};

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

TEST_CASE("a UAV gives way to what comes into sight too late to brake before it") {
  // From end to end of a hall, until a sill appears a little in its way.
  struct ToAndFro final : MadeUpGoals {
    std::optional<Eigen::Vector3d> goal_m(const coverage3d::UavView& uav) const override {
      if (uav.velocity_mps.norm() > 0.1) return std::nullopt;  // no other way at once
      return Eigen::Vector3d(uav.position_m.x() < 3.0 ? 5.4 : 0.6, 1.0, 1.25);
    }
  };
  auto config = hall_config(6.0);
  config.time_limit_s = 30.0;
  config.own_coverage = [](const coverage3d::CoverageConfig&) { return std::make_unique<ToAndFro>(); };
  const sim3d::TriangleMesh empty = hall(6.0F);
  const Aabb sill{{3.6, 0.0, 0.0}, {4.6, 2.0, 1.09}};
  const bool bit_by_bit = GENERATE(false, true);  // its far end first
  sim3d::TriangleMesh with_end = empty;
  test::add_box(with_end, {4.4F, 0.0F, 0.0F}, sill.max_m.cast<float>());
  sim3d::TriangleMesh with_sill = empty;
  test::add_box(with_sill, sill.min_m.cast<float>(), sill.max_m.cast<float>());
  const Eigen::Vector3d start_m(0.6, 1.0, 1.25);
  ToySimulation before(empty, config, {start_m});
  ToySimulation at_first(bit_by_bit ? with_end : with_sill, config, {start_m});
  ToySimulation after(with_sill, config, {start_m});
  struct LateSensor final : DepthSource {
    LateSensor(const std::vector<DepthSource*>& all, const Vehicle& flown) : sensors(all), uav(flown) {}
    const SensorModel& model() const override { return sensors[0]->model(); }
    Scan capture(const Pose& T_world_sensor, double time_s) override {
      const bool near = time_s > 6.0 && uav.state().velocity_mps.x() > 0.5 && uav.state().position_m.x() > 2.7;
      if (stage > 0 || near) stage = std::min(stage + 1, 2);
      return sensors[static_cast<std::size_t>(stage)]->capture(T_world_sensor, time_s);
    }
    std::vector<DepthSource*> sensors;
    const Vehicle& uav;
    int stage = 0;
  } sensor({before.sensors[0].get(), at_first.sensors[0].get(), after.sensors[0].get()}, *before.vehicles[0]);
  RecordingLog log;
  Fleet fleet(config, {{&sensor, before.vehicles[0].get()}}, log, no_clock);
  double clearance_m = std::numeric_limits<double>::infinity();
  while (fleet.step() && log.events["emergency_stop"] == 0) {
  }
  REQUIRE(sensor.stage > 0);
  REQUIRE(log.events["emergency_stop"] == 1);
  for (int tick = 0; tick < 20; ++tick) {
    const Eigen::Vector3d at_m = fleet.uav_state(0).position_m;
    clearance_m = std::min(clearance_m, (at_m.cwiseMax(sill.min_m).cwiseMin(sill.max_m) - at_m).norm());
    fleet.step();
  }
  CHECK(clearance_m >= config.robot.radius_m);
}

TEST_CASE("a long way is flown part by part, without a stop between, resumed or not") {
  struct FarEnd final : MadeUpGoals {
    std::optional<Eigen::Vector3d> goal_m(const coverage3d::UavView& uav) const override {
      if (uav.position_m.x() > 11.3) return std::nullopt;
      return Eigen::Vector3d(11.4, 1.0, 1.25);
    }
  };
  struct Motions final : explore::ExplorationLog {
    void on_trajectory(double, std::size_t, const Trajectory& motion) override {
      longest_m = std::max(longest_m, motion.length_m(motion.start_time_s(), motion.end_time_s()));
      ++count;
    }
    double longest_m = 0.0;
    int count = 0;
  };
  auto config = hall_config(12.0);
  config.limits.speed_mps = 0.5;
  config.sensor.elevation_lo_rad = rad_from_deg(-20.0);  // rays near enough to each other at the far end
  config.sensor.elevation_hi_rad = rad_from_deg(20.0);
  config.replan_period_s = GENERATE(1.5, 100.0);
  config.return_to = explore::ReturnTo::kHome;
  config.own_coverage = [](const coverage3d::CoverageConfig&) { return std::make_unique<FarEnd>(); };
  const Eigen::Vector3d start_m(0.6, 1.0, 1.25);
  ToySimulation sim(hall(12.0F), config, {start_m});
  Motions log;
  Fleet fleet(config, sim.doors(), log, no_clock);
  const bool resumed = GENERATE(false, true);
  ToySimulation again(hall(12.0F), config, {start_m});
  Fleet later(config, again.doors(), log, no_clock);
  Fleet* flown = &fleet;
  while (flown->step() && flown->uav_state(0).position_m.x() < 11.39) {
    const MotionState state = flown->uav_state(0);
    if (state.position_m.x() > 1.6 && state.position_m.x() < 10.4) REQUIRE(state.velocity_mps.x() > 0.4);
    if (resumed && flown == &fleet && state.position_m.x() > 3.0) {
      const auto file = testing::test_folder() / "part_way.ot";
      mapping::save_octomap(fleet.map(), file);
      later.load_state(fleet.save_state(),
                       only(mapping::map_from_octree(*mapping::load_octree(file), fleet.map().grid())));
      flown = &later;
    }
  }
  CHECK(log.count >= 3);
  CHECK(log.longest_m > 4.9);
  CHECK(log.longest_m < 7.1);  // 10 s; what is left then is no part of its own when shorter than 2 m
  while (flown->step()) {
  }
  CHECK(log.longest_m > 10.0);  // home it goes all the way
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
