#include "sim3d/vehicles.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace stairwell::sim3d {
namespace {

constexpr double kStep = Trajectory::kStep_s;

MotionState at(const Eigen::Vector3d& position_m, double yaw_rad = 0.0) {
  MotionState state;
  state.position_m = position_m;
  state.yaw_rad = yaw_rad;
  return state;
}

/// From one motion to rest or to a cruise: acceleration constant per step, exactly integrated.
struct Course {
  MotionState state;
  std::vector<MotionState> states{};

  void go(const Eigen::Vector3d& acceleration_mps2, double yaw_acceleration, int steps) {
    if (states.empty()) states.push_back(state);
    for (int i = 0; i < steps; ++i) {
      state.position_m += kStep * state.velocity_mps + 0.5 * kStep * kStep * acceleration_mps2;
      state.velocity_mps += kStep * acceleration_mps2;
      state.yaw_rad += kStep * state.yaw_rate_radps + 0.5 * kStep * kStep * yaw_acceleration;
      state.yaw_rate_radps += kStep * yaw_acceleration;
      state.acceleration_mps2 = acceleration_mps2;
      states.push_back(state);
    }
  }
};

/// Accelerates for `steps`, then brakes to rest.
Trajectory dash(double start_s, const MotionState& from, const Eigen::Vector3d& acceleration, double yaw_acceleration,
                int steps) {
  Course course{from};
  course.go(acceleration, yaw_acceleration, steps);
  course.go(-acceleration, -yaw_acceleration, steps);
  return {start_s, course.states};
}

std::string refusal(Vehicle& vehicle, const Trajectory& trajectory) {
  try {
    vehicle.command(trajectory);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST_CASE("A limited vehicle follows its command exactly and takes off by moving up") {
  const auto vehicle = make_vehicle("limited", {}, at({1, 2, 0}), true);
  CHECK(vehicle->landed());
  CHECK(vehicle->state().position_m == Eigen::Vector3d(1, 2, 0));
  const Trajectory up = dash(0.5, at({1, 2, 0}), {0, 0, 1.5}, 0.5, 40);
  vehicle->command(up);
  vehicle->advance(0.5);
  CHECK(vehicle->landed());
  CHECK(vehicle->state().position_m.z() == 0.0);
  for (double time_s = 0.5; time_s < 3.0; time_s += 0.037) {
    vehicle->advance(time_s);
    CHECK((vehicle->state().position_m - up.sample(time_s).position_m).norm() < 1e-9);
    CHECK(vehicle->state().yaw_rad == Approx(up.sample(time_s).yaw_rad).margin(1e-9));
  }
  CHECK_FALSE(vehicle->landed());
  CHECK(vehicle->commanded().end_time_s() == Approx(up.end_time_s()));
}

TEST_CASE("A new command takes over at its start; until then the old motion goes on") {
  const auto vehicle = make_vehicle("limited", {}, at({0, 0, 1}), false);
  const Trajectory first = dash(0.0, at({0, 0, 1}), {1.0, 0, 0}, 0.0, 50);
  vehicle->command(first);
  vehicle->advance(0.313);
  const double join_s = 0.795;  // between the steps of the first
  Course course{first.sample(join_s)};
  const Eigen::Vector3d brake = -course.state.velocity_mps / (50 * kStep);
  course.go(brake, 0.0, 50);
  const Trajectory second(join_s, course.states);
  vehicle->command(second);
  Eigen::Vector3d last_m = vehicle->state().position_m;
  CHECK((last_m - first.sample(0.313).position_m).norm() < 1e-5);
  for (double time_s = 0.313; time_s < 2.5; time_s += 0.01) {
    vehicle->advance(time_s);
    const MotionState expected = time_s < join_s ? first.sample(time_s) : second.sample(time_s);
    REQUIRE((vehicle->state().position_m - expected.position_m).norm() < 1e-4);
    REQUIRE((vehicle->state().position_m - last_m).norm() <= 2.0 * 0.0101);
    last_m = vehicle->state().position_m;
  }
}

TEST_CASE("Commands at random never carry a limited vehicle beyond its limits") {
  MotionLimits limits;
  limits.speed_mps = 1.5;
  limits.acceleration_mps2 = 2.5;
  for (const auto norm : {MotionLimits::Norm::kEuclidean, MotionLimits::Norm::kPerAxis}) {
    limits.norm = norm;
    Rng rng = make_rng(5, "vehicles");
    const auto vehicle = make_vehicle("limited", limits, at({0, 0, 1}), false);
    int accepted = 0;
    int refused = 0;
    double now_s = 0.0;
    const auto size = [&](const Eigen::Vector3d& v) {
      return norm == MotionLimits::Norm::kEuclidean ? v.norm() : v.lpNorm<Eigen::Infinity>();
    };
    for (int round = 0; round < 300; ++round) {
      const double start_s = now_s + rng.uniform(0.0, 0.2);
      const Eigen::Vector3d acceleration(rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3));
      const Trajectory trajectory = dash(start_s, vehicle->commanded().sample(start_s), acceleration,
                                         rng.uniform(-2.0, 2.0), rng.uniform_int(1, 60));
      refusal(*vehicle, trajectory).empty() ? ++accepted : ++refused;
      for (int i = 0; i < 40; ++i) {
        const MotionState before = vehicle->state();
        now_s += 0.01;
        vehicle->advance(now_s);
        const MotionState after = vehicle->state();
        REQUIRE(size(after.velocity_mps) <= 1.5 * 1.0011);
        REQUIRE(size(after.position_m - before.position_m) <= 1.5 * 0.01 * 1.01 + 1e-5);
        REQUIRE(size(after.velocity_mps - before.velocity_mps) <= 2.5 * 0.01 * 1.01 + 0.006);
        REQUIRE(std::abs(after.yaw_rate_radps) <= limits.yaw_rate_radps * 1.0011);
      }
    }
    CHECK(accepted > 30);
    CHECK(refused > 30);
  }
}

TEST_CASE("A limited vehicle refuses what it cannot fly and says why") {
  const auto vehicle = make_vehicle("limited", {}, at({0, 0, 1}), false);
  using Catch::Matchers::Contains;
  CHECK_THAT(refusal(*vehicle, Trajectory{}), Contains("no states"));
  CHECK_THAT(refusal(*vehicle, Trajectory::hover(0.0, {0.5, 0, 1}, 0.0)), Contains("jump in position"));
  CHECK_THAT(refusal(*vehicle, Trajectory::hover(0.0, {0, 0, 1}, 0.5)), Contains("jump in yaw"));
  CHECK_THAT(refusal(*vehicle, dash(0.0, at({0, 0, 1}), {3.0, 0, 0}, 0.0, 10)), Contains("acceleration"));
  CHECK_THAT(refusal(*vehicle, dash(0.0, at({0, 0, 1}), {1.9, 0, 0}, 0.0, 80)), Contains("speed"));
  CHECK_THAT(refusal(*vehicle, dash(0.0, at({0, 0, 1}), {0, 0, 0}, 3.0, 10)), Contains("yaw rate"));
  Course claims{at({0, 0, 1})};
  claims.go({1, 0, 0}, 0.0, 1);
  claims.go({-1, 0, 0}, 0.0, 1);
  claims.states[1].acceleration_mps2.x() = 2.1;
  CHECK_THAT(refusal(*vehicle, Trajectory(0.0, claims.states)), Contains("the acceleration"));
  Course hides{at({0, 0, 1})};
  hides.go({2.1, 0, 0}, 0.0, 1);
  hides.go({-2.1, 0, 0}, 0.0, 1);
  for (auto& state : hides.states) state.acceleration_mps2.setZero();
  CHECK_THAT(refusal(*vehicle, Trajectory(0.0, hides.states)), Contains("the change of speed"));
  Course no_stop{at({0, 0, 1})};
  no_stop.go({1, 0, 0}, 0.0, 20);
  CHECK_THAT(refusal(*vehicle, Trajectory(0.0, no_stop.states)), Contains("at the end"));
  std::vector<MotionState> jump{at({0, 0, 1}), at({1, 0, 1})};
  CHECK_THAT(refusal(*vehicle, Trajectory(0.0, jump)), Contains("speed of the position"));
  jump[1].position_m.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refusal(*vehicle, Trajectory(0.0, jump)), Contains("not finite"));
  MotionState moving = at({0, 0, 1});
  moving.velocity_mps.x() = 1.0;
  CHECK_THAT(refusal(*vehicle, dash(0.0, moving, {0, 0, 0}, 0.0, 5)), Contains("jump in velocity"));
  CHECK(vehicle->commanded().sample(9.0).position_m == Eigen::Vector3d(0, 0, 1));
  vehicle->advance(1.0);
  CHECK_THROWS_AS(vehicle->advance(0.5), std::invalid_argument);
}

TEST_CASE("A step vehicle checks only the distance of each step") {
  const auto vehicle = make_vehicle("step", {}, at({0, 0, 1}), false);
  std::vector<MotionState> zigzag;
  for (int i = 0; i < 20; ++i) zigzag.push_back(at({0.0, i % 2 * 2.0 * kStep, 1.0}, i % 2 * 3.0));
  CHECK_NOTHROW(vehicle->command(Trajectory(0.0, zigzag)));
  vehicle->advance(0.02);
  CHECK(vehicle->state().position_m.y() == Approx(2.0 * kStep));
  zigzag.back().position_m.x() += 3.0 * kStep;
  CHECK_THROWS_AS(vehicle->command(Trajectory(0.0, zigzag)), std::invalid_argument);
}

TEST_CASE("Unknown models and unusable starts are input errors that name the way out") {
  CHECK_THROWS_WITH(make_vehicle("rocket", {}, {}, false),
                    Catch::Contains("rocket") && Catch::Contains("limited") && Catch::Contains("step"));
  MotionLimits limits;
  limits.speed_mps = -1.0;
  CHECK_THROWS_AS(make_vehicle("limited", limits, {}, false), InputError);
  MotionState nowhere;
  nowhere.position_m.x() = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(make_vehicle("limited", {}, nowhere, false), InputError);
}

TEST_CASE("Radio reaches up to its range") {
  const RangeRadio radio(5.0);
  CHECK(radio.linked({0, 0, 0}, {3, 4, 0}));
  CHECK_FALSE(radio.linked({0, 0, 0}, {3, 4, 0.1}));
}

}  // namespace
}  // namespace stairwell::sim3d
