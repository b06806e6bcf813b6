#include "planning3d/segment_check.hpp"

#include "checkers/path_checker.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

double gap_m(const Eigen::Vector3d& p_m, const Eigen::Vector3d& voxel_m, double half_m) {
  return ((p_m - voxel_m).cwiseAbs().array() - half_m).max(0.0).matrix().norm();
}

/// Least distance of a segment from blocked voxels, capped: along the segment the distance to a box is convex.
double clearance_m(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                   double cap_m) {
  const GridSpec& grid = map.grid();
  const VoxelIndex lo = grid.index_of(from_m.cwiseMin(to_m) - Eigen::Vector3d::Constant(cap_m));
  const VoxelIndex hi = grid.index_of(from_m.cwiseMax(to_m) + Eigen::Vector3d::Constant(cap_m));
  double least_m = cap_m;
  for (int z = lo.z; z <= hi.z; ++z) {
    for (int y = lo.y; y <= hi.y; ++y) {
      for (int x = lo.x; x <= hi.x; ++x) {
        const VoxelIndex v{x, y, z};
        if (!map.blocked(v)) continue;
        double begin = 0.0;
        double end = 1.0;
        const auto gap = [&](double u) {
          return gap_m(from_m + u * (to_m - from_m), grid.center_of(v), 0.5 * grid.resolution_m());
        };
        for (int i = 0; i < 30; ++i) {
          const double third = (end - begin) / 3.0;
          (gap(begin + third) <= gap(end - third) ? end : begin) =
              gap(begin + third) <= gap(end - third) ? end - third : begin + third;
        }
        least_m = std::min({least_m, gap(0.0), gap(1.0), gap(0.5 * (begin + end))});
      }
    }
  }
  return least_m;
}

}  // namespace

TEST_CASE("swept spheres agree with the distance to every voxel around", "[segment]") {
  Rng rng = make_rng(3, "segments");
  int free = 0;
  int hit = 0;
  int between = 0;  // hits that no end of the segment shows
  for (const double resolution_m : {0.1, 0.25, 0.5}) {
    TestWorld world({4.0, 4.0, 3.0}, resolution_m);
    world.clutter(rng, 14, 1.0);
    const FreeSpace space = world.space();
    const FreeSpace without_words(world.map, world.field, world.robot, world.box);
    for (int i = 0; i < 800; ++i) {
      const double radius_m = rng.uniform(0.05, 0.4);
      const Eigen::Vector3d from_m(rng.uniform(0.0, 4.0), rng.uniform(0.0, 4.0), rng.uniform(0.0, 3.0));
      const Eigen::Vector3d way_m(rng.normal(), rng.normal(), rng.normal());
      const Eigen::Vector3d to_m = from_m + rng.uniform(0.0, 0.6) * way_m;
      if (!world.box.contains(to_m)) continue;
      const double room_m = clearance_m(world.map, from_m, to_m, 0.5);
      if (std::abs(room_m - radius_m) < 1e-6) continue;
      const bool expected = room_m > radius_m;
      ++(expected ? free : hit);
      const bool ends_fit = space.sphere_free(from_m, radius_m) && space.sphere_free(to_m, radius_m);
      if (!expected && ends_fit) ++between;
      if (space.swept_sphere_free(from_m, to_m, radius_m) != expected ||
          without_words.swept_sphere_free(from_m, to_m, radius_m) != expected) {
        FAIL("room " << room_m << ", radius " << radius_m << ", from " << from_m.transpose() << " to "
                     << to_m.transpose());
      }
    }
  }
  CHECK(free > 100);
  CHECK(hit > 100);
  CHECK(between > 8);
}

TEST_CASE("free segments leave room for the whole robot, in voxels as wide as itself too", "[segment]") {
  Rng rng = make_rng(4, "segments");
  int free = 0;
  int near = 0;
  for (const double resolution_m : {0.1, 0.4, 1.0}) {
    const double size_m = 24.0 * resolution_m;
    TestWorld world({size_m, size_m, 0.5 * size_m}, resolution_m, {0.4999 * std::max(resolution_m, 0.4), 0.0});
    world.clutter(rng, 30, 0.2 + 3.0 * resolution_m);
    const FreeSpace space = world.space();
    const SegmentCheck check(space, {}, Eigen::Vector3d::Zero());
    const double radius_m = world.robot.radius_m;
    for (int i = 0; i < 1500; ++i) {
      const Eigen::Vector3d from_m = world.random_place(space, rng);
      Eigen::Vector3d to_m = from_m + 8.0 * resolution_m * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal());
      to_m = space.grid().center_of(space.grid().index_of(to_m));
      if (!world.box.contains(to_m) || !check.segment_free(from_m, to_m)) continue;
      ++free;
      const double room_m = clearance_m(world.map, from_m, to_m, radius_m + 0.1);
      if (room_m < radius_m + 0.05) ++near;
      if (room_m < radius_m - 1e-6) FAIL("room " << room_m << " for radius " << radius_m);
    }
  }
  CHECK(free > 300);
  CHECK(near > 20);
}

TEST_CASE("a sweep is free where the sphere fits, also where no voxel lets a segment through", "[segment]") {
  Rng rng = make_rng(6, "sweeps");
  int more = 0;
  int spared = 0;
  TestWorld world({4.0, 4.0, 3.0}, 0.1, {0.25, 0.0});
  world.clutter(rng, 14, 1.0);
  const FreeSpace space = world.space();
  const SegmentCheck check(space, {}, Eigen::Vector3d::Zero());
  const double radius_m = world.robot.radius_m;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d from_m = world.random_place(space, rng);
    const Eigen::Vector3d to_m = from_m + 0.12 * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal());
    if (!world.box.contains(to_m)) {
      CHECK_FALSE(check.sweep_free(from_m, to_m));
      continue;
    }
    const double room_m = clearance_m(world.map, from_m, to_m, radius_m + 0.1);
    const bool sweep = check.sweep_free(from_m, to_m);
    if (std::abs(room_m - radius_m) > 1e-6 && sweep != (room_m > radius_m)) FAIL("room " << room_m);
    const bool segment = check.segment_free(from_m, to_m);
    if (segment && !sweep) FAIL("a free segment whose sweep is not");
    if (sweep && !segment) ++more;
    if (std::abs(room_m - radius_m - 0.05) < 1e-6) continue;
    const bool with_spare = check.sweep_free(from_m, to_m, 0.05);
    if (with_spare != (room_m > radius_m + 0.05)) FAIL("room " << room_m << " with a spare");
    if (sweep && !with_spare) ++spared;
  }
  CHECK(more > 20);
  CHECK(spared > 20);
}
