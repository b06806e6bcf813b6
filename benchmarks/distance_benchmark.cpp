/// Distance field beside dynamicEDT3D: what one more scan costs, truncated at 2 m, obstacles = occupied voxels.
#include "mapping/distance_field.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>
#include <dynamicEDT3D/dynamicEDTOctomap.h>

#include <cmath>
#include <memory>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr double kTruncation_m = 2.0;

double resolution_m(const benchmark::State& state) { return 0.01 * static_cast<double>(state.range(0)); }

/// One iteration is the update after one scan; the first scan's is not counted.
void update_ours(benchmark::State& state, Obstacles obstacles) {
  const bench::Scene& scene = bench::office_tower();
  const GridSpec grid(scene.box, resolution_m(state));
  ScanIntegrator integrator;
  std::unique_ptr<OccupancyMap> map;
  std::unique_ptr<DistanceField> field;
  std::size_t next = scene.scans.size();
  for (auto _ : state) {
    state.PauseTiming();
    if (next == scene.scans.size()) {
      map = std::make_unique<OccupancyMap>(grid);
      field = std::make_unique<DistanceField>(grid, kTruncation_m, obstacles);
      integrator.integrate(scene.scans[0], *map);
      field->update(*map);
      next = 1;
    }
    integrator.integrate(scene.scans[next++], *map);
    state.ResumeTiming();
    field->update(*map);
  }
}

void insert(octomap::OcTree& tree, const Scan& scan) {
  octomap::Pointcloud cloud;
  for (const Eigen::Vector3f& p : world_points_of(scan)) cloud.push_back(p.x(), p.y(), p.z());
  const Eigen::Vector3f origin_m = world_origin_of(scan);
  tree.insertPointCloud(cloud, {origin_m.x(), origin_m.y(), origin_m.z()}, scan.max_range_m);
}

octomap::point3d octomap_point(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

void update_dynamic_edt(benchmark::State& state) {
  const bench::Scene& scene = bench::office_tower();
  std::unique_ptr<octomap::OcTree> tree;
  std::unique_ptr<DynamicEDTOctomap> field;
  std::size_t next = scene.scans.size();
  for (auto _ : state) {
    state.PauseTiming();
    if (next == scene.scans.size()) {
      field.reset();
      tree = std::make_unique<octomap::OcTree>(resolution_m(state));
      tree->enableChangeDetection(true);
      insert(*tree, scene.scans[0]);
      field = std::make_unique<DynamicEDTOctomap>(static_cast<float>(kTruncation_m), tree.get(),
                                                  octomap_point(scene.box.min_m), octomap_point(scene.box.max_m),
                                                  false);
      field->update();
      next = 1;
    }
    insert(*tree, scene.scans[next++]);
    state.ResumeTiming();
    field->update();
  }
}

/// From nothing, over a map of all scans.
void rebuild_ours(benchmark::State& state) {
  const bench::Scene& scene = bench::office_tower();
  OccupancyMap map(GridSpec(scene.box, resolution_m(state)));
  ScanIntegrator integrator;
  for (const Scan& scan : scene.scans) integrator.integrate(scan, map);
  for (auto _ : state) {
    DistanceField field(map.grid(), kTruncation_m, Obstacles::kOccupied);
    field.update(map);
    benchmark::DoNotOptimize(field.data().data());
  }
}

}  // namespace

#define AT_BOTH_RESOLUTIONS ->Arg(10)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime()
BENCHMARK(update_dynamic_edt) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(update_ours, occupied, Obstacles::kOccupied) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(update_ours, blocked, Obstacles::kBlocked) AT_BOTH_RESOLUTIONS;
BENCHMARK(rebuild_ours) AT_BOTH_RESOLUTIONS;
