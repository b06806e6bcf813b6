/// One run of Alg. 4.1 after each depth scan of a flight through worlds/office_tower.sdf, and the agents' windows.
#include "mapping/potential_model.hpp"
#include "mapping/potential_window.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr std::size_t kWarmUp = 12;  ///< scans of the turn on the spot, not timed
constexpr int kFlight = 228;

/// A flight with map, obstacles and potential; fellow UAVs pass by, and the goal changes every 30 scans.
class Flight {
 public:
  Flight(double resolution_m, RepulsionForm form)
      : map_(GridSpec(scene_.box, resolution_m)),
        field_(map_.grid(), 1.1, Obstacles::kOccupied),
        config_(config(resolution_m, form)),
        obstacles_(make_potential_obstacles(map_.grid(), config_)),
        model_(map_.grid(), config_),
        nearest_(form == RepulsionForm::kNearest) {
    while (next_ < kWarmUp) integrator_.integrate(scene_.scans[next_++], map_);
    update();
  }

  /// One scan more; from the beginning again after the last.
  void fly() {
    integrator_.integrate(scene_.scans[next_ % scene_.scans.size()], map_);
    ++next_;
    ++steps_;
  }
  /// What is timed. @return seconds
  double update() {
    if (nearest_) field_.update(map_);
    const Eigen::Vector3d at_m = pose().translation();
    const Eigen::Vector3d goal_m =
        at_m - Eigen::Vector3d(0, 0, at_m.z()) + Eigen::Vector3d(1.0 + steps_ / 30, 2.0, 1.0);
    if (steps_ % 30 == 0) goal_m_ = goal_m;
    const double swing = 0.05 * steps_;
    const std::vector<Eigen::Vector3d> fellows_m{
        at_m + Eigen::Vector3d(3.0 * std::cos(swing), 3.0 * std::sin(swing), 0.3),
        at_m + Eigen::Vector3d(0.0, 9.0, 0.0),
        {1.0, 1.0, 1.0}};
    const double start_s = bench::thread_time_s();
    obstacles_.update(map_);
    model_.update(map_, obstacles_, {at_m, goal_m_, fellows_m}, &field_);
    return bench::thread_time_s() - start_s;
  }
  const PotentialModel& model() const { return model_; }
  std::size_t changed_cells() const {
    std::size_t count = 0;
    for (const ObstacleLattice::Change& change : obstacles_.fine().changes()) {
      count += static_cast<std::size_t>(std::popcount(change.added) + std::popcount(change.removed));
    }
    return count;
  }
  WindowPose window() const {
    const Eigen::Vector3d ahead = pose().linear().col(0);
    return {pose().translation(), std::atan2(ahead.y(), ahead.x())};
  }

 private:
  static PotentialModelConfig config(double resolution_m, RepulsionForm form) {
    PotentialModelConfig config;
    config.form = form;
    config.coarse_factor = static_cast<int>(std::lround(0.4 / resolution_m));
    return config;
  }
  const Pose& pose() const { return scene_.scans[(next_ - 1) % scene_.scans.size()].T_world_sensor; }

  const bench::Scene& scene_ = bench::office_flight();
  std::size_t next_ = 0;
  OccupancyMap map_;
  ScanIntegrator integrator_;
  DistanceField field_;
  PotentialModelConfig config_;
  PotentialObstacles obstacles_;
  PotentialModel model_;
  bool nearest_;
  int steps_ = 0;
  Eigen::Vector3d goal_m_ = Eigen::Vector3d::Zero();
};

/// Obstacles, coarse model and fine window (7.5 x 7.5 x 3 m) after each scan of the flight; the scan itself, and for
/// the nearest-obstacle form the map's distance field, are not timed.
void step(benchmark::State& state, double resolution_m, RepulsionForm form) {
  Flight flight(resolution_m, form);
  std::vector<double> times_s;
  std::size_t changed = 0;
  for (auto _ : state) {
    flight.fly();
    times_s.push_back(flight.update());
    state.SetIterationTime(times_s.back());
    changed += flight.changed_cells();
  }
  std::sort(times_s.begin(), times_s.end());
  state.counters["p50_ms"] = 1e3 * times_s[times_s.size() / 2];
  state.counters["p95_ms"] = 1e3 * times_s[times_s.size() * 95 / 100];
  state.counters["max_ms"] = 1e3 * times_s.back();
  state.counters["changed_cells"] = static_cast<double>(changed) / static_cast<double>(times_s.size());
  state.counters["memory_MiB"] =
      static_cast<double>(flight.model().fine().memory_bytes() + flight.model().coarse().memory_bytes()) / 1048576.0;
}

void window_sample(benchmark::State& state, const std::array<int, 3>& samples) {
  Flight flight(0.1, RepulsionForm::kSummed);
  WindowShape shape;
  shape.samples = samples;
  std::vector<float> window(shape.size());
  for (auto _ : state) {
    sample_window(flight.model().fine(), shape, flight.window(), window);
    benchmark::DoNotOptimize(window.data());
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(shape.size()) * state.iterations());
}

const auto* add_step(const char* name, double resolution_m, RepulsionForm form) {
  return benchmark::RegisterBenchmark(name, step, resolution_m, form)
      ->UseManualTime()
      ->Iterations(kFlight)
      ->Unit(benchmark::kMillisecond);
}

[[maybe_unused]] const bool registered = [] {
  add_step("potential/step/0.10", 0.1, RepulsionForm::kSummed);
  add_step("potential/step/0.05", 0.05, RepulsionForm::kSummed);
  add_step("potential/step_nearest/0.10", 0.1, RepulsionForm::kNearest);
  add_step("potential/step_nearest/0.05", 0.05, RepulsionForm::kNearest);
  benchmark::RegisterBenchmark("potential/window_sample/75x75", window_sample, std::array<int, 3>{75, 75, 1})
      ->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("potential/window_sample/31x31x31", window_sample, std::array<int, 3>{31, 31, 31})
      ->Unit(benchmark::kMicrosecond);
  return true;
}();

}  // namespace
