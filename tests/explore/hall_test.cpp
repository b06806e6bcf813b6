#include "mapping/octomap_io.hpp"
#include "tests/explore/toy_building.hpp"
#include "tests/test_folder.hpp"

#include <octomap/OcTree.h>
#include <catch2/catch.hpp>

#include <limits>

using namespace stairwell;
using explore::Fleet;
using test::no_clock;
using test::only;
using test::RecordingLog;
using test::ToySimulation;

namespace {

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
