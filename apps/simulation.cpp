#include "apps/simulation.hpp"

#include "core/errors.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/vehicles.hpp"

#include <cmath>
#include <string>
#include <utility>

namespace stairwell::apps {

namespace {

constexpr double kMapMargin_m = 0.3;

/// Meshes are float32: their bounds are off round numbers by less than this.
Aabb rounded(const Aabb& box) {
  const auto round = [](double value_m) { return std::round(value_m * 1e4) / 1e4; };
  return {box.min_m.unaryExpr(round), box.max_m.unaryExpr(round)};
}

const char* vehicle_model(explore::MotionModel motion) {
  return motion == explore::MotionModel::kStep ? "step" : "limited";
}

}  // namespace

GridSpec map_grid(const explore::FleetConfig& config) {
  return GridSpec(config.task_box.inflated(kMapMargin_m), config.resolution_m);
}

/// Tells the simulated sensor where the fellow UAVs are at the moment of each scan.
class Simulation::FellowAwareSensor final : public DepthSource {
 public:
  FellowAwareSensor(const Simulation& simulation, std::size_t uav)
      : simulation_(simulation),
        uav_(uav),
        sensor_(simulation.caster_, simulation.config_.fleet.sensor, noise_of(simulation.config_),
                simulation.config_.fleet.seed, "uav" + std::to_string(uav) + "/sensor") {}

  const SensorModel& model() const override { return sensor_.model(); }

  Scan capture(const Pose& T_world_sensor, double time_s) override {
    std::vector<Eigen::Vector3d> fellows_m;
    for (std::size_t other = 0; other < simulation_.vehicles_.size(); ++other) {
      if (other != uav_) fellows_m.push_back(simulation_.vehicles_[other]->state().position_m);
    }
    sensor_.set_fellows(std::move(fellows_m), simulation_.config_.fleet.robot.radius_m);
    return sensor_.capture(T_world_sensor, time_s);
  }

  sim3d::SimulatedSensor& sensor() { return sensor_; }

 private:
  static sim3d::SensorNoise noise_of(const RunConfig& config) {
    sim3d::SensorNoise noise;
    noise.enabled = config.noise;
    return noise;
  }

  const Simulation& simulation_;
  std::size_t uav_;
  sim3d::SimulatedSensor sensor_;
};

Simulation::Simulation(RunConfig config)
    : config_(std::move(config)), world_(sim3d::load_world(config_.world, config_.world_options)) {
  if (!config_.box_given) config_.fleet.task_box = rounded(world_.bounds);
  config_.box_given = true;
  require_usable(config_);
  if (config_.fleet.task_box.intersection(world_.bounds).empty()) {
    throw InputError("--box lies outside " + config_.world.string() +
                     ": nothing of the world is in it (stairwell world info prints the bounds)");
  }
  caster_ = std::make_shared<const sim3d::RayCaster>(world_.mesh);
  truth_ = std::make_unique<sim3d::GroundTruth>(world_, map_grid(config_.fleet));
  starts_ = place_starts(config_, *truth_);
  config_.starts.clear();
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    config_.starts.push_back(starts_[i].start);
    MotionState state;
    state.position_m = starts_[i].start.position_m;
    state.yaw_rad = starts_[i].start.yaw_rad;
    vehicles_.push_back(
        sim3d::make_vehicle(vehicle_model(config_.fleet.motion), config_.fleet.limits, state, starts_[i].landed));
    sensors_.push_back(std::make_unique<FellowAwareSensor>(*this, i));
  }
  if (config_.radio_range_m) radio_ = std::make_unique<sim3d::RangeRadio>(*config_.radio_range_m);
}

Simulation::~Simulation() = default;

std::vector<explore::UavDoors> Simulation::doors() const {
  std::vector<explore::UavDoors> doors;
  for (std::size_t i = 0; i < vehicles_.size(); ++i) doors.push_back({sensors_[i].get(), vehicles_[i].get()});
  return doors;
}

std::vector<Eigen::Vector3d> Simulation::airborne_starts_m() const {
  std::vector<Eigen::Vector3d> positions_m;
  for (const CheckedStart& start : starts_) positions_m.push_back(start.airborne_m);
  return positions_m;
}

std::vector<std::uint8_t> Simulation::reachable() const {
  return truth_->reachable(airborne_starts_m(), config_.fleet.robot, config_.fleet.task_box);
}

std::vector<std::uint8_t> Simulation::explorable(const std::vector<std::uint8_t>& reachable) const {
  return truth_->explorable(reachable, *caster_, config_.fleet.sensor, config_.fleet.task_box);
}

std::vector<std::uint64_t> Simulation::scans_taken() const {
  std::vector<std::uint64_t> counts;
  for (const auto& sensor : sensors_) counts.push_back(sensor->sensor().scans_taken());
  return counts;
}

void Simulation::set_scans_taken(const std::vector<std::uint64_t>& counts) {
  if (counts.size() != sensors_.size()) throw InputError("the checkpoint is for another number of UAVs");
  for (std::size_t i = 0; i < counts.size(); ++i) sensors_[i]->sensor().set_scans_taken(counts[i]);
}

}  // namespace stairwell::apps
