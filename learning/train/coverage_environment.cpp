#include "learning/train/coverage_environment.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "coverage3d/agent_strategy.hpp"
#include "explore/fleet.hpp"
#include "sim3d/loaders/voxel_faces.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/vehicles.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace stairwell::train {
namespace {

constexpr double kStartHeight_m = 1.0;
constexpr double kStartRadius_m = 0.35;
constexpr double kStartGap_m = 0.8, kStartSpread_m = 4.0;
constexpr double kReplan_s = 4.0;  // a choice is kept anyway
constexpr double kLidarShare = 0.25;
constexpr double kLeftFloor = 0.1;  // below this share, what is left hardly counts less
constexpr double kIllegal = -5.0, kUnwanted = -1.0, kExplored = 100.0;  // (5.15); the last per share of the free space

bool stands_free(const VoxelScene& scene, const Eigen::Vector3d& at_m) {
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(kStartRadius_m);
  const VoxelIndex lo = scene.grid.index_of(at_m - reach_m), hi = scene.grid.index_of(at_m + reach_m);
  for (int z = lo.z; z <= hi.z; ++z)
    for (int y = lo.y; y <= hi.y; ++y)
      for (int x = lo.x; x <= hi.x; ++x)
        if (!scene.grid.contains(VoxelIndex{x, y, z}) || scene.solid[scene.grid.linear({x, y, z})] != 0) return false;
  return true;
}

sim3d::TriangleMesh closed_mesh(const VoxelScene& scene) {
  const auto& n = scene.grid.size();
  sim3d::SolidVoxels solid;
  for (int z = -1; z <= n[2]; ++z)
    for (int y = -1; y <= n[1]; ++y)
      for (int x = -1; x <= n[0]; ++x)
        if (!scene.grid.contains(VoxelIndex{x, y, z}) || scene.solid[scene.grid.linear({x, y, z})] != 0)
          solid.add(x, y, z);
  return solid.exposed_faces(Eigen::Vector3d::Constant(scene.grid.resolution_m()));
}

SensorModel depth_camera() {
  SensorModel sensor;
  sensor.kind = SensorKind::kDepthCamera;
  sensor.azimuth_fov_rad = rad_from_deg(90.0);
  sensor.elevation_lo_rad = rad_from_deg(-36.85);
  sensor.elevation_hi_rad = rad_from_deg(36.85);
  sensor.max_range_m = 5.0;
  sensor.rays_azimuth = 64;
  sensor.rays_elevation = 48;
  sensor.rate_hz = 5.0;
  return sensor;
}

SensorModel lidar() {
  SensorModel sensor = depth_camera();
  sensor.kind = SensorKind::kLidar;
  sensor.azimuth_fov_rad = 2.0 * kPi;
  sensor.elevation_lo_rad = rad_from_deg(-7.0);
  sensor.elevation_hi_rad = rad_from_deg(52.0);
  sensor.max_range_m = 10.0;
  sensor.rays_azimuth = 180;
  sensor.rays_elevation = 30;
  return sensor;
}

/// What was chosen and what happened, to be paid for when the exploration is over.
class Ledger final : public explore::ExplorationLog {
 public:
  explicit Ledger(std::size_t uavs) : open_(uavs) {}

  void choose(const coverage3d::OptionChoice& choice, std::size_t chosen) {
    close(choice.uav, choice.time_s, choice.rows);
    const auto row = choice.rows.begin() + static_cast<std::ptrdiff_t>(chosen * coverage3d::kOptionFeatures);
    open_[choice.uav] = Chosen{choice.time_s, 0.0, {row, row + coverage3d::kOptionFeatures}, {}, {}};
  }
  void on_event(double time_s, std::size_t uav, std::string_view event, std::string_view reason) override {
    if (event != "goal_failed") return;
    ++failures_;
    if (open_[uav]) open_[uav]->fines.emplace_back(time_s, reason == "unreachable" ? kIllegal : kUnwanted);
  }
  void see(double time_s, double known_m3) { curve_.emplace_back(time_s, known_m3); }
  void end(double time_s) {
    for (std::size_t uav = 0; uav < open_.size(); ++uav) close(uav, time_s, {});
  }

  /// @pre end() was called
  void report(const CoverageEnvironmentConfig& config, ExplorationReport& report) const {
    const std::vector<std::pair<double, double>> gains = gains_of(config.reward);
    const bool fined = config.reward == CoverageEnvironmentConfig::Reward::kThesis;
    for (const Chosen& one : closed_) {
      const auto weight = [&](double time_s) { return std::exp((one.since_s - time_s) / config.horizon_s); };
      rl::Choice choice{one.row, 0.0, one.next.empty() ? 0.0 : weight(one.until_s), one.next};
      const auto later = [](double time_s, const auto& gain) { return time_s < gain.first; };
      auto gain = std::upper_bound(gains.begin(), gains.end(), one.since_s, later);
      for (; gain != gains.end() && gain->first <= one.until_s; ++gain)
        choice.reward += gain->second * weight(gain->first);
      for (const auto& [time_s, fine] : one.fines) {
        if (!fined) continue;
        choice.reward += fine * weight(time_s);
        report.reward += fine * std::exp(-time_s / config.horizon_s);
      }
      report.choices.push_back(std::move(choice));
    }
    for (const auto& [time_s, gain] : gains) report.reward += gain * std::exp(-time_s / config.horizon_s);
    report.seen_m3 = curve_.back().second;
    for (auto at = curve_.rbegin(); at != curve_.rend() && at->second >= 0.9 * report.seen_m3; ++at)
      report.t90_s = at->first;
    report.failures = failures_;
  }

 private:
  struct Chosen {
    double since_s, until_s;
    std::vector<float> row, next;
    std::vector<std::pair<double, double>> fines;  ///< when and how much
  };
  void close(std::size_t uav, double time_s, const std::vector<float>& next) {
    if (!open_[uav]) return;
    open_[uav]->until_s = time_s;
    open_[uav]->next = next;
    closed_.push_back(std::move(*open_[uav]));
    open_[uav].reset();
  }
  /// When and how much, for the whole fleet.
  std::vector<std::pair<double, double>> gains_of(CoverageEnvironmentConfig::Reward kind) const {
    std::vector<std::pair<double, double>> gains;
    double before = 0.0;
    for (const auto& [time_s, known_m3] : curve_) {
      const double seen = known_m3 / curve_.back().second;
      const double gain = kind == CoverageEnvironmentConfig::Reward::kThesis
                              ? kExplored * (seen - before)
                              : std::log((1.0 - before + kLeftFloor) / (1.0 - seen + kLeftFloor));
      gains.emplace_back(time_s, gain);
      before = seen;
    }
    return gains;
  }

  std::vector<std::optional<Chosen>> open_;
  std::vector<Chosen> closed_;
  std::vector<std::pair<double, double>> curve_;  ///< time, known volume
  std::size_t failures_ = 0;
};

/// Vehicles and sensors in a building.
struct Doors {
  Doors(const Building& building, const explore::FleetConfig& fleet)
      : caster(std::make_shared<const sim3d::RayCaster>(closed_mesh(building.scene))) {
    for (std::size_t i = 0; i < building.starts_m.size(); ++i) {
      MotionState start;
      start.position_m = building.starts_m[i];
      vehicles.push_back(sim3d::make_vehicle("limited", fleet.limits, start, false));
      sensors.push_back(std::make_unique<sim3d::SimulatedSensor>(caster, fleet.sensor, sim3d::SensorNoise{}, fleet.seed,
                                                                 "uav" + std::to_string(i)));
      all.push_back({sensors[i].get(), vehicles[i].get()});
    }
  }
  std::shared_ptr<const sim3d::RayCaster> caster;
  std::vector<std::unique_ptr<Vehicle>> vehicles;
  std::vector<std::unique_ptr<sim3d::SimulatedSensor>> sensors;
  std::vector<explore::UavDoors> all;
};

explore::FleetConfig fleet_config(const CoverageEnvironmentConfig& config, const Building& building,
                                  const SensorModel& sensor, std::uint64_t seed) {
  explore::FleetConfig fleet;
  fleet.task_box = building.scene.grid.box();
  fleet.resolution_m = config.resolution_m;
  fleet.sensor = sensor;
  fleet.charge_planning = false;
  fleet.replan_period_s = kReplan_s;
  fleet.time_limit_s = config.time_limit_s;
  fleet.return_to = explore::ReturnTo::kStay;
  fleet.seed = seed;
  return fleet;
}

}  // namespace

Building make_building(const StoreyWorldConfig& config, int uavs, Rng& rng) {
  for (;;) {
    Building building{make_storey_scene(config, rng), {}};
    const VoxelScene& scene = building.scene;
    const Eigen::Vector3d size_m = scene.grid.box().size_m();
    for (int i = 0; i < 1000 && static_cast<int>(building.starts_m.size()) < uavs; ++i) {
      const Eigen::Vector3d at_m(rng.uniform(0.0, size_m.x()), rng.uniform(0.0, size_m.y()), kStartHeight_m);
      const bool apart = std::ranges::all_of(
          building.starts_m, [&](const Eigen::Vector3d& other_m) { return (at_m - other_m).norm() > kStartGap_m; });
      const bool together = building.starts_m.empty() || (at_m - building.starts_m.front()).norm() < kStartSpread_m;
      if (apart && together && stands_free(scene, at_m)) building.starts_m.push_back(at_m);
    }
    if (!building.starts_m.empty()) return building;
  }
}

std::vector<std::string> CoverageEnvironmentConfig::problems() const {
  std::vector<std::string> list;
  if (most_uavs < 1) list.emplace_back("most_uavs must be at least 1");
  if (!(resolution_m > 0.0)) list.emplace_back("resolution_m must be above 0");
  if (!(horizon_s > 0.0)) list.emplace_back("horizon_s must be above 0");
  if (!(time_limit_s > 0.0)) list.emplace_back("time_limit_s must be above 0");
  return list;
}

CoverageEnvironment::CoverageEnvironment(const CoverageEnvironmentConfig& config) : config_(config) {
  if (const auto list = config.problems(); !list.empty()) throw InputError("coverage training: " + list.front());
}

ExplorationReport CoverageEnvironment::fly(std::uint64_t episode, const coverage3d::OptionChooser& chooser) const {
  Rng rng = make_rng(config_.seed, "coverage/" + std::to_string(episode));
  const int uavs = rng.uniform_int(1, config_.most_uavs);
  const SensorModel sensor = rng.uniform() < kLidarShare ? lidar() : depth_camera();
  const Building building = make_building(config_.worlds, uavs, rng);
  explore::FleetConfig fleet_settings = fleet_config(config_, building, sensor, config_.seed + episode);
  Ledger ledger(building.starts_m.size());
  fleet_settings.own_coverage = [&](const coverage3d::CoverageConfig& coverage) {
    return std::make_unique<coverage3d::AgentStrategy>(coverage, [&](const coverage3d::OptionChoice& choice) {
      const std::size_t chosen = chooser(choice);
      ledger.choose(choice, chosen);
      return chosen;
    });
  };
  Doors doors(building, fleet_settings);
  explore::Fleet fleet(fleet_settings, doors.all, ledger, [] { return 0.0; });
  bool going = true;
  while (going && fleet.exploring()) {
    going = fleet.step();
    ledger.see(fleet.time_s(), fleet.map().known_volume_m3());
  }
  ledger.end(fleet.time_s());
  ExplorationReport report;
  ledger.report(config_, report);
  report.finish_s = fleet.exploration_end_s();
  report.uavs = building.starts_m.size();
  return report;
}

}  // namespace stairwell::train
