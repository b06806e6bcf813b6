#include "planning3d/trajectory_builder.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/planner.hpp"
#include "test_world.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::cpu_ms_since;
using stairwell::test::TestWorld;

namespace {

MotionLimits random_limits(Rng& rng) {
  MotionLimits limits;
  limits.speed_mps = rng.uniform(0.8, 3.0);
  limits.acceleration_mps2 = rng.uniform(0.8, 3.0);
  limits.yaw_rate_radps = rng.uniform(0.5, 3.0);
  limits.yaw_acceleration_radps2 = rng.uniform(0.5, 3.0);
  limits.norm = rng.uniform() < 0.5 ? MotionLimits::Norm::kEuclidean : MotionLimits::Norm::kPerAxis;
  return limits;
}

void check_join(const Trajectory& before, const Trajectory& after, double at_s) {
  const MotionState a = before.sample(at_s);
  const MotionState b = after.states().front();
  CHECK(after.start_time_s() == at_s);
  CHECK((a.position_m - b.position_m).norm() < 1e-9);
  CHECK((a.velocity_mps - b.velocity_mps).norm() < 1e-9);
  CHECK(std::abs(wrap_angle(a.yaw_rad - b.yaw_rad)) < 1e-9);
  CHECK(std::abs(a.yaw_rate_radps - b.yaw_rate_radps) < 1e-9);
}

/// Least time from rest to rest over a straight way.
double bang_bang_s(double length_m, double speed_mps, double acceleration) {
  const double ramp_m = speed_mps * speed_mps / acceleration;
  if (length_m <= ramp_m) return 2.0 * std::sqrt(length_m / acceleration);
  return 2.0 * speed_mps / acceleration + (length_m - ramp_m) / speed_mps;
}

}  // namespace

TEST_CASE("trajectories keep to limits, space and the motion under way", "[trajectory]") {
  Rng rng = make_rng(7, "trajectories");
  Rng sides = make_rng(7, "sides");
  double aside_part = 0.0;  // of the way that braking takes
  int gave_way = 0;
  const auto planner = make_planner("astar");
  int built = 0;
  int refused = 0;
  int moving = 0;
  double build_ms = 0.0;
  double worst_ms = 0.0;
  for (int world_number = 0; world_number < 12; ++world_number) {
    TestWorld world({10.0, 10.0, 3.0}, 0.1, {0.2, world_number % 2 == 0 ? 0.1 : 0.0});
    world.clutter(rng, 25, 2.0);
    const FreeSpace space = world.space();
    const MotionLimits limits = random_limits(rng);
    const SafetyCheck check;
    const TrajectoryBuilder builder(limits, check);
    Trajectory flying = Trajectory::hover(0.0, world.random_place(space, rng), rng.uniform(-3.0, 3.0));
    double now_s = rng.uniform(0.0, 5.0);
    for (int departure = 0; departure < 12; ++departure) {
      const MotionState state = flying.sample(now_s);
      PlanRequest request;
      request.start_m = state.position_m;
      request.goal_m = world.random_place(space, rng);
      const PlanResult plan = planner->plan(space, request);
      if (plan.status != PlanStatus::kReached) continue;
      TrajectoryRequest wanted;
      wanted.previous = &flying;
      wanted.depart_s = now_s;
      wanted.path_m = plan.path_m;
      wanted.goal_yaw_rad = rng.uniform(-3.0, 3.0);
      wanted.look_along_path = rng.uniform() < 0.5;
      const std::clock_t begin = std::clock();
      const auto trajectory = builder.build(space, wanted);
      const double ms = cpu_ms_since(begin);
      build_ms += ms;
      worst_ms = std::max(worst_ms, ms);
      if (state.velocity_mps.norm() > 0.1) ++moving;
      if (!trajectory) {
        ++refused;
        WARN("refused: world " << world_number << " path " << checkers::path_problem(space, plan.path_m) << " start "
                               << checkers::place_problem(space, state.position_m, 0.0) << " v "
                               << state.velocity_mps.norm());
        continue;
      }
      ++built;
      check_join(flying, *trajectory, now_s);
      CAPTURE(limits.speed_mps, limits.acceleration_mps2, limits.norm == MotionLimits::Norm::kPerAxis,
              state.velocity_mps, plan.path_m.size());
      CHECK(checkers::motion_problem(*trajectory, limits) == "");
      CHECK(checkers::motion_space_problem(space, *trajectory) == "");
      CHECK((trajectory->states().back().position_m - plan.path_m.back()).norm() < 1e-12);
      CHECK(std::abs(wrap_angle(trajectory->states().back().yaw_rad - wanted.goal_yaw_rad)) < 1e-9);
      CHECK(check.check_limits(*trajectory, limits, now_s).safe());
      const double brake_s = rng.uniform(now_s, trajectory->end_time_s() + 0.5);
      const Trajectory stop = builder.brake(*trajectory, brake_s);
      check_join(*trajectory, stop, brake_s);
      CAPTURE(limits.speed_mps, limits.acceleration_mps2, limits.norm == MotionLimits::Norm::kPerAxis);
      CHECK(checkers::motion_problem(stop, limits) == "");
      CHECK(checkers::motion_space_problem(space, stop) == "");
      const double speed_mps = trajectory->sample(brake_s).velocity_mps.norm();
      const double rate = std::abs(trajectory->sample(brake_s).yaw_rate_radps);
      CHECK(stop.end_time_s() - brake_s <=
            std::max(2.5 * speed_mps / limits.acceleration_mps2, 1.1 * rate / limits.yaw_acceleration_radps2) + 0.1);
      if (speed_mps > 0.2) {
        const Eigen::Vector3d course = trajectory->sample(brake_s).velocity_mps / speed_mps;
        const Eigen::Vector3d aside =
            course.cross(Eigen::Vector3d(sides.normal(), sides.normal(), sides.normal())).normalized();
        const Trajectory gives_way = builder.brake_aside(*trajectory, brake_s, aside);
        check_join(*trajectory, gives_way, brake_s);
        CHECK(checkers::motion_problem(gives_way, limits) == "");
        const double way_m = speed_mps * speed_mps / (2.0 * limits.acceleration_mps2);
        aside_part += (gives_way.states().back().position_m - stop.states().back().position_m).dot(aside) / way_m;
        ++gave_way;
      }
      flying = *trajectory;
      now_s = rng.uniform(now_s, flying.end_time_s() + 0.5);
    }
  }
  CHECK(built >= 80);
  CHECK(moving >= 40);
  CHECK(gave_way >= 20);
  CHECK(aside_part / gave_way > 0.15);
  CHECK(refused <= built / 50);
  WARN("built " << built << ", refused " << refused << ", moving " << moving << ", mean build "
                << build_ms / (built + refused) << " ms, worst " << worst_ms << " ms");
}

TEST_CASE("flights keep half a voxel more than the radius where there is room, and fit where there is not",
          "[trajectory]") {
  TestWorld world({8.0, 6.0, 3.0}, 0.1);
  world.fill({{2.5, -0.1, -0.1}, {3.0, 4.0, 3.1}}, true);
  world.fill({{5.0, 2.0, -0.1}, {5.5, 6.1, 3.1}}, true);
  const FreeSpace space = world.space();
  SafetyCheck::Config roomy;
  roomy.spare_m = 0.05;
  const auto planner = make_planner("astar");
  Rng rng = make_rng(3, "half a voxel");
  int built = 0;
  for (int flight = 0; flight < 20; ++flight) {
    PlanRequest request;
    request.start_m = {rng.uniform(0.5, 2.0), rng.uniform(0.5, 5.5), rng.uniform(0.5, 2.5)};
    request.goal_m = {rng.uniform(6.0, 7.5), rng.uniform(0.5, 5.5), rng.uniform(0.5, 2.5)};
    const PlanResult plan = planner->plan(space, request);
    REQUIRE(plan.status == PlanStatus::kReached);
    const Trajectory hovering = Trajectory::hover(0.0, request.start_m, 0.0);
    TrajectoryRequest wanted;
    wanted.previous = &hovering;
    wanted.path_m = plan.path_m;
    const auto trajectory = TrajectoryBuilder(random_limits(rng), SafetyCheck()).build(space, wanted);
    if (!trajectory) continue;
    ++built;
    CAPTURE(request.start_m.transpose(), request.goal_m.transpose());
    CHECK(SafetyCheck(roomy).check_space(space, *trajectory, 0.0).safe());
  }
  CHECK(built == 20);

  TestWorld tunnel({6.0, 3.0, 3.0}, 0.1);  // as wide as the UAV
  tunnel.fill({{2.0, -0.1, -0.1}, {4.0, 1.3, 3.1}}, true);
  tunnel.fill({{2.0, 1.7, -0.1}, {4.0, 3.1, 3.1}}, true);
  const Trajectory hovering = Trajectory::hover(0.0, {1.0, 1.5, 1.5}, 0.0);
  TrajectoryRequest wanted;
  wanted.previous = &hovering;
  wanted.path_m = {{1.0, 1.5, 1.5}, {5.0, 1.5, 1.5}};
  const FreeSpace narrow = tunnel.space();
  const auto through = TrajectoryBuilder(MotionLimits{}, SafetyCheck()).build(narrow, wanted);
  REQUIRE(through.has_value());
  CHECK(checkers::motion_space_problem(narrow, *through) == "");
}

TEST_CASE("straight flights take hardly longer than bang-bang", "[trajectory]") {
  TestWorld world({12.0, 4.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  for (const double length_m : {0.3, 1.0, 3.0, 8.0}) {
    const MotionLimits limits;
    const TrajectoryBuilder builder(limits, SafetyCheck{});
    const Eigen::Vector3d from_m(1.05, 2.05, 1.55);
    const Trajectory still = Trajectory::hover(0.0, from_m, 0.0);
    const auto trajectory =
        builder.build(space, {&still, 1.0, {from_m, from_m + Eigen::Vector3d(length_m, 0.0, 0.0)}, 0.0, true});
    REQUIRE(trajectory);
    const double took_s = trajectory->end_time_s() - 1.0;
    CHECK(took_s <= 1.1 * bang_bang_s(length_m, limits.speed_mps, limits.acceleration_mps2) + Trajectory::kStep_s);
  }
}

TEST_CASE("corners with room around them are hardly slower than no corners", "[trajectory]") {
  TestWorld world({12.0, 12.0, 3.0}, 0.1);
  world.fill({{4.0, 4.0, 0.0}, {8.0, 8.0, 3.0}}, true);
  const FreeSpace space = world.space();
  const MotionLimits limits;
  const Eigen::Vector3d from_m(2.0, 1.0, 1.5);
  const Trajectory still = Trajectory::hover(0.0, from_m, 0.0);
  const std::vector<Eigen::Vector3d> path_m{from_m, {10.0, 2.0, 1.5}, {10.0, 10.0, 1.5}, {2.0, 11.0, 1.5}};
  double length_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) length_m += (path_m[i + 1] - path_m[i]).norm();
  const auto trajectory = TrajectoryBuilder(limits, SafetyCheck{}).build(space, {&still, 0.0, path_m, 0.0, true});
  REQUIRE(trajectory);
  CHECK(checkers::motion_space_problem(space, *trajectory, 2e-6) == "");
  CHECK(trajectory->end_time_s() <= 1.05 * bang_bang_s(length_m, limits.speed_mps, limits.acceleration_mps2));
}

TEST_CASE("a replan along the same way hardly slows the flight", "[trajectory]") {
  TestWorld world({12.0, 4.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  const TrajectoryBuilder builder(MotionLimits{}, SafetyCheck{});
  const Eigen::Vector3d from_m(1.05, 2.05, 1.55);
  const Eigen::Vector3d to_m(10.05, 2.05, 1.55);
  const Trajectory still = Trajectory::hover(0.0, from_m, 0.0);
  const auto first = builder.build(space, {&still, 0.0, {from_m, to_m}, 0.0, true});
  REQUIRE(first);
  const auto second = builder.build(space, {&*first, 2.0, {first->sample(2.0).position_m, to_m}, 0.0, true});
  REQUIRE(second);
  CHECK(second->end_time_s() <= first->end_time_s() + 0.1);
  // A reversal: brakes, then comes back.
  const auto back = builder.build(space, {&*first, 2.0, {first->sample(2.0).position_m, from_m}, 0.0, false});
  REQUIRE(back);
  CHECK(checkers::motion_problem(*back, MotionLimits{}) == "");
  CHECK((back->states().back().position_m - from_m).norm() < 1e-12);
}

TEST_CASE("turning on the spot", "[trajectory]") {
  MotionLimits limits;
  const TrajectoryBuilder builder(limits, SafetyCheck{});
  const Trajectory turn = builder.rotate(3.0, {1, 2, 3}, 0.5, 2.0 * kPi, 0.4);
  CHECK(checkers::motion_problem(turn, limits) == "");
  CHECK(std::abs(wrap_angle(turn.states().back().yaw_rad - 0.5)) < 1e-9);
  CHECK(turn.end_time_s() - 3.0 >= 2.0 * kPi / 0.4);
  CHECK(turn.end_time_s() - 3.0 < 2.0 * kPi / 0.4 * 1.1);
  // Yaw alone: the path has no length.
  TestWorld world({4.0, 4.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  const Trajectory still = Trajectory::hover(0.0, {2.0, 2.0, 1.5}, 3.0);
  const auto only_yaw = builder.build(space, {&still, 1.0, {{2.0, 2.0, 1.5}}, -3.0, true});
  REQUIRE(only_yaw);
  CHECK(checkers::motion_problem(*only_yaw, limits) == "");
  CHECK(only_yaw->end_time_s() - 1.0 < 1.0);  // the short way round
  // In the middle of a turn the rate goes on.
  const auto on = builder.build(space, {&turn, 6.0, {{1.0, 2.0, 3.0}}, 0.0, false});
  CHECK_FALSE(on);  // outside the map
}

TEST_CASE("the step model moves delta per period", "[trajectory]") {
  const Trajectory walk =
      TrajectoryBuilder::step_along(1.0, 0.0, {{0, 0, 1}, {1.2, 0, 1}, {1.2, 1.2, 1}}, kPi / 2.0, 0.12, 0.1);
  CHECK(walk.end_time_s() == Approx(3.0));
  CHECK((walk.sample(2.0).position_m - Eigen::Vector3d(1.2, 0, 1)).norm() < 0.03);
  CHECK((walk.states().back().position_m - Eigen::Vector3d(1.2, 1.2, 1)).norm() < 1e-12);
  CHECK(walk.states().back().yaw_rad == Approx(kPi / 2.0));
}

TEST_CASE("unusable trajectory requests are refused", "[trajectory]") {
  TestWorld world({4.0, 4.0, 3.0}, 0.1);
  world.fill({{2.0, 0.0, 0.0}, {2.2, 4.0, 3.0}}, true);
  const FreeSpace space = world.space();
  const TrajectoryBuilder builder(MotionLimits{}, SafetyCheck{});
  const Eigen::Vector3d from_m(1.0, 2.0, 1.5);
  const Trajectory still = Trajectory::hover(0.0, from_m, 0.0);
  const double nan = std::nan("");
  CHECK_FALSE(builder.build(space, {&still, 0.0, {}, 0.0, false}));
  CHECK_FALSE(builder.build(space, {nullptr, 0.0, {from_m}, 0.0, false}));
  CHECK_FALSE(builder.build(space, {&still, 0.0, {from_m, {nan, 0, 0}}, 0.0, false}));
  CHECK_FALSE(builder.build(space, {&still, nan, {from_m}, 0.0, false}));
  CHECK_FALSE(builder.build(space, {&still, 0.0, {from_m, {3.0, 2.0, 1.5}}, 0.0, false}));  // through the wall
}
