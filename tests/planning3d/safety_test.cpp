#include "planning3d/safety_check.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/trajectory_builder.hpp"
#include "test_world.hpp"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
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

/// FCL's word on a sphere against every blocked voxel around it; what a voxel is called comes from the map.
Verdict verdict_by_fcl(const FreeSpace& space, const Eigen::Vector3d& position_m, double radius_m) {
  if (!space.flight_box().inflated(1e-6).contains(position_m)) return Verdict::kOutsideBox;
  const fcl::detail::GJKSolver_libccd<double> solver;
  const GridSpec& grid = space.grid();
  const fcl::Sphered sphere(std::max(1e-6, radius_m - 1e-6));
  const fcl::Boxd box(fcl::Vector3d::Constant(grid.resolution_m()));
  fcl::Transform3d T_world_sphere = fcl::Transform3d::Identity();
  T_world_sphere.translation() = position_m;
  const VoxelIndex from = grid.index_of(position_m - Eigen::Vector3d::Constant(radius_m));
  const VoxelIndex to = grid.index_of(position_m + Eigen::Vector3d::Constant(radius_m));
  bool occupied = false, unknown = false, outside = false;
  for (int z = from.z; z <= to.z; ++z) {
    for (int y = from.y; y <= to.y; ++y) {
      for (int x = from.x; x <= to.x; ++x) {
        const VoxelIndex v{x, y, z};
        if (!space.map().blocked(v)) continue;
        fcl::Transform3d T_world_box = fcl::Transform3d::Identity();
        T_world_box.translation() = grid.center_of(v);
        if (!solver.shapeIntersect(sphere, T_world_sphere, box, T_world_box,
                                   static_cast<std::vector<fcl::ContactPointd>*>(nullptr))) {
          continue;
        }
        const bool surface = space.map().at(v) == Occupancy::kOccupied || space.map().ever_hit(v);
        (surface ? occupied : grid.contains(v) ? unknown : outside) = true;
      }
    }
  }
  return occupied ? Verdict::kOccupied : unknown ? Verdict::kUnknown : outside ? Verdict::kOutsideBox : Verdict::kSafe;
}

}  // namespace

TEST_CASE("every verdict on a place is FCL's", "[safety]") {
  Rng rng = make_rng(9, "safety fcl");
  std::array<int, 4> seen{};
  for (const double resolution_m : {0.1, 0.07}) {
    TestWorld world({4.0, 4.0, 2.0}, resolution_m);
    world.clutter(rng, 15, 1.0);
    for (int i = 0; i < 40; ++i) {  // pockets of unknown space, and returns in free voxels
      const VoxelIndex at = world.map.grid().index_of(
          Eigen::Vector3d(rng.uniform(0.0, 4.0), rng.uniform(0.0, 4.0), rng.uniform(0.0, 2.0)));
      for (int x = 0; x < 4; ++x) world.map.set_log_odds(at + VoxelIndex{x, 0, 0}, std::nanf(""));
      world.map.mark_hit(at + VoxelIndex{0, 2, 0});
    }
    for (const Aabb& box : {world.box, world.box.inflated(0.3)}) {
      world.box = box;
      const FreeSpace space = world.space();
      const FreeSpace without_words(world.map, world.field, world.robot, world.box);
      const SafetyCheck check;
      for (int i = 0; i < 40000; ++i) {
        Eigen::Vector3d at_m(rng.uniform(-0.5, 4.5), rng.uniform(-0.5, 4.5), rng.uniform(-0.5, 2.5));
        const double radius_m = i % 3 == 0 ? 0.2 : rng.uniform(0.005, 0.45);
        if (i % 7 == 0) {  // rests against a lattice plane, exactly and to within the micrometre that is granted
          const double face_m = resolution_m * rng.uniform_int(0, 20);
          at_m[i % 3] = face_m + radius_m + (i % 2 == 0 ? 0.0 : rng.uniform(-2e-6, 2e-6));
        }
        const Verdict expected = verdict_by_fcl(space, at_m, radius_m);
        ++seen[static_cast<std::size_t>(expected)];
        const Verdict found = check.check_position(i % 4 == 0 ? without_words : space, at_m, radius_m);
        if (found != expected) {
          FAIL(to_string(found) << " instead of " << to_string(expected) << " at " << at_m.transpose() << ", radius "
                                << radius_m);
        }
      }
    }
  }
  CHECK(*std::min_element(seen.begin(), seen.end()) > 3000);  // safe, occupied, unknown, outside
}

TEST_CASE("verdicts on places agree with plain geometry", "[safety]") {
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

TEST_CASE("what lies between two checked places is met too", "[safety]") {
  TestWorld world({6.0, 4.0, 3.0}, 0.1);
  world.fill({{2.0, 2.0, 1.5}, {2.1, 2.1, 1.6}}, true);
  const FreeSpace space = world.space();
  SafetyCheck::Config coarse;
  coarse.step_m = 0.6;  // at 1.75 and 2.25 m, on both sides of the block's corner region
  const SafetyCheck check(coarse);
  const std::vector<Eigen::Vector3d> path_m{{1.25, 2.25, 1.55}, {3.25, 2.25, 1.55}};
  CHECK(check.check_path(space, path_m).verdict == Verdict::kOccupied);
  CHECK(check.check_path(space, {{1.25, 2.3, 1.55}, {3.25, 2.3, 1.55}}).safe());  // touches
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

TEST_CASE("from a fellow that is too near already a motion may lead away", "[safety]") {
  TestWorld world({8.0, 8.0, 3.0}, 0.1);
  const FreeSpace space = world.space();
  const SafetyCheck check;
  const Trajectory beside = Trajectory::hover(0.0, {4.0, 4.35, 1.5}, 0.0);
  const Trajectory near_after = Trajectory::hover(0.0, {4.0, 4.9, 1.5}, 0.0);
  const Trajectory away = flight(space, 0.0, {4.0, 4.0, 1.5}, {4.0, 1.0, 1.5});
  CHECK(check.check_fellows(away, {&beside}, 0.0).safe());
  CHECK(check.check_fellows(away, {&beside, &near_after}, 0.0).safe());
  CHECK(check.check_fellows(flight(space, 0.0, {4.0, 4.0, 1.5}, {1.0, 4.0, 1.5}), {&beside}, 0.0).safe());
  // Nearer at first; or away, but not far enough in the end; or back again; or not at all.
  const Trajectory past = flight(space, 0.0, {4.0, 4.0, 1.5}, {2.0, 7.0, 1.5});
  CHECK(check.check_fellows(past, {&beside}, 0.0).verdict == Verdict::kFellow);
  const Trajectory a_little = flight(space, 0.0, {4.0, 4.0, 1.5}, {4.0, 3.9, 1.5});
  CHECK(check.check_fellows(a_little, {&beside}, 0.0).verdict == Verdict::kFellow);
  const Trajectory back = flight(space, 0.0, {4.0, 4.2, 1.5}, {4.0, 6.0, 1.5});
  const Trajectory follows = flight(space, 0.0, {4.0, 3.8, 1.5}, {4.0, 6.0, 1.5});
  CHECK(check.check_fellows(back, {&follows}, 0.0).verdict == Verdict::kFellow);
  const Trajectory stays = Trajectory::hover(0.0, {4.0, 4.0, 1.5}, 0.0);
  const auto still = check.check_fellows(stays, {&beside}, 0.0);
  CHECK(still.verdict == Verdict::kFellow);
}
