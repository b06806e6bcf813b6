#include "planning3d/safety_check.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/trajectory_builder.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

Trajectory flight(const FreeSpace& space, double depart_s, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const Trajectory still = Trajectory::hover(0.0, from_m, 0.0);
  const auto built =
      TrajectoryBuilder(MotionLimits{}, SafetyCheck{}).build(space, {&still, depart_s, {from_m, to_m}, 0.0, false});
  REQUIRE(built);
  return *built;
}

}  // namespace

TEST_CASE("FCL's word agrees with plain geometry", "[safety]") {
  Rng rng = make_rng(8, "safety");
  TestWorld world({4.0, 4.0, 2.0}, 0.1);
  world.clutter(rng, 15, 1.0);
  const FreeSpace space = world.space();
  const SafetyCheck check;
  for (int i = 0; i < 10000; ++i) {
    const Eigen::Vector3d at_m(rng.uniform(0.0, 4.0), rng.uniform(0.0, 4.0), rng.uniform(0.0, 2.0));
    const double depth_m = checkers::penetration_m(world.map, at_m, 0.2);
    if (depth_m > 0.0 && depth_m < 1e-5) continue;
    if ((check.check_position(space, at_m) == Verdict::kSafe) != (depth_m <= 0.0)) {
      FAIL("depth " << depth_m << " at " << at_m.transpose());
    }
  }
}

TEST_CASE("paths through what is not free are named", "[safety]") {
  TestWorld world({6.0, 4.0, 3.0}, 0.1);
  world.fill({{4.0, 0.0, 0.0}, {4.2, 4.0, 3.0}}, true);
  const FreeSpace space = world.space();
  const SafetyCheck check;
  const SafetyReport wall = check.check_path(space, {{1.0, 2.0, 1.5}, {5.0, 2.0, 1.5}});
  CHECK(wall.verdict == Verdict::kOccupied);
  CHECK(wall.at_time_s == Approx(2.8).margin(0.06));
  CHECK(check.check_path(space, {{1.0, 2.0, 1.5}, {3.7, 2.0, 1.5}}).safe());
  CHECK(check.check_path(space, {{1.0, 2.0, 1.5}, {-1.0, 2.0, 1.5}}).verdict == Verdict::kOutsideBox);
  CHECK(check.check_path(space, {{1.0, 2.0, 1.5}, {std::nan(""), 2.0, 1.5}}).verdict == Verdict::kOutsideBox);
  const mapping::OccupancyMap empty(GridSpec({{0, 0, 0}, {4, 4, 4}}, 0.1));
  mapping::DistanceField field(empty.grid(), 1.0, mapping::Obstacles::kBlocked);
  field.update(empty);
  const FreeSpace unknown(empty, field, {0.2, 0.0}, {{0, 0, 0}, {4, 4, 4}});
  CHECK(check.check_path(unknown, {{1, 1, 1}, {2, 2, 2}}).verdict == Verdict::kUnknown);
}

TEST_CASE("a UAV that the map has closed in on may leave, not push on", "[safety]") {
  TestWorld world({6.0, 4.0, 3.0}, 0.1);
  world.fill({{4.0, 0.0, 0.0}, {4.2, 4.0, 3.0}}, true);
  const FreeSpace space = world.space();
  const SafetyCheck check;
  CHECK(check.check_path(space, {{3.85, 2.0, 1.5}, {2.0, 2.0, 1.5}}).safe());
  CHECK_FALSE(check.check_path(space, {{3.85, 2.0, 1.5}, {3.95, 2.0, 1.5}}).safe());
  CHECK_FALSE(check.check_path(space, {{3.85, 2.0, 1.5}, {3.85, 3.5, 1.5}}).safe());
  CHECK_FALSE(check.check_path(space, {{4.05, 2.0, 1.5}, {2.0, 2.0, 1.5}}).safe());
}

TEST_CASE("limits are checked by finite differences", "[safety]") {
  TestWorld world({8.0, 4.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  const Trajectory fine = flight(space, 0.0, {1.0, 2.0, 1.5}, {7.0, 2.0, 1.5});
  const SafetyCheck check;
  CHECK(check.check_limits(fine, MotionLimits{}, 0.0).safe());
  MotionLimits slow;
  slow.speed_mps = 1.0;
  CHECK(check.check_limits(fine, slow, 0.0).verdict == Verdict::kLimits);
  CHECK(check.check_limits(fine, slow, fine.end_time_s()).safe());
  MotionLimits lazy;
  lazy.acceleration_mps2 = 1.5;
  CHECK(check.check_limits(fine, lazy, 0.0).verdict == Verdict::kLimits);
  auto states = fine.states();
  states[50].position_m.y() += 0.2;
  CHECK(check.check_limits(Trajectory(0.0, states), MotionLimits{}, 0.0).verdict == Verdict::kLimits);
  states = fine.states();
  states.resize(60);  // ends in full flight
  CHECK(check.check_limits(Trajectory(0.0, states), MotionLimits{}, 0.0).verdict == Verdict::kLimits);
}

TEST_CASE("fellows are met in space and time only", "[safety]") {
  TestWorld world({8.0, 8.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  const SafetyCheck check;
  const Trajectory east = flight(space, 0.0, {1.0, 4.0, 1.5}, {7.0, 4.0, 1.5});
  const Trajectory west = flight(space, 0.0, {7.0, 4.0, 1.5}, {1.0, 4.0, 1.5});
  const Trajectory north = flight(space, 0.0, {4.0, 1.0, 1.5}, {4.0, 7.0, 1.5});
  const Trajectory later = flight(space, 3.0, {4.0, 1.0, 1.5}, {4.0, 7.0, 1.5});
  const Trajectory above = flight(space, 0.0, {7.0, 4.0, 2.2}, {1.0, 4.0, 2.2});
  const Trajectory parked = Trajectory::hover(0.0, {7.0, 4.3, 1.5}, 0.0);
  const SafetyReport head_on = check.check_fellows(east, {&west}, 0.0);
  CHECK(head_on.verdict == Verdict::kFellow);
  CHECK(std::abs(head_on.at_m.x() - 3.75) < 0.05);
  CHECK(check.check_fellows(east, {&north}, 0.0).verdict == Verdict::kFellow);
  CHECK(check.check_fellows(east, {&later}, 0.0).safe());
  CHECK(check.check_fellows(east, {&above, nullptr}, 0.0).safe());
  CHECK(check.check_fellows(east, {&parked}, 0.0).verdict == Verdict::kFellow);
  CHECK(check.check_fellows(east, {&above, &parked, &west}, 0.0).at_time_s == Approx(head_on.at_time_s).margin(0.02));
  // One that flies through where this one rests at its end, long after.
  const Trajectory late = flight(space, 20.0, {7.0, 1.0, 1.5}, {7.0, 7.0, 1.5});
  CHECK(check.check_fellows(east, {&late}, 0.0).verdict == Verdict::kFellow);
}
