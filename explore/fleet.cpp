#include "explore/fleet.hpp"

#include "core/errors.hpp"
#include "explore/fleet_impl.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace stairwell::explore {

namespace {

// The map reaches a little beyond the task box, so that surfaces lying on the box's faces are mapped as well.
constexpr double kMapMargin_m = 0.3;

GridSpec map_grid(const FleetConfig& config) {
  const auto problems = config.problems();
  if (!problems.empty()) {
    std::string text = "the fleet cannot start: " + problems.front();
    for (std::size_t i = 1; i < problems.size(); ++i) text += "; " + problems[i];
    throw InputError(text);
  }
  return {config.task_box.inflated(kMapMargin_m), config.resolution_m};
}

double field_truncation_m(const FleetConfig& config) {
  return std::max(1.0, config.robot.clearance_m() + 4.0 * config.resolution_m);
}

coverage3d::CoverageConfig coverage_config(const FleetConfig& config) {
  coverage3d::CoverageConfig coverage;
  coverage.sensor = config.sensor;
  coverage.limits = config.limits;
  coverage.robot = config.robot;
  coverage.box = config.task_box;
  coverage.layers_m = config.layers_m;
  coverage.slice = config.mode == Mode::kSlice;
  coverage.blacklist_radius_m = config.blacklist_radius_m;
  coverage.blacklist_time_s = config.blacklist_time_s;
  coverage.hybrid_first = config.hybrid_first;
  coverage.hybrid_switch = config.hybrid_switch;
  coverage.seed = config.seed;
  return coverage;
}

std::unique_ptr<coverage3d::CoverageStrategy> make_coverage(const FleetConfig& config) {
  auto strategy = config.own_coverage ? config.own_coverage(coverage_config(config))
                                      : coverage3d::make_strategy(config.coverage, coverage_config(config));
  if (strategy == nullptr) throw InputError("own_coverage made no strategy");
  return strategy;
}

}  // namespace

const char* to_string(StopReason reason) {
  switch (reason) {
    case StopReason::kRunning:
      return "running";
    case StopReason::kTargetReached:
      return "target reached";
    case StopReason::kNothingReachableLeft:
      return "nothing reachable left";
    case StopReason::kTimeLimit:
      return "time limit";
    case StopReason::kInterrupted:
      return "interrupted";
  }
  return "unknown";
}

const char* to_string(Phase phase) {
  switch (phase) {
    case Phase::kGrounded:
      return "grounded";
    case Phase::kTakeoff:
      return "takeoff";
    case Phase::kRadialScan:
      return "radial_scan";
    case Phase::kFindGoal:
      return "find_goal";
    case Phase::kTravel:
      return "travel";
    case Phase::kLand:
      return "land";
    case Phase::kDone:
      return "done";
  }
  return "unknown";
}

Fleet::Impl::Impl(const FleetConfig& fleet_config, std::vector<UavDoors> doors, ExplorationLog& exploration_log,
                  std::function<double()> clock)
    : config(fleet_config),
      log(exploration_log),
      clock_s(std::move(clock)),
      map(map_grid(fleet_config), fleet_config.occupancy),
      blocked(map.grid(), field_truncation_m(fleet_config), mapping::Obstacles::kBlocked),
      blocked_words(map.grid(), mapping::Obstacles::kBlocked),
      integrator(mapping::ScanIntegrator::Config{fleet_config.discretize}),
      pipeline(fleet_config.cloud),
      strategy(make_coverage(fleet_config)),
      pilot(fleet_config),
      avoider(fleet_config, 1.0 / fleet_config.sensor.rate_hz),
      tick_s(1.0 / fleet_config.sensor.rate_hz) {
  if (doors.empty()) throw InputError("a fleet needs at least one UAV");
  for (std::size_t i = 0; i < doors.size(); ++i) {
    Uav uav;
    uav.id = i;
    uav.sensor = doors[i].sensor;
    uav.vehicle = doors[i].vehicle;
    uav.latency_s = config.plan_latency_s;
    uav.took_off = uav.vehicle->landed();
    uavs.push_back(std::move(uav));
    assume_start_free(uavs.back());
  }
}

void Fleet::Impl::assume_start_free(const Uav& uav) {
  const Eigen::Vector3d start_m = uav.vehicle->state().position_m;
  const double top_m = start_m.z() + (uav.took_off ? config.takeoff_height_m : 0.0);
  for (double z_m = start_m.z(); z_m < top_m + config.start_bubble_m; z_m += config.start_bubble_m) {
    assumed.push_back({{start_m.x(), start_m.y(), std::min(z_m, top_m)}, config.start_bubble_m});
    map.assume_free(assumed.back().center_m, assumed.back().radius_m);
  }
}

bool Fleet::Impl::step() {
  if (reason != StopReason::kRunning) return false;
  ++ticks;
  for (Uav& uav : uavs) uav.vehicle->advance(now_s());
  sense();
  decide();
  if (reason == StopReason::kRunning && now_s() >= config.time_limit_s) reason = StopReason::kTimeLimit;
  return reason == StopReason::kRunning;
}

void Fleet::Impl::sense() {
  for (Uav& uav : uavs) sense_one(uav);
  blocked.update(map);
  blocked_words.update(map);
}

void Fleet::Impl::sense_one(Uav& uav) {
  const MotionState state = uav.vehicle->state();
  const Scan raw = uav.sensor->capture(make_pose(state.position_m, state.yaw_rad), now_s());
  std::vector<Eigen::Vector3d> fellows_m;
  for (const Uav* fellow : fellows_of(uav)) fellows_m.push_back(fellow->vehicle->state().position_m);
  const double before_s = clock_s();
  const Scan scan = pipeline.filter(raw, fellows_m);
  integrator.integrate(scan, map);
  stats.integrate_ms.push_back((clock_s() - before_s) * 1e3);
  log.on_scan(now_s(), uav.id, map);
}

std::vector<const Uav*> Fleet::Impl::fellows_of(const Uav& uav) const {
  std::vector<const Uav*> fellows;
  for (const Uav& other : uavs) {
    if (other.id != uav.id) fellows.push_back(&other);
  }
  return fellows;
}

void Fleet::Impl::enter(Uav& uav, Phase phase) {
  if (uav.phase == phase) return;
  uav.phase = phase;
  log.on_state(now_s(), uav.id, to_string(phase));
}

bool Fleet::Impl::command(Uav& uav, const Trajectory& trajectory) {
  try {
    uav.vehicle->command(trajectory);
  } catch (const std::invalid_argument& refused) {
    log.on_event(now_s(), uav.id, "command_refused", refused.what());
    return false;
  }
  log.on_trajectory(now_s(), uav.id, trajectory);
  return true;
}

Fleet::Fleet(const FleetConfig& config, std::vector<UavDoors> uavs, ExplorationLog& log,
             std::function<double()> clock_s)
    : impl_(std::make_unique<Impl>(config, std::move(uavs), log, std::move(clock_s))) {}
Fleet::~Fleet() = default;

bool Fleet::step() { return impl_->step(); }
void Fleet::stop(StopReason reason) {
  if (impl_->reason == StopReason::kRunning) impl_->reason = reason;
}
double Fleet::time_s() const { return impl_->now_s(); }
double Fleet::tick_s() const { return impl_->tick_s; }
StopReason Fleet::stop_reason() const { return impl_->reason; }
std::size_t Fleet::size() const { return impl_->uavs.size(); }
MotionState Fleet::uav_state(std::size_t uav) const { return impl_->uavs.at(uav).vehicle->state(); }
const char* Fleet::uav_phase(std::size_t uav) const { return to_string(impl_->uavs.at(uav).phase); }
const mapping::OccupancyMap& Fleet::map() const { return impl_->map; }
const FleetStats& Fleet::stats() const { return impl_->stats; }
double Fleet::exploration_end_s() const {
  return impl_->exploration_end_s >= 0.0 ? impl_->exploration_end_s : impl_->now_s();
}
std::vector<double> Fleet::layers_m() const {
  return impl_->config.mode == Mode::kSlice ? impl_->strategy->motion_rule().layers_m : std::vector<double>{};
}

}  // namespace stairwell::explore
