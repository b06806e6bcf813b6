#include "apps/metrics.hpp"
#include "apps/starts.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <set>

namespace stairwell::apps {

namespace {

sim3d::World room() { return sim3d::load_world(testing::write_room(testing::fresh_folder("metrics"))); }

const GridSpec& room_grid() {
  static const GridSpec grid(Aabb{{-2.3, -1.8, -0.3}, {2.3, 1.8, 2.3}}, 0.1);
  return grid;
}

MotionState at(double x, double y, double z, double vx = 0.0) {
  MotionState state;
  state.position_m = {x, y, z};
  state.velocity_mps = {vx, 0.0, 0.0};
  return state;
}

}  // namespace

TEST_CASE("coverage counts known explorable voxels, the same in steps and at once") {
  const GridSpec grid(Aabb{{0, 0, 0}, {2, 2, 2}}, 0.1);
  mapping::OccupancyMap map(grid);
  Rng rng = make_rng(3, "coverage");
  std::vector<std::uint8_t> explorable(grid.voxel_count());
  for (auto& flag : explorable) flag = rng.uniform() < 0.5 ? 1 : 0;
  CoverageMeter stepwise(grid, explorable);
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 200; ++i) {
      map.update({rng.uniform_int(-1, 20), rng.uniform_int(0, 19), rng.uniform_int(0, 19)}, rng.uniform() < 0.3);
    }
    stepwise.update(map);
    std::size_t known = 0, all = 0;
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      if (explorable[i] == 0) continue;
      ++all;
      known += map.at(grid.voxel(i)) != Occupancy::kUnknown ? 1U : 0U;
    }
    CHECK(stepwise.coverage() == Approx(static_cast<double>(known) / static_cast<double>(all)).epsilon(1e-12));
  }
  CoverageMeter at_once(grid, explorable);
  at_once.update(map);
  CHECK(at_once.coverage() == stepwise.coverage());
}

TEST_CASE("path, distances and collisions of a hand-made flight") {
  const sim3d::GroundTruth truth(room(), room_grid());
  FlightMeter meter(truth, 0.2, 2);
  const std::vector<bool> flying{false, false};
  meter.observe(0.0, {at(-1.0, -1.0, 1.0), at(-1.0, 1.0, 1.0)}, flying);
  meter.observe(0.1, {at(-0.8, -1.0, 1.0, 2.0), at(-1.0, 1.0, 1.0)}, flying);
  CHECK(meter.collisions() == 0);
  CHECK(meter.path_length_m()[0] == Approx(0.2).epsilon(0.01));
  CHECK(meter.path_length_m()[1] == 0.0);
  // Through the wall at x = -0.1..0.1 between two ticks, and out: one episode, seen only in between.
  meter.observe(0.5, {at(0.8, -1.0, 1.0), at(-1.0, 1.0, 1.0)}, flying);
  CHECK(meter.collisions() == 1);
  // Near to the other UAV, away, and near again: two episodes.
  meter.observe(1.0, {at(-1.0, 0.7, 1.0), at(-1.0, 1.0, 1.0)}, {true, true});
  const std::size_t before = meter.collisions();
  meter.observe(1.1, {at(-1.0, 0.72, 1.0), at(-1.0, 1.0, 1.0)}, flying);
  CHECK(meter.collisions() == before);
  meter.observe(1.5, {at(-1.0, 0.0, 1.0), at(-1.0, 1.0, 1.0)}, flying);
  meter.observe(2.0, {at(-1.0, 0.7, 1.0), at(-1.0, 1.0, 1.0)}, flying);
  CHECK(meter.collisions() == before + 1);
  CHECK(meter.min_distance_m() == Approx(0.28).margin(1e-6));

  const nlohmann::json saved = nlohmann::json::parse(meter.save().dump());
  FlightMeter resumed(truth, 0.2, 2);
  resumed.load(saved);
  for (FlightMeter* m : {&meter, &resumed}) m->observe(2.5, {at(-1.0, -1.0, 1.0), at(-1.0, 1.0, 1.0)}, flying);
  CHECK(resumed.save() == meter.save());
}

TEST_CASE("standing on the floor is no collision, flying into it is") {
  const sim3d::GroundTruth truth(room(), room_grid());
  FlightMeter standing(truth, 0.2, 1);
  standing.observe(0.0, {at(1.0, 0.0, 0.0)}, {true});
  standing.observe(1.0, {at(1.0, 0.0, 1.0)}, {true});
  CHECK(standing.collisions() == 0);
  CHECK(std::isnan(standing.min_distance_m()));
  standing.observe(2.0, {at(1.0, 0.0, 0.1)}, {false});
  CHECK(standing.collisions() == 0);  // came from a take-off
  standing.observe(2.1, {at(1.0, 0.0, 0.1)}, {false});
  CHECK(standing.collisions() == 1);
}

TEST_CASE("mean and spread of the distances") {
  const sim3d::GroundTruth truth(room(), room_grid());
  FlightMeter meter(truth, 0.2, 2);
  for (const double y : {0.0, 0.5, 1.0}) meter.observe(y, {at(1.0, -1.0, 1.0), at(1.0, y, 1.0)}, {true, true});
  CHECK(meter.mean_distance_m() == Approx(1.5));
  CHECK(meter.std_distance_m() == Approx(std::sqrt(0.5 / 3.0)));
  CHECK(meter.min_distance_m() == Approx(1.0));
}

TEST_CASE("milestones keep the first time, percentiles are nearest ranks") {
  Milestones milestones;
  milestones.observe(1.0, 0.4);
  milestones.observe(2.0, 0.85);
  milestones.observe(3.0, 0.86);
  CHECK(*milestones.times_s()[0] == 2.0);
  CHECK(*milestones.times_s()[2] == 2.0);
  CHECK_FALSE(milestones.times_s()[3].has_value());
  Milestones resumed;
  resumed.load(milestones.save());
  CHECK(resumed.times_s() == milestones.times_s());

  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Percentiles p = percentiles(values);
  CHECK(p.p50 == 50.0);
  CHECK(p.p99 == 99.0);
  CHECK(p.max == 100.0);
  CHECK(std::isnan(percentiles({}).p50));
}

TEST_CASE("chosen starts are free, apart and repeatable") {
  const sim3d::GroundTruth truth(room(), room_grid());
  RunConfig config;
  config.world = "room.obj";
  config.fleet.task_box = {{-2.0, -1.5, 0.0}, {2.0, 1.5, 2.0}};
  config.uavs = 3;
  const auto starts = place_starts(config, truth);
  REQUIRE(starts.size() == 3);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    CHECK(truth.sphere_free(starts[i].start.position_m, 0.2));
    CHECK(config.fleet.task_box.contains(starts[i].start.position_m));
    CHECK(starts[i].start.position_m == place_starts(config, truth)[i].start.position_m);
    for (std::size_t j = 0; j < i; ++j) {
      CHECK((starts[i].start.position_m - starts[j].start.position_m).norm() >= 1.2);
    }
  }
}

TEST_CASE("starts are moved by the seed, but into no wall, through none, and not near each other") {
  RunConfig config;
  const sim3d::GroundTruth truth(room(), room_grid());
  config.fleet.task_box = room_grid().box();
  config.starts = {{{-0.5, -1.0, 1.0}, 0.0}, {{-1.5, -0.9, 0.0}, 1.0}};
  config.uavs = 2;
  const std::vector<Start> given = config.starts;
  config.start_spread_m = 1.2;
  std::set<double> places;
  for (config.fleet.seed = 1; config.fleet.seed <= 30; ++config.fleet.seed) {
    const auto starts = place_starts(config, truth);
    for (std::size_t i = 0; i < 2; ++i) {
      const Eigen::Vector3d moved_m = starts[i].start.position_m - given[i].position_m;
      CHECK(moved_m.head<2>().cwiseAbs().maxCoeff() <= config.start_spread_m);
      CHECK(moved_m.z() == 0.0);
      CHECK(starts[i].start.yaw_rad == given[i].yaw_rad);
      CHECK(starts[i].start.position_m == place_starts(config, truth)[i].start.position_m);
      CHECK(truth.sphere_free(starts[i].airborne_m, config.fleet.robot.radius_m));
      CHECK(starts[i].start.position_m.x() < 0.0);  // a wall is between
      places.insert(starts[i].start.position_m.x());
    }
    CHECK((starts[0].start.position_m - starts[1].start.position_m).norm() >= config.fleet.fellow_clearance_m);
  }
  CHECK(places.size() > 55);
}

TEST_CASE("starts that are chosen or moved have the room around them that is assumed free, where there is any") {
  RunConfig config;
  const sim3d::GroundTruth truth(room(), room_grid());
  config.fleet.task_box = room_grid().box();
  const double reach_m = config.fleet.start_bubble_m - config.fleet.robot.radius_m;
  const auto room_to_move = [&](const Eigen::Vector3d& position_m) {
    for (int i = 0; i < 16; ++i) {
      const double azimuth_rad = rad_from_deg(22.5 * i);
      const Eigen::Vector3d side(std::cos(azimuth_rad), std::sin(azimuth_rad), 0.0);
      if (!truth.sphere_free(position_m + reach_m * side, config.fleet.robot.radius_m)) return false;
    }
    return true;
  };
  config.start_spread_m = 1.2;
  for (config.fleet.seed = 1; config.fleet.seed <= 20; ++config.fleet.seed) {
    config.starts.clear();
    config.uavs = 2;
    for (const CheckedStart& chosen : place_starts(config, truth)) CHECK(room_to_move(chosen.airborne_m));
    config.starts = {{{-0.9, -0.7, 1.0}, 0.0}};
    config.uavs = 1;
    REQUIRE(room_to_move(config.starts[0].position_m));
    CHECK(room_to_move(place_starts(config, truth)[0].airborne_m));
  }
  config.start_spread_m = 0.0;
  config.starts.clear();
  config.uavs = 5;  // more than have room
  int without = 0;
  for (const CheckedStart& chosen : place_starts(config, truth)) without += room_to_move(chosen.airborne_m) ? 0 : 1;
  CHECK(without > 0);
}

TEST_CASE("a start on the floor takes off, one in a wall does not") {
  const sim3d::GroundTruth truth(room(), room_grid());
  RunConfig config;
  config.fleet.task_box = {{-2.0, -1.5, 0.0}, {2.0, 1.5, 2.0}};
  config.starts = {{{1.0, 0.0, 0.0}, 0.0}};
  const auto floor = place_starts(config, truth);
  CHECK(floor[0].landed);
  CHECK(truth.sphere_free(floor[0].airborne_m, 0.2));
  config.starts = {{{1.0, 0.0, 1.0}, 0.0}};
  CHECK_FALSE(place_starts(config, truth)[0].landed);
  config.starts = {{{0.0, 0.0, 0.0}, 0.0}};
  CHECK_THROWS_AS(place_starts(config, truth), InputError);
}

}  // namespace stairwell::apps
