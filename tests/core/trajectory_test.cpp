#include "core/trajectory.hpp"
#include "core/units.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <stdexcept>

using namespace stairwell;

namespace {

/// Circle of radius 2 m at 1 rad/s.
Trajectory circle(double start_s, double duration_s) {
  std::vector<MotionState> states;
  for (double t_s = 0.0; t_s <= duration_s + 1e-9; t_s += Trajectory::kStep_s) {
    MotionState s;
    s.position_m = {2.0 * std::cos(t_s), 2.0 * std::sin(t_s), 1.0};
    s.velocity_mps = {-2.0 * std::sin(t_s), 2.0 * std::cos(t_s), 0.0};
    s.yaw_rad = wrap_angle(t_s + kPi / 2);
    s.yaw_rate_radps = 1.0;
    states.push_back(s);
  }
  return {start_s, states};
}

}  // namespace

TEST_CASE("samples between the states follow the curve") {
  const Trajectory trajectory = circle(3.0, 4.0);
  for (double t_s = 0.0; t_s < 3.99; t_s += 0.0137) {
    const MotionState s = trajectory.sample(3.0 + t_s);
    CHECK((s.position_m - Eigen::Vector3d(2.0 * std::cos(t_s), 2.0 * std::sin(t_s), 1.0)).norm() < 1e-6);
    CHECK(std::abs(wrap_angle(s.yaw_rad - t_s - kPi / 2)) < 1e-9);
  }
}

TEST_CASE("a trajectory holds before its start and rests after its end") {
  const Trajectory trajectory = circle(3.0, 1.0);
  CHECK(trajectory.sample(-5.0).position_m.x() == Approx(2.0));
  const MotionState rest = trajectory.sample(100.0);
  CHECK(rest.velocity_mps.norm() == 0.0);
  CHECK(rest.yaw_rate_radps == 0.0);
  CHECK((rest.position_m - trajectory.states().back().position_m).norm() == 0.0);
}

TEST_CASE("length is measured between two times") {
  const Trajectory trajectory = circle(0.0, 3.0);
  CHECK(trajectory.length_m(0.5, 1.5) == Approx(2.0).epsilon(1e-3));
  CHECK(trajectory.length_m(-10.0, 10.0) == Approx(6.0).epsilon(1e-3));
  CHECK(trajectory.length_m(2.0, 1.0) == 0.0);
  CHECK(Trajectory::hover(0.0, {1, 2, 3}, 0.5).length_m(0.0, 9.0) == 0.0);
}

TEST_CASE("an empty trajectory is refused and limits list their problems") {
  CHECK_THROWS_AS(Trajectory(0.0, {}), std::invalid_argument);
  MotionLimits limits;
  CHECK(limits.problems().empty());
  limits.speed_mps = 0.0;
  limits.yaw_rate_radps = std::nan("");
  CHECK(limits.problems().size() == 2);
}

TEST_CASE("limits per axis allow more where a motion shares its speed out to the axes") {
  MotionLimits limits;
  CHECK(limits.stretch({1.0, 2.0, -3.0}) == 1.0);
  limits.norm = MotionLimits::Norm::kPerAxis;
  CHECK(limits.stretch({0.0, -4.0, 0.0}) == 1.0);
  CHECK(limits.stretch({2.0, -2.0, 0.0}) == Approx(std::sqrt(2.0)));
  const Eigen::Vector3d direction(0.3, -0.5, 0.1);
  const Eigen::Vector3d fastest_mps = limits.speed_mps * limits.stretch(direction) * direction.normalized();
  CHECK(fastest_mps.cwiseAbs().maxCoeff() == Approx(limits.speed_mps));
}
