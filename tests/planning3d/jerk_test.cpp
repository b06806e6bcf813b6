#include "planning3d/jerk_limit.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/trajectory_builder.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

/// Largest jerk by third differences of position: of the states' velocities, and the jump where it joins `before`.
double largest_jerk(const Trajectory* before, const Trajectory& after, MotionLimits::Norm norm) {
  const double h_s = Trajectory::kStep_s;
  std::vector<Eigen::Vector3d> velocity_mps;
  if (before != nullptr) velocity_mps.push_back(before->sample(after.start_time_s() - h_s).velocity_mps);
  for (const MotionState& state : after.states()) velocity_mps.push_back(state.velocity_mps);
  velocity_mps.insert(velocity_mps.end(), 2, Eigen::Vector3d::Zero());
  double most = 0.0;
  for (std::size_t i = 0; i + 2 < velocity_mps.size(); ++i) {
    const Eigen::Vector3d twice_mps = velocity_mps[i + 2] - 2.0 * velocity_mps[i + 1] + velocity_mps[i];
    most = std::max(most, norm == MotionLimits::Norm::kEuclidean ? twice_mps.norm() : twice_mps.cwiseAbs().maxCoeff());
  }
  return most / (h_s * h_s);
}

}  // namespace

TEST_CASE("with a limit of jerk sampled third differences keep to it, also across replans in flight",
          "[trajectory][jerk]") {
  Rng rng = make_rng(5, "jerk");
  const auto planner = make_planner("astar");
  const SafetyCheck check;
  int built = 0;
  int moving = 0;
  int refused = 0;
  for (int number = 0; number < 60; ++number) {
    TestWorld world({8.0, 8.0, 3.0}, 0.1);
    world.clutter(rng, 12, 1.6);
    const FreeSpace space = world.space();
    MotionLimits limits;
    limits.jerk_mps3 = rng.uniform(4.0, 20.0);
    limits.norm = number % 2 == 0 ? MotionLimits::Norm::kEuclidean : MotionLimits::Norm::kPerAxis;
    const TrajectoryBuilder builder(limits, check);
    Trajectory flying = Trajectory::hover(0.0, world.random_place(space, rng), 0.0);
    double now_s = 1.0;
    for (int departure = 0; departure < 5; ++departure) {
      PlanRequest request;
      request.start_m = flying.sample(now_s).position_m;
      request.goal_m = world.random_place(space, rng);
      const PlanResult plan = planner->plan(space, request);
      if (plan.status != PlanStatus::kReached) continue;
      const auto trajectory = builder.build(space, {&flying, now_s, plan.path_m, 1.0, departure % 2 == 0});
      if (!trajectory) {
        ++refused;
        continue;
      }
      ++built;
      if (flying.sample(now_s).velocity_mps.norm() > 0.1) ++moving;
      CAPTURE(number, departure, limits.jerk_mps3, flying.sample(now_s).velocity_mps);
      CHECK(largest_jerk(&flying, *trajectory, limits.norm) <= limits.jerk_mps3 * 1.02);
      CHECK(checkers::motion_problem(*trajectory, limits) == "");
      CHECK(checkers::motion_space_problem(space, *trajectory, 2e-6) == "");
      CHECK(check.check_limits(*trajectory, limits, now_s).safe());
      flying = *trajectory;
      now_s = rng.uniform(now_s, flying.end_time_s() + 0.3);
    }
  }
  CHECK(built >= 200);
  CHECK(moving >= 100);
  CHECK(refused <= built / 50);
  WARN("built " << built << ", moving " << moving << ", refused " << refused);
}

TEST_CASE("straight flights with a limit of jerk take no longer than a window more", "[trajectory][jerk]") {
  TestWorld world({12.0, 4.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  MotionLimits limits;
  limits.jerk_mps3 = 10.0;
  const Eigen::Vector3d from_m(1.05, 2.05, 1.55);
  const Trajectory still = Trajectory::hover(0.0, from_m, 0.0);
  for (const double length_m : {0.3, 1.0, 3.0, 8.0}) {
    const TrajectoryRequest request{&still, 0.0, {from_m, from_m + Eigen::Vector3d(length_m, 0.0, 0.0)}, 0.0, false};
    const auto gentle = TrajectoryBuilder(limits, SafetyCheck{}).build(space, request);
    const auto abrupt = TrajectoryBuilder(MotionLimits{}, SafetyCheck{}).build(space, request);
    REQUIRE(gentle);
    REQUIRE(abrupt);
    CHECK(largest_jerk(nullptr, *gentle, limits.norm) <= 10.0 * 1.001);
    CHECK(largest_jerk(nullptr, *abrupt, limits.norm) > 50.0);
    CHECK(SafetyCheck{}.check_limits(*abrupt, limits, 0.0).verdict == Verdict::kLimits);
    CHECK(gentle->end_time_s() <= abrupt->end_time_s() + 2.0 * limits.acceleration_mps2 / limits.jerk_mps3 + 0.05);
  }
}

TEST_CASE("a limit of jerk must be positive, or none", "[trajectory][jerk]") {
  MotionLimits limits;
  CHECK_FALSE(limits.limits_jerk());
  CHECK(limits.problems().empty());
  limits.jerk_mps3 = -1.0;
  CHECK(limits.problems().size() == 1);
  limits.jerk_mps3 = std::nan("");
  CHECK(limits.problems().size() == 1);
}
