/// Scan integration beside OctoMap's own, on the same scans.
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include <optional>
#include <string>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

double resolution_m(const benchmark::State& state) { return 0.01 * static_cast<double>(state.range(0)); }

/// One iteration is one scan; after the last one a fresh map is begun.
void integrate(benchmark::State& state, const ScanIntegrator::Config& config) {
  const bench::Scene& scene = bench::office_tower();
  ScanIntegrator integrator(config);
  std::optional<OccupancyMap> map;
  std::size_t next = scene.scans.size();
  std::size_t steps = 0;
  std::size_t updated = 0;
  for (auto _ : state) {
    if (next == scene.scans.size()) {
      state.PauseTiming();
      map.emplace(GridSpec(scene.box, resolution_m(state)));
      next = 0;
      state.ResumeTiming();
    }
    const IntegrationStats stats = integrator.integrate(scene.scans[next++], *map);
    steps += stats.ray_steps;
    updated += stats.voxels_updated;
  }
  state.counters["ray_steps"] = benchmark::Counter(static_cast<double>(steps), benchmark::Counter::kAvgIterations);
  state.counters["voxels"] = benchmark::Counter(static_cast<double>(updated), benchmark::Counter::kAvgIterations);
}

void octomap_reference(benchmark::State& state, bool discretize) {
  const bench::Scene& scene = bench::office_tower();
  std::vector<octomap::Pointcloud> clouds;
  for (const Scan& scan : scene.scans) {
    clouds.emplace_back();
    for (const Eigen::Vector3f& p : world_points_of(scan)) clouds.back().push_back(p.x(), p.y(), p.z());
  }
  std::optional<octomap::OcTree> tree;
  std::size_t next = clouds.size();
  for (auto _ : state) {
    if (next == clouds.size()) {
      state.PauseTiming();
      tree.emplace(resolution_m(state));
      next = 0;
      state.ResumeTiming();
    }
    const Eigen::Vector3f origin_m = world_origin_of(scene.scans[next]);
    tree->insertPointCloud(clouds[next], {origin_m.x(), origin_m.y(), origin_m.z()}, scene.scans[next].max_range_m,
                           false, discretize);
    ++next;
  }
}

void exact_octomap(benchmark::State& state) { octomap_reference(state, false); }
void discretized_octomap(benchmark::State& state) { octomap_reference(state, true); }

/// Instructions that the processor lacks are skipped by name.
void ours(benchmark::State& state, ScanIntegrator::Config config) {
  if (!supported(config.simd)) {
    state.SkipWithError((std::string("no ") + name_of(config.simd)).c_str());
    return;
  }
  integrate(state, config);
}

}  // namespace

#define AT_BOTH_RESOLUTIONS ->Arg(10)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime()
BENCHMARK(exact_octomap) AT_BOTH_RESOLUTIONS;
BENCHMARK(discretized_octomap) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, exact_avx512, {.simd = Simd::kAvx512}) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, exact_avx2, {.simd = Simd::kAvx2}) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, exact_scalar, {.simd = Simd::kScalar}) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, exact_two_threads, {.threads = 2}) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, discretized_avx512, {.discretize = true, .simd = Simd::kAvx512}) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, discretized_avx2, {.discretize = true, .simd = Simd::kAvx2}) AT_BOTH_RESOLUTIONS;
BENCHMARK_CAPTURE(ours, discretized_scalar, {.discretize = true, .simd = Simd::kScalar}) AT_BOTH_RESOLUTIONS;
