/// Scan integration beside OctoMap's own, on the same scans.
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include <string>
#include <utility>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

/// One iteration is a fresh map of all scans; making the map is not counted.
void integrate(benchmark::State& state, double resolution_m, const ScanIntegrator::Config& config) {
  const bench::Scene& scene = bench::office_tower();
  const bench::MemoryNote memory(state);
  ScanIntegrator integrator(config);
  IntegrationStats sum;
  for (auto _ : state) {
    state.PauseTiming();
    OccupancyMap map(GridSpec(scene.box, resolution_m));
    sum = {};
    state.ResumeTiming();
    for (const Scan& scan : scene.scans) {
      const IntegrationStats stats = integrator.integrate(scan, map);
      sum.ray_steps += stats.ray_steps;
      sum.voxels_updated += stats.voxels_updated;
    }
    state.PauseTiming();
    { const OccupancyMap done = std::move(map); }
    state.ResumeTiming();
  }
  const auto scans = static_cast<double>(scene.scans.size());
  state.counters["scans"] = scans;
  state.counters["ray_steps_per_scan"] = static_cast<double>(sum.ray_steps) / scans;
  state.counters["voxels_per_scan"] = static_cast<double>(sum.voxels_updated) / scans;
}

void octomap_reference(benchmark::State& state, double resolution_m, bool discretize) {
  const bench::Scene& scene = bench::office_tower();
  std::vector<octomap::Pointcloud> clouds;
  for (const Scan& scan : scene.scans) {
    clouds.emplace_back();
    for (const Eigen::Vector3f& p : world_points_of(scan)) clouds.back().push_back(p.x(), p.y(), p.z());
  }
  const bench::MemoryNote memory(state);
  for (auto _ : state) {
    octomap::OcTree tree(resolution_m);
    for (std::size_t i = 0; i < clouds.size(); ++i) {
      const Eigen::Vector3f origin_m = world_origin_of(scene.scans[i]);
      tree.insertPointCloud(clouds[i], {origin_m.x(), origin_m.y(), origin_m.z()}, scene.scans[i].max_range_m, false,
                            discretize);
    }
    state.PauseTiming();
    tree.clear();
    state.ResumeTiming();
  }
  state.counters["scans"] = static_cast<double>(scene.scans.size());
}

/// Instructions that the processor lacks are skipped by name.
void ours(benchmark::State& state, double resolution_m, const ScanIntegrator::Config& config) {
  if (!supported(config.simd)) {
    state.SkipWithError((std::string("no ") + name_of(config.simd)).c_str());
    return;
  }
  integrate(state, resolution_m, config);
}

[[maybe_unused]] const bool registered = [] {
  for (const auto& [resolution_m, label] : bench::resolutions()) {
    for (const bool discretize : {false, true}) {
      const std::string name = std::string("integrate/") + (discretize ? "discretize/" : "exact/");
      const auto add = [&](const char* way, const ScanIntegrator::Config& config) {
        benchmark::RegisterBenchmark((name + way + "/" + label).c_str(), ours, resolution_m, config)
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      };
      benchmark::RegisterBenchmark((name + "octomap/" + label).c_str(), octomap_reference, resolution_m, discretize)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
      add("avx512", {.discretize = discretize, .simd = Simd::kAvx512});
      add("avx2", {.discretize = discretize, .simd = Simd::kAvx2});
      add("scalar", {.discretize = discretize, .simd = Simd::kScalar});
      add("best", {.discretize = discretize});
      add("two_threads", {.discretize = discretize, .threads = 2});
    }
  }
  return true;
}();

}  // namespace
