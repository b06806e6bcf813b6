/// One run of Alg. 4.1 after each depth scan of a flight through worlds/office_tower.sdf, and the agents' windows.
#include "core/rng.hpp"
#include "core/units.hpp"
#include "mapping/potential_model.hpp"
#include "mapping/potential_window.hpp"
#include "mapping/scan_integrator.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/world.hpp"

#include <benchmark/benchmark.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <ctime>
#include <filesystem>
#include <memory>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr int kWarmUp = 12;  ///< scans of a turn on the spot, not timed
constexpr int kFlight = 240;
constexpr double kStep_m = 0.1;  ///< 1 m/s at 10 scans a second

/// Processor time of this thread: what other programs take does not count.
double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Tower {
  sim3d::World world = sim3d::load_world(std::filesystem::path(STAIRWELL_WORLDS) / "office_tower.sdf");
  std::shared_ptr<sim3d::RayCaster> caster = std::make_shared<sim3d::RayCaster>(world.mesh);
};

const Tower& tower() {
  static const Tower instance;
  return instance;
}

/// 320x240 pixels, 90 x 73.7 degrees, 8 m.
SensorModel camera() {
  SensorModel model;
  model.kind = SensorKind::kDepthCamera;
  model.azimuth_fov_rad = rad_from_deg(90.0);
  model.elevation_lo_rad = rad_from_deg(-36.85);
  model.elevation_hi_rad = rad_from_deg(36.85);
  model.max_range_m = 8.0;
  model.rays_azimuth = 320;
  model.rays_elevation = 240;
  return model;
}

/// Flies ahead while nothing is near, else turns; always the same way.
class Pilot {
 public:
  Pilot() {
    Rng rng = make_rng(3, "potential benchmark");
    const Aabb& box = tower().world.bounds;
    do {
      for (int axis = 0; axis < 3; ++axis) at_m_[axis] = rng.uniform(box.min_m[axis], box.max_m[axis]);
      yaw_rad_ = rng.uniform(-kPi, kPi);
    } while (!clear(Eigen::Vector3d::UnitZ(), 0.5) || !clear(-Eigen::Vector3d::UnitZ(), 0.5) || !ahead_clear() ||
             clear(Eigen::Vector3d::UnitZ(), 5.0) || clear(-Eigen::Vector3d::UnitZ(), 5.0));
  }

  Pose pose() const {
    Pose T_world_camera = Pose::Identity();
    T_world_camera.translation() = at_m_;
    T_world_camera.linear() = Eigen::AngleAxisd(yaw_rad_, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T_world_camera;
  }
  double yaw_rad() const { return yaw_rad_; }
  void turn(double by_rad) { yaw_rad_ += by_rad; }
  void step() {
    if (ahead_clear()) {
      at_m_ += kStep_m * direction(0.0);
      turn(0.004);
    } else {
      turn(0.08);
    }
  }

 private:
  Eigen::Vector3d direction(double beside_rad) const {
    return {std::cos(yaw_rad_ + beside_rad), std::sin(yaw_rad_ + beside_rad), 0.0};
  }
  bool clear(const Eigen::Vector3d& towards, double range_m) const {
    return !tower().caster->occluded(at_m_.cast<float>(), towards.cast<float>(), static_cast<float>(range_m));
  }
  bool ahead_clear() const {
    return clear(direction(0.0), 1.0) && clear(direction(0.4), 0.8) && clear(direction(-0.4), 0.8) &&
           clear(direction(0.9), 0.5) && clear(direction(-0.9), 0.5);
  }

  Eigen::Vector3d at_m_;
  double yaw_rad_ = 0.0;
};

/// A flight with map, obstacles and potential; fellow UAVs pass by, and the goal changes every 30 scans.
class Flight {
 public:
  Flight(double resolution_m, RepulsionForm form)
      : sensor_(tower().caster, camera(), {}, 1, "benchmark"),
        map_(GridSpec(tower().world.bounds.inflated(0.2), resolution_m)),
        field_(map_.grid(), 1.1, Obstacles::kOccupied),
        config_(config(resolution_m, form)),
        obstacles_(make_potential_obstacles(map_.grid(), config_)),
        model_(map_.grid(), config_),
        nearest_(form == RepulsionForm::kNearest) {
    for (int i = 0; i < kWarmUp; ++i, pilot_.turn(2.0 * kPi / kWarmUp)) scan();
    update();
  }

  void fly() {
    pilot_.step();
    scan();
    ++steps_;
  }
  /// What is timed. @return seconds
  double update() {
    if (nearest_) field_.update(map_);
    const Eigen::Vector3d at_m = pilot_.pose().translation();
    const Eigen::Vector3d goal_m =
        at_m - Eigen::Vector3d(0, 0, at_m.z()) + Eigen::Vector3d(1.0 + steps_ / 30, 2.0, 1.0);
    if (steps_ % 30 == 0) goal_m_ = goal_m;
    const double swing = 0.05 * steps_;
    const std::vector<Eigen::Vector3d> fellows_m{
        at_m + Eigen::Vector3d(3.0 * std::cos(swing), 3.0 * std::sin(swing), 0.3),
        at_m + Eigen::Vector3d(0.0, 9.0, 0.0),
        {1.0, 1.0, 1.0}};
    const double start_s = thread_time_s();
    obstacles_.update(map_);
    model_.update(map_, obstacles_, {at_m, goal_m_, fellows_m}, &field_);
    return thread_time_s() - start_s;
  }
  const PotentialModel& model() const { return model_; }
  std::size_t changed_cells() const {
    std::size_t count = 0;
    for (const ObstacleLattice::Change& change : obstacles_.fine().changes()) {
      count += static_cast<std::size_t>(std::popcount(change.added) + std::popcount(change.removed));
    }
    return count;
  }
  WindowPose window() const { return {pilot_.pose().translation(), pilot_.yaw_rad()}; }

 private:
  static PotentialModelConfig config(double resolution_m, RepulsionForm form) {
    PotentialModelConfig config;
    config.form = form;
    config.coarse_factor = static_cast<int>(std::lround(0.4 / resolution_m));
    return config;
  }
  void scan() { integrator_.integrate(sensor_.capture(pilot_.pose(), 0.1 * steps_), map_); }

  Pilot pilot_;
  sim3d::SimulatedSensor sensor_;
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
