/// Collision checks beside FCL's, at the same poses in a map made from scans of the office tower.
///
/// collision/words/<shape>/<resolution>   this project: distance field, then occupancy words
/// collision/fcl/...                      fcl::OcTree over the map's own OcTree, FCL's default solver
/// collision/fcl_indep/...                the same with FCL's other solver
/// collision/fcl_boxes/...                a box for each occupied leaf in FCL's dynamic AABB tree
/// With `_blocked` unknown space counts as an obstacle (FCL: an OcTree that holds it as occupied). `collides` is the
/// share of the poses that do.
#include "mapping/collision.hpp"

#include "checkers/fcl_world.hpp"
#include "core/rng.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>

#include <map>
#include <string>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr std::size_t kPoses = 8192;

OccupancyMap scanned_map(double resolution_m) {
  OccupancyMap map(GridSpec(bench::office_tower().box, resolution_m));
  ScanIntegrator integrator;
  for (const Scan& scan : bench::office_tower().scans) integrator.integrate(scan, map);
  return map;
}

struct Views {
  OccupancyWords words;
  DistanceField distance;
  std::shared_ptr<const octomap::OcTree> tree;

  Views(const OccupancyMap& map, Obstacles obstacles)
      : words(map.grid(), obstacles), distance(map.grid(), 1.0, obstacles) {
    words.update(map);
    distance.update(map);
    tree = obstacles == Obstacles::kOccupied
               ? std::shared_ptr<const octomap::OcTree>(std::shared_ptr<void>(), &map.octree())
               : checkers::obstacle_tree(map, obstacles);
  }
};

/// What a sampling planner asks: anywhere in known-free voxels, turned any way.
std::vector<Pose> random_poses(const OccupancyMap& map) {
  Rng rng = make_rng(5, "benchmark collisions");
  std::vector<Pose> poses;
  while (poses.size() < kPoses) {
    const VoxelIndex v{rng.uniform_int(0, map.grid().size()[0] - 1), rng.uniform_int(0, map.grid().size()[1] - 1),
                       rng.uniform_int(0, map.grid().size()[2] - 1)};
    if (map.at(v) != Occupancy::kFree) continue;
    Pose T_world_body = Pose::Identity();
    T_world_body.translation() = map.grid().center_of(v);
    const Eigen::Quaterniond q(rng.normal(), rng.normal(), rng.normal(), rng.normal());
    for (double& coordinate : T_world_body.translation()) {
      coordinate += rng.uniform(-0.5, 0.5) * map.grid().resolution_m();
    }
    T_world_body.linear() = q.normalized().toRotationMatrix();
    poses.push_back(T_world_body);
  }
  return poses;
}

struct Bench {
  OccupancyMap map;
  Views occupied;
  Views blocked;
  std::vector<Pose> poses;

  explicit Bench(double resolution_m)
      : map(scanned_map(resolution_m)),
        occupied(map, Obstacles::kOccupied),
        blocked(map, Obstacles::kBlocked),
        poses(random_poses(map)) {}
};

const Bench& bench_at(const std::string& resolution) {
  static std::map<std::string, std::unique_ptr<Bench>> made;
  auto& bench = made[resolution];
  if (!bench) bench = std::make_unique<Bench>(std::stod(resolution));
  return *bench;
}

template <typename Collides>
void ask(benchmark::State& state, const std::vector<Pose>& poses, const Collides& collides) {
  std::size_t next = 0, asked = 0, hits = 0;
  for (auto _ : state) {
    const bool hit = collides(poses[next]);
    benchmark::DoNotOptimize(hit);
    hits += hit ? 1 : 0;
    ++asked;
    next = next + 1 == poses.size() ? 0 : next + 1;
  }
  state.counters["collides"] = static_cast<double>(hits) / static_cast<double>(asked);
}

struct Named {
  const char* name;
  CollisionShape shape;
};

// About the size of a UAV with its margin.
const Named kShapes[] = {{"sphere", SphereShape{0.3}},
                         {"box", BoxShape{{0.3, 0.25, 0.12}}},
                         {"ellipsoid", EllipsoidShape{{0.35, 0.3, 0.15}}},
                         {"cylinder", CylinderShape{0.3, 0.12}}};

void register_one(const std::string& suffix, const Named& shape, const std::string& resolution,
                  const Views Bench::*views) {
  const auto name = [&](const char* method) {
    return std::string("collision/") + method + suffix + "/" + shape.name + "/" + resolution;
  };
  const CollisionShape body = shape.shape;
  benchmark::RegisterBenchmark(name("words").c_str(), [body, resolution, views](benchmark::State& state) {
    const Bench& bench = bench_at(resolution);
    const CollisionChecker checker((bench.*views).words, (bench.*views).distance, body);
    ask(state, bench.poses, [&](const Pose& pose) { return checker.collides(pose); });
  });
  for (const auto& [method, solver] : {std::pair{"fcl", fcl::GST_LIBCCD}, {"fcl_indep", fcl::GST_INDEP}}) {
    benchmark::RegisterBenchmark(name(method).c_str(), [=, gjk = solver](benchmark::State& state) {
      const Bench& bench = bench_at(resolution);
      const checkers::FclOctree octree((bench.*views).tree, body, gjk);
      ask(state, bench.poses, [&](const Pose& pose) { return octree.collides(pose); });
    });
  }
  benchmark::RegisterBenchmark(name("fcl_boxes").c_str(), [body, resolution, views](benchmark::State& state) {
    const Bench& bench = bench_at(resolution);
    const checkers::FclBoxes boxes(*(bench.*views).tree, body);
    ask(state, bench.poses, [&](const Pose& pose) { return boxes.collides(pose); });
  });
}

const bool registered = [] {
  for (const char* resolution : {"0.10", "0.05"}) {
    for (const Named& shape : kShapes) {
      register_one("", shape, resolution, &Bench::occupied);
      register_one("_blocked", shape, resolution, &Bench::blocked);
    }
  }
  return true;
}();

}  // namespace
