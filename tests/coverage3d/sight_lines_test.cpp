/// Lines of sight followed many at a time, against the walk of one.
#include "coverage3d/sight_lines.hpp"
#include "core/rng.hpp"
#include "coverage3d/voxel_walk.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;
using mapping::Simd;

/// Mostly free, with some walls, unknown voxels and returns in free ones.
mapping::OccupancyMap random_map(const GridSpec& grid, Rng& rng) {
  mapping::OccupancyMap map(grid);
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const double kind = rng.uniform();
    const VoxelIndex v = grid.voxel(i);
    if (kind < 0.02) continue;
    map.set_log_odds(v, kind < 0.05 ? 2.0F : -2.0F);
    if (kind > 0.97) map.mark_hit(v);
  }
  return map;
}

Eigen::Vector3d random_point(const GridSpec& grid, Rng& rng) {
  const Aabb box = grid.box();
  Eigen::Vector3d point_m;
  for (int axis = 0; axis < 3; ++axis) {
    point_m[axis] = box.min_m[axis] + rng.uniform() * 0.999 * (box.max_m[axis] - box.min_m[axis]);
  }
  return point_m;
}

std::uint32_t walked(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  std::uint32_t stop = SightLines::kNothing;
  walk_voxels(map.grid(), from_m, to_m, [&](const VoxelIndex& v) {
    if (map.at(v) == Occupancy::kFree && !map.ever_hit(v)) return true;
    stop = static_cast<std::uint32_t>(map.grid().linear(v));
    return false;
  });
  return stop;
}

TEST_CASE("lines of sight end where a walk along each of them ends, whatever the instructions", "[sight_lines]") {
  Rng rng(5);
  for (const double resolution_m : {0.1, 0.2, 0.35}) {
    const GridSpec grid(Aabb{{-3.1, -2.0, 0.4}, {4.2, 3.3, 5.0}}, resolution_m);
    const mapping::OccupancyMap map = random_map(grid, rng);
    SightLines lines;
    std::vector<std::uint32_t> expected;
    for (int i = 0; i < 1500; ++i) {
      const bool centres = i % 3 == 0;  // where borders are equally near
      Eigen::Vector3d from_m = random_point(grid, rng);
      Eigen::Vector3d to_m = i % 50 == 7 ? from_m : random_point(grid, rng);
      if (i % 5 == 0) to_m.z() = from_m.z();
      if (i % 7 == 0) to_m.x() = from_m.x();
      if (centres) {
        from_m = grid.center_of(grid.index_of(from_m));
        to_m = grid.center_of(grid.index_of(to_m));
      }
      lines.add(from_m, to_m);
      expected.push_back(walked(map, from_m, to_m));
    }
    REQUIRE(lines.size() == expected.size());
    for (const Simd simd : {Simd::kScalar, Simd::kAvx2, Simd::kBest}) {
      if (!mapping::supported(simd)) continue;
      CAPTURE(resolution_m, mapping::name_of(simd));
      CHECK(lines.follow(map, simd) == expected);
    }
  }
}

TEST_CASE("lines of sight through free space meet nothing", "[sight_lines]") {
  const GridSpec grid(Aabb{{0, 0, 0}, {2, 2, 2}}, 0.2);
  mapping::OccupancyMap map(grid);
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) map.set_log_odds(grid.voxel(i), -1.0F);
  SightLines lines;
  CHECK(lines.follow(map).empty());
  lines.add({0.1, 0.1, 0.1}, {1.9, 1.7, 1.1});
  CHECK(lines.follow(map) == std::vector{SightLines::kNothing});
  map.set_log_odds(grid.index_of({1.9, 1.7, 1.1}), 2.0F);
  CHECK(lines.follow(map) == std::vector{static_cast<std::uint32_t>(grid.linear(grid.index_of({1.9, 1.7, 1.1})))});
  lines.clear();
  CHECK(lines.size() == 0);
}

}  // namespace
