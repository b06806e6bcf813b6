/// What UAVs take off each other's gain (turn_taking.cpp, Foreseen).
#include "core/units.hpp"
#include "coverage3d/view_gain.hpp"
#include "half_seen.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;
using toy::HalfSeen;

ViewGain gain_of(const HalfSeen& scene) {
  ViewGainConfig config;
  config.sensor = scene.config.sensor;
  config.box = scene.config.box;
  return ViewGain(config);
}

/// A storey seen from one place, and UAVs around it that all want a goal.
HalfSeen crowded(std::size_t uavs, const SensorModel& sensor) {
  HalfSeen scene(false);
  scene.config.sensor = sensor;
  const UavView first = scene.request.uavs[0];
  for (std::size_t i = 1; i < uavs; ++i) {
    scene.request.uavs.push_back(first);
    scene.request.uavs[i].position_m.x() += 0.8 * static_cast<double>(i);
  }
  return scene;
}

/// Part of the second goal's gain that a UAV at the first one is going to see.
double overlap(const HalfSeen& scene, const Goal& first, const Goal& second) {
  const ViewGain gain = gain_of(scene);
  Foreseen foreseen(scene.map.grid());
  gain.foresee(scene.map, first.position_m, first.yaw_rad, foreseen);
  const double alone_m3 = gain.gain_m3(scene.map, second.position_m, second.yaw_rad);
  return 1.0 - gain.gain_m3(scene.map, second.position_m, second.yaw_rad, &foreseen) / alone_m3;
}

}  // namespace

TEST_CASE("what is foreseen from a pose is all that the same pose has to gain, and nothing of what lies behind it") {
  const HalfSeen scene(false);
  for (const SensorModel& sensor : {toy::camera(), toy::lidar()}) {
    ViewGainConfig config;
    config.sensor = sensor;
    config.box = scene.config.box;
    const ViewGain gain(config);
    for (const double yaw_rad : {0.0, 1.1, -2.3}) {
      const Eigen::Vector3d at_m(2.1, 2.3, 1.5);
      Foreseen foreseen(scene.map.grid());
      const double before_m3 = gain.gain_m3(scene.map, at_m, yaw_rad);
      REQUIRE(gain.gain_m3(scene.map, at_m, yaw_rad, &foreseen) == before_m3);
      gain.foresee(scene.map, at_m, yaw_rad, foreseen);
      CHECK(gain.gain_m3(scene.map, at_m, yaw_rad, &foreseen) <=
            (sensor.panoramic() ? 0.05 : 0.3) * before_m3);  // a sector is 15 degrees wide
      if (sensor.panoramic()) continue;
      const double behind_m3 = gain.gain_m3(scene.map, at_m, wrap_angle(yaw_rad + kPi));
      CHECK(gain.gain_m3(scene.map, at_m, wrap_angle(yaw_rad + kPi), &foreseen) >= 0.9 * behind_m3);
    }
  }
}

TEST_CASE("alone, a UAV of a fleet goes where it would go without the fleet") {
  HalfSeen scene = crowded(3, toy::camera());
  scene.config.turn_taking = false;
  const Assignment all = make_strategy("frontiers", scene.config)->assign(scene.space(), scene.request);
  AssignmentRequest one = scene.request;
  one.uavs.resize(1);
  const Assignment alone = make_strategy("frontiers", scene.config)->assign(scene.space(), one);
  REQUIRE(all.goals[0].has_value());
  REQUIRE(alone.goals[0].has_value());
  CHECK((all.goals[0]->target_m - alone.goals[0]->target_m).norm() < 1e-9);
  for (std::size_t i = 1; i < 3; ++i) {  // the others go elsewhere
    REQUIRE(all.goals[i].has_value());
    for (std::size_t k = 0; k < i; ++k) CHECK(all.goals[i]->target_m != all.goals[k]->target_m);
  }
}

TEST_CASE("taking turns, greedy UAVs look at other places than those before them") {
  double shared_off = 0.0, shared_on = 0.0;
  for (const SensorModel& sensor : {toy::camera(), toy::lidar()}) {
    for (const bool turns : {false, true}) {
      HalfSeen scene = crowded(2, sensor);
      scene.config.turn_taking = turns;
      const Assignment given = make_strategy("greedy", scene.config)->assign(scene.space(), scene.request);
      REQUIRE(given.goals[0].has_value());
      REQUIRE(given.goals[1].has_value());
      const double shared =
          0.5 * (overlap(scene, *given.goals[0], *given.goals[1]) + overlap(scene, *given.goals[1], *given.goals[0]));
      (turns ? shared_on : shared_off) += shared;
    }
  }
  INFO("shared " << shared_off << " alone, " << shared_on << " in turn");
  CHECK(shared_on < 0.7 * shared_off);
}

TEST_CASE("what a UAV under way is going to see, greedy others leave to it") {
  HalfSeen scene = crowded(2, toy::camera());
  scene.config.turn_taking = false;
  UavView& other = scene.request.uavs[0];  // keeps a goal elsewhere, and passes the place on its way
  other.wants_goal = false;
  other.goal = Goal{other.position_m, 0.0, {1.5, 1.5, 0.3}, 1.0, 0.1};
  const Assignment free_choice = make_strategy("greedy", scene.config)->assign(scene.space(), scene.request);
  REQUIRE(free_choice.goals[1].has_value());
  const Goal wanted = *free_choice.goals[1];
  other.ahead.push_back({wanted.position_m, wanted.yaw_rad});
  for (const bool turns : {false, true}) {
    scene.config.turn_taking = turns;
    const Assignment given = make_strategy("greedy", scene.config)->assign(scene.space(), scene.request);
    REQUIRE(given.goals[1].has_value());
    INFO((turns ? "in turn" : "alone"));
    CHECK((overlap(scene, wanted, *given.goals[1]) < 0.5) == turns);
  }
}
