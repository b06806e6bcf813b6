#include "coverage3d/unknown_room.hpp"

#include "core/rng.hpp"
#include "coverage3d/frontier_voxels.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <set>

using namespace stairwell;
using namespace stairwell::coverage3d;

namespace {

using Key = std::array<int, 3>;

void fill(mapping::OccupancyMap& map, const Aabb& box, bool occupied) {
  const VoxelIndex lo = map.grid().index_of(box.min_m + Eigen::Vector3d::Constant(1e-6));
  const VoxelIndex hi = map.grid().index_of(box.max_m - Eigen::Vector3d::Constant(1e-6));
  for (int z = lo.z; z <= hi.z; ++z)
    for (int y = lo.y; y <= hi.y; ++y)
      for (int x = lo.x; x <= hi.x; ++x)
        for (int hits = 0; hits < 5; ++hits) map.update(VoxelIndex{x, y, z}, occupied);
}

/// The same with sets and a queue, asking for every voxel between two points.
double slowly(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierCluster& cluster) {
  const int step = static_cast<int>(std::lround(0.4 / map.grid().resolution_m()));
  const auto unknown = [&](const Key& v) {
    const VoxelIndex at{v[0], v[1], v[2]};
    return holds(box, at) && map.at(at) == Occupancy::kUnknown;
  };
  const auto voxel = [&](const Key& point) {
    return Key{step * point[0] + step / 2, step * point[1] + step / 2, step * point[2] + step / 2};
  };
  std::map<Key, int> steps;
  std::deque<Key> queue;
  const auto each_face = [](const Key& of, int by, const auto& visit) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int sign : {-1, 1}) {
        Key to = of;
        to[axis] += sign * by;
        visit(to);
      }
  };
  for (const VoxelIndex& cell : cluster.cells) {
    each_face({cell.x, cell.y, cell.z}, 1, [&](const Key& beside) {
      const Key point{beside[0] / step, beside[1] / step, beside[2] / step};
      if (unknown(beside) && unknown(voxel(point)) && steps.emplace(point, 0).second) queue.push_back(point);
    });
  }
  for (; !queue.empty(); queue.pop_front()) {
    const Key from = queue.front();
    if (steps[from] == 10) continue;
    each_face(from, 1, [&](const Key& to) {
      bool open = true;
      for (int i = 1; i <= step; ++i) {
        Key between = voxel(from);
        for (std::size_t axis = 0; axis < 3; ++axis) between[axis] += i * (to[axis] - from[axis]);
        open = open && unknown(between);
      }
      if (open && steps.emplace(to, steps[from] + 1).second) queue.push_back(to);
    });
  }
  return static_cast<double>(steps.size()) * std::pow(step * map.grid().resolution_m(), 3);
}

const FrontierCluster& cluster_near(const FrontierFinder& finder, const Eigen::Vector3d& at_m) {
  const FrontierCluster* nearest = nullptr;
  for (const auto& [id, cluster] : finder.clusters())
    if (nearest == nullptr || (cluster.center_m - at_m).norm() < (nearest->center_m - at_m).norm()) nearest = &cluster;
  REQUIRE(nearest != nullptr);
  return *nearest;
}

/// A known storey with a slab above it that has an opening, and a box with an open side on its floor.
struct Storey {
  GridSpec grid{{{0.0, 0.0, 0.0}, {12.0, 12.0, 6.0}}, 0.1};
  mapping::OccupancyMap map{grid};
  FrontierFinder finder{grid, {.box = grid.box()}};
  Storey() {
    fill(map, {{0.0, 0.0, 0.0}, {12.0, 12.0, 2.9}}, false);
    fill(map, {{0.0, 0.0, 2.9}, {12.0, 5.0, 3.0}}, true);
    fill(map, {{0.0, 7.0, 2.9}, {12.0, 12.0, 3.0}}, true);
    fill(map, {{0.0, 5.0, 2.9}, {5.0, 7.0, 3.0}}, true);
    fill(map, {{7.0, 5.0, 2.9}, {12.0, 7.0, 3.0}}, true);
  }
};

}  // namespace

TEST_CASE("an opening to an unknown storey leads to more than a pocket", "[unknown_room]") {
  Storey storey;
  GridSpec small({{0.0, 0.0, 0.0}, {6.0, 6.0, 3.0}}, 0.1);
  mapping::OccupancyMap pocket(small);
  fill(pocket, {{0.0, 0.0, 0.0}, {6.0, 6.0, 0.9}}, false);
  fill(pocket, {{0.0, 0.0, 2.1}, {6.0, 6.0, 3.0}}, false);
  fill(pocket, {{0.0, 0.0, 0.9}, {2.0, 6.0, 2.1}}, false);
  fill(pocket, {{4.0, 0.0, 0.9}, {6.0, 6.0, 2.1}}, false);
  fill(pocket, {{2.0, 0.0, 0.9}, {4.0, 2.0, 2.1}}, false);
  fill(pocket, {{2.0, 4.0, 0.9}, {4.0, 6.0, 2.1}}, false);
  FrontierFinder finder(small, {.box = small.box()});
  finder.update(pocket);
  storey.finder.update(storey.map);
  const double up_m3 = unknown_beyond_m3(storey.map, storey.finder.box(), cluster_near(storey.finder, {6.0, 6.0, 2.9}));
  const double in_m3 = unknown_beyond_m3(pocket, finder.box(), cluster_near(finder, {2.0, 3.0, 1.5}));
  CHECK(up_m3 > 30.0);
  CHECK(up_m3 < 12.0 * 12.0 * 3.0);
  CHECK(in_m3 > 2.0);
  CHECK(in_m3 < 7.5);  // 4.8 m3, and half a step on each side
}

TEST_CASE("unknown room beyond clusters is what a plain search finds", "[unknown_room]") {
  Rng rng = make_rng(8, "rooms");
  std::set<double> volumes;
  for (int round = 0; round < 12; ++round) {
    const double resolution_m = round % 2 == 0 ? 0.1 : 0.2;
    const GridSpec grid({{0.0, 0.0, 0.0}, {7.0, 6.0, 4.0}}, resolution_m);
    mapping::OccupancyMap map(grid);
    for (int i = 0; i < 14; ++i) {
      const Eigen::Vector3d lo_m(rng.uniform(0.0, 6.0), rng.uniform(0.0, 5.0), rng.uniform(0.0, 3.0));
      const Eigen::Vector3d size_m(rng.uniform(0.2, 3.0), rng.uniform(0.2, 3.0), rng.uniform(0.2, 2.0));
      const Aabb box{lo_m, (lo_m + size_m).cwiseMin(grid.box().max_m)};
      fill(map, box, rng.uniform() < 0.3);
    }
    FrontierFinder finder(grid, {.box = {{0.3, 0.0, 0.0}, {6.5, 6.0, 3.5}}});
    finder.update(map);
    for (const auto& [id, cluster] : finder.clusters()) {
      const double room_m3 = unknown_beyond_m3(map, finder.box(), cluster);
      if (room_m3 != slowly(map, finder.box(), cluster))
        FAIL("cluster " << id << ": " << room_m3 << " m3, not " << slowly(map, finder.box(), cluster));
      volumes.insert(room_m3);
    }
  }
  CHECK(volumes.size() > 100);
}
