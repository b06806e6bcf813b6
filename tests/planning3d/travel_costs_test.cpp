#include "planning3d/travel_costs.hpp"

#include "checkers/path_checker.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <queue>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::cpu_ms_since;
using stairwell::test::TestWorld;

namespace {

std::vector<double> plain_costs_m(const FreeSpace& space, int stride, const VoxelIndex& source,
                                  const std::vector<int>* layers) {
  const GridSpec& grid = space.grid();
  int n[3];
  for (std::size_t a = 0; a < 3; ++a) n[a] = (grid.size()[a] + stride - 1) / stride;
  const auto at = [&n](int x, int y, int z) { return static_cast<std::size_t>((z * n[1] + y) * n[0] + x); };
  const auto cells = static_cast<std::size_t>(n[0] * n[1] * n[2]);
  std::vector<char> passable(cells, 0);
  std::vector<char> level(cells, 0);
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    if (!space.traversable(v)) continue;
    passable[at(v.x / stride, v.y / stride, v.z / stride)] = 1;
    if (layers != nullptr && std::count(layers->begin(), layers->end(), v.z) > 0) {
      level[at(v.x / stride, v.y / stride, v.z / stride)] = 1;
    }
  }
  std::vector<double> cost(cells, INFINITY);
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const std::size_t first = at(source.x / stride, source.y / stride, source.z / stride);
  cost[first] = 0.0;
  open.push({0.0, first});
  while (!open.empty()) {
    const auto [c, i] = open.top();
    open.pop();
    if (c > cost[i]) continue;
    const int x = static_cast<int>(i) % n[0];
    const int y = static_cast<int>(i) / n[0] % n[1];
    const int z = static_cast<int>(i) / (n[0] * n[1]);
    for (int move = 0; move < 27; ++move) {
      const int d[3] = {move % 3 - 1, move / 3 % 3 - 1, move / 9 - 1};
      const int to[3] = {x + d[0], y + d[1], z + d[2]};
      if (to[0] < 0 || to[1] < 0 || to[2] < 0 || to[0] >= n[0] || to[1] >= n[1] || to[2] >= n[2]) continue;
      const std::size_t j = at(to[0], to[1], to[2]);
      if (passable[j] == 0) continue;
      if (layers != nullptr && (d[2] == 0 ? level[i] == 0 || level[j] == 0 : d[0] != 0 || d[1] != 0)) continue;
      const double through = c + std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * stride * grid.resolution_m();
      if (through >= cost[j]) continue;
      cost[j] = through;
      open.push({through, j});
    }
  }
  std::vector<double> by_voxel(grid.voxel_count());
  for (std::size_t i = 0; i < by_voxel.size(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    by_voxel[i] = cost[at(v.x / stride, v.y / stride, v.z / stride)];
  }
  return by_voxel;
}

}  // namespace

TEST_CASE("travel costs are what a plain Dijkstra finds", "[travel_costs]") {
  Rng rng = make_rng(1, "costs");
  for (int round = 0; round < 24; ++round) {
    TestWorld world({4.3, 4.1, 2.1}, 0.1);
    world.clutter(rng, 25, 1.5);
    const FreeSpace space = world.space();
    const int stride = 1 + round % 3;
    const bool slice = round % 2 == 1;
    const double limit_m = round % 4 < 2 ? INFINITY : 2.0;
    const std::vector<int> layers{6, 14};
    const MotionRule rule = slice ? MotionRule::slice({0.65, 1.45}) : MotionRule::volume();
    TravelCosts costs(stride);
    for (int again = 0; again < 2; ++again) {
      const Eigen::Vector3d source_m = world.random_place(space, rng);
      costs.compute(space, source_m, rule, limit_m);
      const auto plain_m = plain_costs_m(space, stride, space.grid().index_of(source_m), slice ? &layers : nullptr);
      int wrong = 0;
      for (std::size_t i = 0; i < plain_m.size(); ++i) {
        const double got_m = static_cast<double>(costs.distance_m(space.grid().voxel(i)));
        const double want_m = plain_m[i] <= limit_m + 1e-6 ? plain_m[i] : INFINITY;
        if (std::isinf(got_m) != std::isinf(want_m) || (!std::isinf(got_m) && std::abs(got_m - want_m) > 1e-4)) ++wrong;
      }
      CHECK(wrong == 0);
      const Eigen::Vector3d target_m = world.random_place(space, rng);
      const auto path_m = costs.path_to(target_m);
      const double distance_m = static_cast<double>(costs.distance_m(target_m));
      CHECK(path_m.empty() == std::isinf(distance_m));
      double length_m = 0.0;
      for (std::size_t i = 0; i + 1 < path_m.size(); ++i) length_m += (path_m[i + 1] - path_m[i]).norm();
      for (std::size_t i = 1; i + 1 < path_m.size(); ++i) {  // centres of cells that can be reached
        const Eigen::Array3d cells = (path_m[i] - space.grid().box().min_m).array() / (stride * 0.1) - 0.5;
        if ((cells - cells.round()).abs().maxCoeff() > 1e-6 || std::isinf(costs.distance_m(path_m[i]))) {
          FAIL("no centre of a cell on the way: " << path_m[i].transpose());
        }
      }
      if (!path_m.empty()) CHECK(std::abs(length_m - distance_m) < 2.0 * stride * 0.1 * std::sqrt(3.0));
    }
  }
}

TEST_CASE("a passable lattice kept up to date equals a new one", "[travel_costs]") {
  Rng rng = make_rng(5, "lattice");
  for (int round = 0; round < 12; ++round) {
    const GridSpec grid({Eigen::Vector3d::Zero(), Eigen::Vector3d(4.3, 3.1, 2.5)}, 0.1);
    mapping::OccupancyMap map(grid);
    mapping::DistanceField field(grid, 1.0, mapping::Obstacles::kBlocked);
    Robot robot;
    robot.radius_m = 0.2;
    const int stride = 1 + round % 4;
    const MotionRule rule = round % 2 == 0 ? MotionRule::volume() : MotionRule::slice({0.75, 1.55});
    PassableLattice kept(stride);
    std::ptrdiff_t passable = 0;
    const bool seldom = round % 3 == 2;  // much between two looks
    for (int i = 0; i < 40; ++i) {
      for (int change = 0; change < (seldom ? 40 : 3); ++change) {
        const Eigen::Vector3d at_m(rng.uniform(0.0, 4.3), rng.uniform(0.0, 3.1), rng.uniform(0.0, 2.5));
        const double half_m = rng.uniform(0.0, i < 3 ? 2.0 : 0.4);
        const bool occupied = i > 2 && rng.uniform() < 0.4;
        const VoxelIndex lo = grid.index_of(at_m - Eigen::Vector3d::Constant(half_m));
        const VoxelIndex hi = grid.index_of(at_m + Eigen::Vector3d::Constant(half_m));
        for (int z = lo.z; z <= hi.z; ++z)
          for (int y = lo.y; y <= hi.y; ++y)
            for (int x = lo.x; x <= hi.x; ++x) map.update({x, y, z}, occupied);
        field.update(map);
      }
      const FreeSpace space(map, field, robot, grid.box().inflated(-0.1));
      kept.update(space, rule);
      PassableLattice fresh(stride);
      fresh.update(space, rule);
      REQUIRE(kept.flags() == fresh.flags());
      passable += std::count(kept.flags().begin(), kept.flags().end(), PassableLattice::kPassable);
      if (i == 20) {  // another rule, another robot, and back
        kept.update(space, MotionRule::slice({1.05}));
        robot.radius_m = 0.3;
      }
    }
    CHECK(passable > 0);
    // Many single changes, then a copy that goes its own way under the same revision.
    const auto dig = [&](int x) {
      for (int y = 8; y < 22; ++y)
        for (int z = 6; z < 18; ++z) map.set_log_odds({x, y, z}, std::nanf(""));
    };
    map = mapping::OccupancyMap(grid);
    for (int z = 0; z < grid.size()[2]; ++z)
      for (int y = 0; y < grid.size()[1]; ++y)
        for (int x = 0; x < grid.size()[0]; ++x) map.set_log_odds({x, y, z}, -1.0F);
    field = mapping::DistanceField(grid, 1.0, mapping::Obstacles::kBlocked);
    field.update(map);
    kept.update(FreeSpace(map, field, robot, grid.box().inflated(-0.1)), rule);
    for (int i = 0; i < 700; ++i) {
      const int x = i < 40 ? 3 : 35;  // the first ones out of the last ones' reach
      map.set_log_odds({x, 8 + i % 14, 5 + i / 14 % 15}, i / 210 % 2 == 0 ? std::nanf("") : -1.0F);
      field.update(map);
    }
    kept.update(FreeSpace(map, field, robot, grid.box().inflated(-0.1)), rule);
    PassableLattice after(stride);
    after.update(FreeSpace(map, field, robot, grid.box().inflated(-0.1)), rule);
    REQUIRE(kept.flags() == after.flags());
    mapping::DistanceField other = field;
    dig(15);
    field.update(map);
    kept.update(FreeSpace(map, field, robot, grid.box()), rule);
    dig(30);
    other.update(map);
    const FreeSpace space(map, other, robot, grid.box());
    kept.update(space, rule);
    PassableLattice fresh(stride);
    fresh.update(space, rule);
    REQUIRE(kept.flags() == fresh.flags());
  }
}

TEST_CASE("travel costs of a whole storey are fast", "[travel_costs]") {
  Rng rng = make_rng(2, "costs-speed");
  TestWorld world({20.0, 20.0, 4.0}, 0.1);
  world.clutter(rng, 150, 2.0);
  const FreeSpace space = world.space();
  TravelCosts costs;
  double best_ms = 1e9;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d source_m = world.random_place(space, rng);
    const std::clock_t begin = std::clock();
    costs.compute(space, source_m, MotionRule::volume());
    best_ms = std::min(best_ms, cpu_ms_since(begin));
  }
  WARN("travel costs 20x20x4 m: " << best_ms << " ms");
  CHECK(costs.distance_m(Eigen::Vector3d(50, 0, 0)) == TravelCosts::kUnreachable);
  CHECK(costs.distance_m(Eigen::Vector3d(std::nan(""), 0, 0)) == TravelCosts::kUnreachable);
  costs.compute(space, {-5.0, 0.0, 0.0}, MotionRule::volume());
  CHECK(costs.distance_m(Eigen::Vector3d(10, 10, 2)) == TravelCosts::kUnreachable);
}

TEST_CASE("spheres against voxels are exact", "[free_space]") {
  Rng rng = make_rng(6, "spheres");
  TestWorld world({4.0, 4.0, 2.0}, 0.1);
  world.clutter(rng, 15, 1.0);
  const FreeSpace space = world.space();
  int free = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d at_m(rng.uniform(0.0, 4.0), rng.uniform(0.0, 4.0), rng.uniform(0.0, 2.0));
    const double radius_m = rng.uniform(0.05, 0.4);
    const double depth_m = checkers::penetration_m(world.map, at_m, radius_m);
    if (std::abs(depth_m) < 1e-8 && depth_m != 0.0) continue;
    const bool says = space.sphere_free(at_m, radius_m);
    if (says != (depth_m <= 0.0)) FAIL("sphere of " << radius_m << " m at " << at_m.transpose());
    if (says) ++free;
    if (!says && space.surely_free(at_m, radius_m)) FAIL("surely_free is wrong at " << at_m.transpose());
  }
  CHECK(free > 2000);
  // Traversable voxel centres hold the robot.
  for (std::size_t i = 0; i < space.grid().voxel_count(); ++i) {
    const VoxelIndex v = space.grid().voxel(i);
    if (space.traversable(v) && !space.sphere_free(space.grid().center_of(v), 0.2)) FAIL("traversable yet tight");
  }
}
