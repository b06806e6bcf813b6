#include "mapping/scan_integrator.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "octomap_reference.hpp"

#include <octomap/ScanGraph.h>
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

#if defined(__SANITIZE_THREAD__)
constexpr int kSequences = 1;  // the sanitizer makes every hand-over between threads slow; one has all of them
#else
constexpr int kSequences = 12;
#endif

Pose random_pose(Rng& rng, double reach_m) {
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.translation() =
      Eigen::Vector3d(rng.uniform(-reach_m, reach_m), rng.uniform(-reach_m, reach_m), rng.uniform(-reach_m, reach_m));
  const Eigen::Vector3d axis(rng.normal(), rng.normal(), rng.normal());
  T_world_sensor.linear() = Eigen::AngleAxisd(rng.uniform(-kPi, kPi), axis.normalized()).toRotationMatrix();
  return T_world_sensor;
}

/// Ends anywhere within the reach.
Scan random_scan(Rng& rng, int points) {
  Scan scan;
  scan.T_world_sensor = random_pose(rng, 2.0);
  scan.max_range_m = rng.uniform_int(0, 3) == 0 ? -1.0 : rng.uniform(0.5, 6.0);
  for (int i = 0; i < points; ++i) {
    Eigen::Vector3d direction(rng.normal(), rng.normal(), rng.normal());
    scan.points_m.push_back((direction.normalized() * rng.uniform(0.0, 5.0)).cast<float>());
  }
  return scan;
}

/// Everything on the lattice: voxel corners, faces and centres, axis-aligned and diagonal rays, zero length.
Scan lattice_scan(Rng& rng, int points, double resolution_m) {
  Scan scan;
  const auto coordinate = [&](int reach) {
    return 0.5 * resolution_m * static_cast<double>(rng.uniform_int(-reach, reach));
  };
  scan.T_world_sensor.translation() = Eigen::Vector3d(coordinate(20), coordinate(20), coordinate(20));
  scan.max_range_m = rng.uniform_int(0, 1) == 0 ? -1.0 : 10.0 * resolution_m;
  for (int i = 0; i < points; ++i) {
    Eigen::Vector3f p(static_cast<float>(coordinate(40)), static_cast<float>(coordinate(40)),
                      static_cast<float>(coordinate(40)));
    switch (rng.uniform_int(0, 4)) {
      case 0:
        p.y() = p.z() = 0.0F;
        break;
      case 1:
        p.x() = 0.0F;
        break;
      case 2:
        p = Eigen::Vector3f::Constant(p.x());
        break;
      case 3:
        p = rng.uniform_int(0, 5) == 0 ? Eigen::Vector3f::Zero() : p;
        break;
      default:
        break;
    }
    scan.points_m.push_back(p);
  }
  return scan;
}

/// The sensor within a hair's breadth of voxel borders; ways of all sizes, short along some axes and long along others.
Scan border_scan(Rng& rng, int points, double resolution_m) {
  const auto hair = [&](double least, double most) {
    return rng.uniform(-1.0, 1.0) * resolution_m * std::pow(10.0, rng.uniform(least, most));
  };
  Scan scan;
  for (double& at_m : scan.T_world_sensor.translation()) {
    at_m = resolution_m * rng.uniform_int(-2, 2);
    if (rng.uniform_int(0, 3) > 0) at_m += hair(-12.0, -4.0);
  }
  scan.max_range_m = -1.0;
  for (int i = 0; i < points; ++i) {
    scan.points_m.push_back(Eigen::Vector3d(hair(-8.0, 1.5), hair(-8.0, 1.5), hair(-8.0, 1.5)).cast<float>());
  }
  return scan;
}

void spoil(Rng& rng, Scan& scan) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -infinity}) {
    Eigen::Vector3f p(1.0F, 2.0F, 0.5F);
    p[rng.uniform_int(0, 2)] = bad;
    scan.points_m.push_back(p);
  }
}

GridSpec wide_grid(double resolution_m) {
  const double reach_m = std::max(10.0, 60.0 * resolution_m);
  return {{Eigen::Vector3d::Constant(-reach_m), Eigen::Vector3d::Constant(reach_m)}, resolution_m};
}

struct Candidate {
  std::string name;
  ScanIntegrator integrator;
  OccupancyMap map;
};

/// One for every kind of instructions that the processor has, and some with threads.
std::vector<Candidate> every_way(bool discretize, const std::optional<Aabb>& limit, const GridSpec& grid,
                                 const OccupancyParams& params, bool many_threads) {
  std::vector<Candidate> all;
  const auto add = [&](Simd simd, int threads) {
    if (!supported(simd)) return;
    all.push_back({std::string(name_of(simd)) + " x " + std::to_string(threads),
                   ScanIntegrator({.discretize = discretize, .threads = threads, .simd = simd, .limit = limit}),
                   OccupancyMap(grid, params)});
    all.back().map.detect_changes(true);
  };
  add(Simd::kScalar, 1);
  add(Simd::kAvx2, 1);
  add(Simd::kAvx512, 1);
  add(Simd::kBest, 2);
  if (many_threads) add(Simd::kBest, 5);
  return all;
}

Aabb random_limit(Rng& rng) {
  Aabb box;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    box.min_m[axis] = rng.uniform(-4.0, 0.5);
    box.max_m[axis] = box.min_m[axis] + rng.uniform(0.3, 6.0);
  }
  return box;
}

void limit_tree(octomap::OcTree& tree, const Aabb& limit) {
  octomap::point3d lo = octomap_point(limit.min_m.cast<float>());
  octomap::point3d hi = octomap_point(limit.max_m.cast<float>());
  tree.useBBXLimit(true);
  tree.setBBXMin(lo);
  tree.setBBXMax(hi);
}

/// Key and whether it was created.
using ChangedKeys = std::map<std::array<int, 3>, bool>;

ChangedKeys changed_keys(const octomap::OcTree& tree) {
  ChangedKeys found;
  for (auto it = tree.changedKeysBegin(); it != tree.changedKeysEnd(); ++it) {
    found[{it->first[0], it->first[1], it->first[2]}] = it->second;
  }
  return found;
}

ChangedKeys changed_keys(const OccupancyMap& map) {
  ChangedKeys found;
  for (const auto& [voxel, created] : map.changes()) {
    const std::array<int, 3>& first = map.grid().first_cell();
    found[{voxel.x + first[0] + 32768, voxel.y + first[1] + 32768, voxel.z + first[2] + 32768}] = created;
  }
  return found;
}

}  // namespace

TEST_CASE("integrated scans leave OctoMap's .ot file byte for byte", "[integrator]") {
  // More than a thousand scans for each kind of instructions and for threads, except under ThreadSanitizer.
  const bool discretize = GENERATE(false, true);
  const double resolution_m = GENERATE(0.1, 0.05, 0.25, 0.37);
  const bool limited = GENERATE(false, true);
  Rng rng = make_rng(7, std::string(discretize ? "discrete" : "exact") + (limited ? " limited" : ""));
  for (int sequence = 0; sequence < kSequences; ++sequence) {
    OccupancyParams params;
    if (sequence % 3 == 1) {
      params = {0.85, 0.3, 0.2, 0.9, 0.6};
    }
    octomap::OcTree tree(resolution_m);
    set_params(tree, params);
    tree.enableChangeDetection(true);
    std::optional<Aabb> limit;
    if (limited) {
      limit = random_limit(rng);
      limit_tree(tree, *limit);
    }
    std::vector<Candidate> candidates =
        every_way(discretize, limit, wide_grid(resolution_m), params, sequence % 6 == 0);
    for (int i = 0; i < 6; ++i) {
      Scan scan = sequence % 2 == 0 ? random_scan(rng, 150) : lattice_scan(rng, 150, resolution_m);
      spoil(rng, scan);
      insert_scan(tree, scan, discretize);
      for (Candidate& candidate : candidates) {
        REQUIRE(candidate.integrator.integrate(scan, candidate.map).dropped_not_finite == 3);
      }
      if (i == 2) tree.resetChangeDetection();
      for (Candidate& candidate : candidates) {
        INFO(candidate.name << ", sequence " << sequence << ", scan " << i);
        if (i == 2) candidate.map.forget_changes();
        if (i % 2 == 1) {
          REQUIRE((ot_bytes(candidate.map.octree()) == ot_bytes(tree)));
          REQUIRE((changed_keys(candidate.map) == changed_keys(tree)));
        }
      }
    }
  }
}

TEST_CASE("rays from beside a voxel border match OctoMap", "[integrator]") {
  // OctoMap's half voxel is rounded to float32: its borders lie a little off, which decides what is entered first.
  const double resolution_m = GENERATE(0.01, 0.1, 0.37);
  const GridSpec grid({Eigen::Vector3d::Constant(-40.0 * resolution_m), Eigen::Vector3d::Constant(40.0 * resolution_m)},
                      resolution_m);
  Rng rng = make_rng(11, "borders");
  for (int round = 0; round < 60; ++round) {
    const Scan scan = border_scan(rng, 150, resolution_m);
    octomap::OcTree tree(resolution_m);
    insert_scan(tree, scan, false);
    for (Candidate& candidate : every_way(false, {}, grid, {}, false)) {
      INFO(candidate.name << ", round " << round);
      candidate.integrator.integrate(scan, candidate.map);
      REQUIRE((ot_bytes(candidate.map.octree()) == ot_bytes(tree)));
    }
  }
}

TEST_CASE("a map of a part of space gets the same values there", "[integrator]") {
  // Sensors and returns lie inside and outside of the small box; within it nothing may differ.
  const bool discretize = GENERATE(false, true);
  const double resolution_m = 0.1;
  Rng rng = make_rng(8, discretize ? "clipped-discrete" : "clipped-exact");
  for (int round = 0; round < 25; ++round) {
    const Eigen::Vector3d lo_m(rng.uniform(-3.0, 0.0), rng.uniform(-3.0, 0.0), rng.uniform(-3.0, 0.0));
    const Eigen::Vector3d size_m(rng.uniform(0.2, 3.0), rng.uniform(0.2, 3.0), rng.uniform(0.2, 3.0));
    const GridSpec grid({lo_m, lo_m + size_m}, resolution_m);
    OccupancyMap part(grid);
    OccupancyMap whole(wide_grid(resolution_m));
    ScanIntegrator integrator({.discretize = discretize});
    ScanIntegrator whole_integrator({.discretize = discretize});
    for (int i = 0; i < 4; ++i) {
      const Scan scan = (round + i) % 2 == 0 ? random_scan(rng, 200) : lattice_scan(rng, 200, resolution_m);
      integrator.integrate(scan, part);
      whole_integrator.integrate(scan, whole);
    }
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      const VoxelIndex v = grid.voxel(i);
      const float found = part.log_odds(v);
      const float expected = whole.log_odds(whole.grid().index_of(grid.center_of(v)));
      REQUIRE((found == expected || (std::isnan(found) && std::isnan(expected))));
    }
  }
}

TEST_CASE("statistics count what was done", "[integrator]") {
  OccupancyMap map(wide_grid(0.1));
  ScanIntegrator integrator;
  Scan scan;
  scan.T_world_sensor.translation() = Eigen::Vector3d(0.05, 0.05, 0.05);
  scan.points_m = {{1.0F, 0.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, 20.0F, 0.0F}, {NAN, 0.0F, 0.0F}};
  scan.max_range_m = 2.0;
  const IntegrationStats stats = integrator.integrate(scan, map);
  CHECK(stats.points == 4);
  CHECK(stats.dropped_not_finite == 1);
  CHECK(stats.ray_steps == 10 + 10 + 20);
  CHECK(stats.voxels_updated == 10 + 1 + 19);
  CHECK(stats.voxels_changed == stats.voxels_updated);
  CHECK(map.known_voxels() == stats.voxels_changed);
  CHECK(map.occupied_voxels() == 1);
  const IntegrationStats again = integrator.integrate(scan, map);
  CHECK(again.voxels_updated == stats.voxels_updated);
  CHECK(again.voxels_changed == 0);
}

TEST_CASE("scans carved at once and stored in turn make the map of scans integrated in turn", "[integrator]") {
  const bool discretize = GENERATE(false, true);
  const double resolution_m = 0.1;
  Rng rng(19);
  std::vector<Scan> scans;
  for (int i = 0; i < 6; ++i) scans.push_back(border_scan(rng, 300, resolution_m));
  scans.push_back(scans.front());
  scans.back().T_world_sensor.translation() = Eigen::Vector3d(500.0, 0.0, 0.0);  // nothing of it is in the map
  OccupancyMap plain(wide_grid(resolution_m));
  ScanIntegrator integrator({.discretize = discretize});
  OccupancyMap halves(wide_grid(resolution_m));
  std::vector<CarvedScan> carved(scans.size());
  for (CarvedScan& one : carved) one.updates.assign(1, std::vector<BlockUpdate>(3));  // what is there is void
  std::vector<std::thread> threads;
  for (std::size_t first = 0; first < 2; ++first) {
    threads.emplace_back([&, first] {
      ScanIntegrator carver({.discretize = discretize});
      for (std::size_t i = first; i < scans.size(); i += 2) carver.carve(scans[i], halves, carved[i], 2);
    });
  }
  for (std::thread& thread : threads) thread.join();
  ScanIntegrator storing({.discretize = discretize, .threads = 2});
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const IntegrationStats expected = integrator.integrate(scans[i], plain);
    const IntegrationStats stats = storing.store(carved[i], halves);
    CHECK(stats.ray_steps == expected.ray_steps);
    CHECK(stats.voxels_updated == expected.voxels_updated);
    CHECK(stats.voxels_changed == expected.voxels_changed);
    CHECK(halves.revision() == plain.revision());
  }
  std::vector<VoxelIndex> order, expected_order;
  halves.for_each_block_changed_since(0, [&](const VoxelBox& box) { order.push_back(box.lo); });
  plain.for_each_block_changed_since(0, [&](const VoxelBox& box) { expected_order.push_back(box.lo); });
  CHECK(order == expected_order);
  bool same = true;
  for (std::size_t i = 0; i < plain.grid().voxel_count(); ++i) {
    const VoxelIndex v = plain.grid().voxel(i);
    const float a = plain.log_odds(v), b = halves.log_odds(v);
    same = same && (a == b || (std::isnan(a) && std::isnan(b))) && plain.ever_hit(v) == halves.ever_hit(v);
  }
  CHECK(same);
}

TEST_CASE("extreme numbers neither crash nor hang", "[integrator]") {
  const bool discretize = GENERATE(false, true);
  OccupancyMap map(GridSpec({Eigen::Vector3d::Constant(-1.0), Eigen::Vector3d::Constant(1.0)}, 0.1));
  ScanIntegrator integrator({.discretize = discretize});
  Scan scan;
  for (const double range_m : {-1.0, 0.0, 1e-30, 5.0, 1e30, static_cast<double>(INFINITY)}) {
    scan.max_range_m = range_m;
    scan.points_m.clear();
    for (const float far : {1e-45F, 1e-30F, 1e-20F, 1e-8F, 3276.7F, 3276.8F, 1e5F, 2.2e8F, 1e20F, 3e38F}) {
      scan.points_m.push_back({far, far, far});
      scan.points_m.push_back({-far, -far, far});
      scan.points_m.push_back({-far, 0.0F, 0.0F});
      scan.points_m.push_back({0.3F, -far, far});
    }
    CHECK_NOTHROW(integrator.integrate(scan, map));
  }
  scan.max_range_m = NAN;
  CHECK_THROWS_AS(integrator.integrate(scan, map), InputError);
  scan.max_range_m = 5.0;
  scan.T_world_sensor.translation().x() = NAN;
  CHECK_THROWS_AS(integrator.integrate(scan, map), InputError);
  scan.T_world_sensor.translation().x() = 1e6;
  CHECK_THROWS_AS(integrator.integrate(scan, map), InputError);
  scan.T_world_sensor.translation().x() = 50.0;  // far outside the box, and looking away from it
  OccupancyMap untouched(map.grid());
  scan.points_m.clear();
  CHECK(integrator.integrate(scan, untouched).points == 0);
  scan.points_m = {{1.0F, 0.0F, 0.0F}};
  CHECK(integrator.integrate(scan, untouched).voxels_updated == 0);
  CHECK(untouched.known_voxels() == 0);
}

TEST_CASE("the ends of the key space and large worlds match OctoMap", "[integrator]") {
  Rng rng = make_rng(9, "ends");
  const double resolution_m = 0.1;
  // One corner of the key space; 1500 voxels along one axis.
  const Eigen::Vector3d corner_m = Eigen::Vector3d::Constant(3276.8);
  OccupancyMap map(GridSpec({corner_m - Eigen::Vector3d(150.0, 6.0, 6.0), corner_m}, resolution_m));
  octomap::OcTree tree(resolution_m);
  ScanIntegrator integrator;
  for (int i = 0; i < 6; ++i) {
    Scan scan;
    scan.T_world_sensor.translation() = corner_m - Eigen::Vector3d(rng.uniform(1.0, 140.0), 3.0, 3.0);
    scan.max_range_m = -1.0;
    for (int k = 0; k < 60; ++k) {
      const double reach_m = rng.uniform(-1.0, 1.0);
      scan.points_m.push_back({static_cast<float>(100.0 * reach_m * reach_m * reach_m),
                               static_cast<float>(rng.uniform(-2.5, 2.5)), static_cast<float>(rng.uniform(-2.5, 2.5))});
    }
    std::erase_if(scan.points_m, [&](const Eigen::Vector3f& p) {
      const double x_m = scan.T_world_sensor.translation().x() + static_cast<double>(p.x());
      return x_m < corner_m.x() - 149.0 || x_m > corner_m.x() - 0.2;
    });
    integrator.integrate(scan, map);
    insert_scan(tree, scan, false);
    REQUIRE((ot_bytes(map.octree()) == ot_bytes(tree)));
  }
}

TEST_CASE("the public scan graph leaves OctoMap's map", "[integrator]") {
  const std::filesystem::path file =
      std::filesystem::path(STAIRWELL_SOURCE_DIR) / "../shared/data/octomap/spherical_scan.graph";
  if (!std::filesystem::exists(file)) {
    WARN("skipped: shared/data/octomap/spherical_scan.graph is not there");
    return;
  }
  octomap::ScanGraph graph;
  REQUIRE(graph.readBinary(file.string()));
  const bool discretize = GENERATE(false, true);
  constexpr double kResolution_m = 0.1;
  std::vector<Scan> scans;
  Aabb box;
  for (const octomap::ScanNode* node : graph) {
    Scan scan;
    const Eigen::Quaterniond turn(node->pose.rot().u(), node->pose.rot().x(), node->pose.rot().y(),
                                  node->pose.rot().z());
    scan.T_world_sensor.linear() = turn.normalized().toRotationMatrix();
    scan.T_world_sensor.translation() = Eigen::Vector3d(node->pose.x(), node->pose.y(), node->pose.z());
    scan.max_range_m = -1.0;
    for (const octomap::point3d& p : *node->scan) scan.points_m.emplace_back(p.x(), p.y(), p.z());
    for (const Eigen::Vector3f& p : world_points_of(scan)) box.extend(p.cast<double>());
    box.extend(scan.T_world_sensor.translation());
    scans.push_back(scan);
  }
  REQUIRE(!scans.empty());
  octomap::OcTree tree(kResolution_m);
  for (const Scan& scan : scans) insert_scan(tree, scan, discretize);
  const std::string expected = ot_bytes(tree);
  for (Candidate& candidate :
       every_way(discretize, std::nullopt, GridSpec(box.inflated(kResolution_m), kResolution_m), {}, true)) {
    INFO(candidate.name);
    candidate.map.detect_changes(false);
    for (const Scan& scan : scans) candidate.integrator.integrate(scan, candidate.map);
    CHECK((ot_bytes(candidate.map.octree()) == expected));
  }
}

TEST_CASE("unusable integrators are refused", "[integrator]") {
  CHECK_THROWS_AS(ScanIntegrator({.threads = 0}), InputError);
  CHECK_THROWS_AS(ScanIntegrator({.threads = 1000}), InputError);
  CHECK_THROWS_AS(ScanIntegrator({.limit = Aabb{Eigen::Vector3d::Constant(NAN), Eigen::Vector3d::Ones()}}), InputError);
}
