/// From depth pixels to the potential, as one UAV does it ten times a second: deproject 320x240 pixels, integrate the
/// scan, update the distance field, the potential's two models and one agent's window. Every step of a flight is timed;
/// the counters tell its median and its worst.
#include "mapping/distance_field.hpp"
#include "mapping/potential_model.hpp"
#include "mapping/potential_window.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr double kTruncation_m = 2.0;
constexpr std::size_t kGoalEvery = 30;  ///< steps

/// What a camera delivers: the depth along each pixel's ray, and the rays.
struct DepthPixels {
  std::vector<float> range_m;
  std::vector<Eigen::Vector3f> ray;

  explicit DepthPixels(const Scan& scan) {
    for (const Eigen::Vector3f& p : scan.points_m) {
      range_m.push_back(p.norm());
      ray.push_back(p / p.norm());
    }
  }
  void deproject(Scan& scan) const {
    scan.points_m.resize(range_m.size());
    for (std::size_t i = 0; i < range_m.size(); ++i) scan.points_m[i] = ray[i] * range_m[i];
  }
};

void step(benchmark::State& state, double resolution_m) {
  const bench::Scene& flight = bench::office_flight();
  std::vector<DepthPixels> images;
  for (const Scan& scan : flight.scans) images.emplace_back(scan);
  const bench::MemoryNote memory(state);
  const GridSpec grid(flight.box, resolution_m);
  PotentialModelConfig config;
  config.coarse_factor = static_cast<int>(std::lround(0.4 / resolution_m));
  const WindowShape shape;
  std::vector<float> window(shape.size());
  std::vector<double> times_ms;
  for (auto _ : state) {
    OccupancyMap map(grid);
    ScanIntegrator integrator;
    DistanceField field(grid, kTruncation_m, Obstacles::kBlocked);
    PotentialObstacles obstacles = make_potential_obstacles(grid, config);
    PotentialModel model(grid, config);
    double sum_s = 0.0;
    for (std::size_t i = 0; i < flight.scans.size(); ++i) {
      Scan scan = flight.scans[i];
      scan.points_m.clear();
      const Eigen::Vector3d at_m = scan.T_world_sensor.translation();
      const Eigen::Vector3d goal_m = flight.scans[i / kGoalEvery * kGoalEvery].T_world_sensor.translation();
      const double start_s = bench::thread_time_s();
      images[i].deproject(scan);
      integrator.integrate(scan, map);
      field.update(map);
      obstacles.update(map);
      model.update(map, obstacles, {at_m, goal_m, {}});
      sample_window(model.fine(), shape, {at_m, 0.0}, window);
      const double took_s = bench::thread_time_s() - start_s;
      if (i == 0) continue;  // allocates and fills everything
      sum_s += took_s;
      times_ms.push_back(1e3 * took_s);
    }
    state.SetIterationTime(sum_s);
  }
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["scans"] = static_cast<double>(flight.scans.size() - 1);
  state.counters["p50_ms"] = times_ms[times_ms.size() / 2];
  state.counters["p99_ms"] = times_ms[times_ms.size() * 99 / 100];
  state.counters["max_ms"] = times_ms.back();
}

[[maybe_unused]] const bool registered = [] {
  for (const auto& [resolution_m, label] : bench::resolutions()) {
    benchmark::RegisterBenchmark((std::string("step/") + label).c_str(), step, resolution_m)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
