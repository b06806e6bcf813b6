/// Collision checks beside FCL's, at the same poses in a map made from scans of the office tower.
///
/// collision/words/<shape>/<resolution>   this project: distance field, then occupancy words
/// collision/fcl/...                      fcl::OcTree over the map's own OcTree, FCL's default solver
/// collision/fcl_indep/...                the same with FCL's other solver
/// collision/fcl_boxes/...                a box for each occupied leaf in FCL's dynamic AABB tree
/// With `_blocked` unknown space counts as an obstacle (FCL: an OcTree that holds it as occupied). `_near`: only places
/// 0.1 to 0.4 m from an obstacle, where the distance field alone tells least. `collides` is the share that does.
///
/// motion/words/<shape>/<resolution>      CollisionChecker::collides_between, up to 2 m and any turn; nothing is missed
/// motion/fcl/...                         what OMPL's DiscreteMotionValidator would ask FCL: a pose every 2 cm
#include "mapping/collision.hpp"

#include "checkers/fcl_world.hpp"
#include "core/rng.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

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
std::vector<Pose> random_poses(const OccupancyMap& map, std::size_t count) {
  Rng rng = make_rng(5, "benchmark collisions");
  std::vector<Pose> poses;
  while (poses.size() < count) {
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
  std::vector<Pose> near_poses;

  explicit Bench(double resolution_m)
      : map(scanned_map(resolution_m)), occupied(map, Obstacles::kOccupied), blocked(map, Obstacles::kBlocked) {
    poses = random_poses(map, kPoses);
    near_poses = random_poses(map, 4 * kPoses);
    std::erase_if(near_poses, [this](const Pose& pose) {
      const double distance_m = occupied.distance.distance_m(map.grid().index_of(Eigen::Vector3d(pose.translation())));
      return distance_m < 0.1 || distance_m > 0.4;
    });
    if (near_poses.size() > kPoses) near_poses.resize(kPoses);
  }
};

const Bench& bench_at(const std::string& resolution) {
  static std::map<std::string, std::unique_ptr<Bench>> made;
  auto& bench = made[resolution];
  if (!bench) bench = std::make_unique<Bench>(std::stod(resolution));
  return *bench;
}

template <typename Question, typename Collides>
void ask(benchmark::State& state, const std::vector<Question>& questions, const Collides& collides) {
  std::size_t next = 0, asked = 0, hits = 0;
  for (auto _ : state) {
    const bool hit = collides(questions[next]);
    benchmark::DoNotOptimize(hit);
    hits += hit ? 1 : 0;
    ++asked;
    next = next + 1 == questions.size() ? 0 : next + 1;
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

void register_poses(const std::string& suffix, const Named& shape, const std::string& resolution,
                    const Views Bench::*views, const std::vector<Pose> Bench::*poses) {
  const auto name = [&](const char* method) {
    return std::string("collision/") + method + suffix + "/" + shape.name + "/" + resolution;
  };
  const CollisionShape body = shape.shape;
  benchmark::RegisterBenchmark(name("words").c_str(), [=](benchmark::State& state) {
    const Bench& bench = bench_at(resolution);
    const CollisionChecker checker((bench.*views).words, (bench.*views).distance, body);
    ask(state, bench.*poses, [&](const Pose& pose) { return checker.collides(pose); });
  });
  for (const auto& [method, solver] : {std::pair{"fcl", fcl::GST_LIBCCD}, {"fcl_indep", fcl::GST_INDEP}}) {
    benchmark::RegisterBenchmark(name(method).c_str(), [=, gjk = solver](benchmark::State& state) {
      const Bench& bench = bench_at(resolution);
      const checkers::FclOctree octree((bench.*views).tree, body, gjk);
      ask(state, bench.*poses, [&](const Pose& pose) { return octree.collides(pose); });
    });
  }
  benchmark::RegisterBenchmark(name("fcl_boxes").c_str(), [=](benchmark::State& state) {
    const Bench& bench = bench_at(resolution);
    const checkers::FclBoxes boxes(*(bench.*views).tree, body);
    ask(state, bench.*poses, [&](const Pose& pose) { return boxes.collides(pose); });
  });
}

/// From each pose at most 2 m towards the next one.
std::vector<std::pair<Pose, Pose>> motions(const std::vector<Pose>& poses) {
  std::vector<std::pair<Pose, Pose>> made;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    Pose to = poses[i + 1];
    const Eigen::Vector3d way_m = to.translation() - poses[i].translation();
    to.translation() = poses[i].translation() + std::min(1.0, 2.0 / way_m.norm()) * way_m;
    made.emplace_back(poses[i], to);
  }
  return made;
}

void register_motions(const Named& shape, const std::string& resolution) {
  const std::string end = std::string("/") + shape.name + "/" + resolution;
  const CollisionShape body = shape.shape;
  benchmark::RegisterBenchmark(("motion/words" + end).c_str(), [=](benchmark::State& state) {
    const Bench& bench = bench_at(resolution);
    const CollisionChecker checker(bench.occupied.words, bench.occupied.distance, body);
    ask(state, motions(bench.poses), [&](const auto& m) { return checker.collides_between(m.first, m.second); });
  });
  benchmark::RegisterBenchmark(("motion/fcl" + end).c_str(), [=](benchmark::State& state) {
    const Bench& bench = bench_at(resolution);
    const checkers::FclOctree octree(bench.occupied.tree, body);
    ask(state, motions(bench.poses), [&](const auto& m) {
      const Eigen::Quaterniond q_from(m.first.linear()), q_to(m.second.linear());
      const Eigen::Vector3d way_m = m.second.translation() - m.first.translation();
      const int steps = 1 + static_cast<int>(way_m.norm() / 0.02);
      for (int i = 0; i <= steps; ++i) {
        const double u = static_cast<double>(i) / steps;
        Pose at = Pose::Identity();
        at.translation() = m.first.translation() + u * way_m;
        at.linear() = q_from.slerp(u, q_to).toRotationMatrix();
        if (octree.collides(at)) return true;
      }
      return false;
    });
  });
}

const bool registered = [] {
  for (const char* resolution : {"0.10", "0.05"}) {
    for (const Named& shape : kShapes) {
      register_poses("", shape, resolution, &Bench::occupied, &Bench::poses);
      register_poses("_blocked", shape, resolution, &Bench::blocked, &Bench::poses);
      register_poses("_near", shape, resolution, &Bench::occupied, &Bench::near_poses);
      register_motions(shape, resolution);
    }
  }
  return true;
}();

}  // namespace
