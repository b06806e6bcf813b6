/// Distance field beside dynamicEDT3D: what one more scan costs, truncated at 2 m, obstacles = occupied voxels.
#include "mapping/distance_field.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>
#include <dynamicEDT3D/dynamicEDTOctomap.h>

#include <string>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr double kTruncation_m = 2.0;

/// One iteration is a fresh map of all scans; only the updates after the second and later scans are counted.
void update_ours(benchmark::State& state, double resolution_m, Obstacles obstacles) {
  const bench::Scene& scene = bench::office_tower();
  const GridSpec grid(scene.box, resolution_m);
  ScanIntegrator integrator;
  const bench::MemoryNote memory(state);
  for (auto _ : state) {
    state.PauseTiming();
    OccupancyMap map(grid);
    DistanceField field(grid, kTruncation_m, obstacles);
    for (std::size_t i = 0; i < scene.scans.size(); ++i) {
      integrator.integrate(scene.scans[i], map);
      if (i > 0) state.ResumeTiming();
      field.update(map);
      if (i > 0) state.PauseTiming();
    }
    state.ResumeTiming();
  }
  state.counters["scans"] = static_cast<double>(scene.scans.size() - 1);
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

void update_dynamic_edt(benchmark::State& state, double resolution_m) {
  const bench::Scene& scene = bench::office_tower();
  const bench::MemoryNote memory(state);
  for (auto _ : state) {
    state.PauseTiming();
    {
      octomap::OcTree tree(resolution_m);
      tree.enableChangeDetection(true);
      insert(tree, scene.scans[0]);
      DynamicEDTOctomap field(static_cast<float>(kTruncation_m), &tree, octomap_point(scene.box.min_m),
                              octomap_point(scene.box.max_m), false);
      field.update();
      for (std::size_t i = 1; i < scene.scans.size(); ++i) {
        insert(tree, scene.scans[i]);
        state.ResumeTiming();
        field.update();
        state.PauseTiming();
      }
    }
    state.ResumeTiming();
  }
  state.counters["scans"] = static_cast<double>(scene.scans.size() - 1);
}

/// From nothing, over a map of all scans.
void rebuild_ours(benchmark::State& state, double resolution_m) {
  const bench::Scene& scene = bench::office_tower();
  OccupancyMap map(GridSpec(scene.box, resolution_m));
  ScanIntegrator integrator;
  for (const Scan& scan : scene.scans) integrator.integrate(scan, map);
  for (auto _ : state) {
    DistanceField field(map.grid(), kTruncation_m, Obstacles::kOccupied);
    field.update(map);
    benchmark::DoNotOptimize(field.data().data());
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const auto& [resolution_m, label] : bench::resolutions()) {
    const auto timed = [](benchmark::internal::Benchmark* one) { one->Unit(benchmark::kMillisecond)->UseRealTime(); };
    const auto name = [&](const char* what) { return std::string("distance/") + what + "/" + label; };
    timed(benchmark::RegisterBenchmark(name("update/dynamicEDT3D").c_str(), update_dynamic_edt, resolution_m));
    timed(
        benchmark::RegisterBenchmark(name("update/occupied").c_str(), update_ours, resolution_m, Obstacles::kOccupied));
    timed(benchmark::RegisterBenchmark(name("update/blocked").c_str(), update_ours, resolution_m, Obstacles::kBlocked));
    timed(benchmark::RegisterBenchmark(name("rebuild/occupied").c_str(), rebuild_ours, resolution_m));
  }
  return true;
}();

}  // namespace
