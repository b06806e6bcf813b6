#include "explore/fleet.hpp"

#include "core/errors.hpp"
#include "explore/fleet_impl.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace stairwell::explore {

namespace {

/// @throws InputError listing every problem
const FleetConfig& usable(const FleetConfig& config) {
  const auto problems = config.problems();
  if (!problems.empty()) {
    std::string text = "the fleet cannot start: " + problems.front();
    for (std::size_t i = 1; i < problems.size(); ++i) text += "; " + problems[i];
    throw InputError(text);
  }
  return config;
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
    case StopReason::kBattery:
      return "battery limit";
    case StopReason::kAllLost:
      return "all UAVs lost";
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
    case Phase::kReturn:
      return "return";
  }
  return "unknown";
}

Fleet::Impl::Impl(const FleetConfig& fleet_config, std::vector<UavDoors> doors, ExplorationLog& exploration_log,
                  std::function<double()> clock, const Radio* link)
    : config(usable(fleet_config)),
      pool(config.threads > 1 ? std::make_unique<mapping::WorkerPool>(config.threads) : nullptr),
      log(exploration_log),
      clock_s(std::move(clock)),
      radio(link),
      tasks(fleet_config.task_box, fleet_config.limits.speed_mps),
      integrator(mapping::ScanIntegrator::Config{fleet_config.discretize, fleet_config.threads}),
      pipeline(fleet_config.cloud),
      pilot(fleet_config),
      avoider(fleet_config, 1.0 / fleet_config.sensor.rate_hz),
      tick_s(1.0 / fleet_config.sensor.rate_hz) {
  if (doors.empty()) throw InputError("a fleet needs at least one UAV");
  drafts.resize(doors.size());
  for (int thread = 0; thread < config.threads; ++thread)
    carvers.emplace_back(mapping::ScanIntegrator::Config{.discretize = config.discretize});
  beliefs.push_back(std::make_unique<Belief>(config, next_belief_id++));
  for (std::size_t i = 0; i < doors.size(); ++i) {
    Uav uav;
    uav.id = i;
    uav.sensor = doors[i].sensor;
    uav.vehicle = doors[i].vehicle;
    uav.latency_s = config.plan_latency_s;
    uav.took_off = uav.vehicle->landed();
    uav.home_m = uav.vehicle->state().position_m;
    if (uav.took_off) uav.home_m.z() = lift_to_m(uav);
    uav.progress_m = uav.vehicle->state().position_m;
    uav.belief = beliefs.front().get();
    uav.belief->members.push_back(i);
    uavs.push_back(std::move(uav));
    assume_start_free(uavs.back());
  }
}

void Fleet::Impl::assume_start_free(const Uav& uav) {
  const Eigen::Vector3d start_m = uav.vehicle->state().position_m;
  const double top_m = start_m.z() + (uav.took_off ? config.takeoff_height_m : 0.0);
  for (double z_m = start_m.z(); z_m < top_m + config.start_bubble_m; z_m += config.start_bubble_m) {
    assumed.push_back({{start_m.x(), start_m.y(), std::min(z_m, top_m)}, config.start_bubble_m});
    beliefs.front()->map.assume_free(assumed.back().center_m, assumed.back().radius_m);
  }
}

bool Fleet::Impl::step() {
  if (reason != StopReason::kRunning) return false;
  ++ticks;
  for (Uav& uav : uavs) uav.vehicle->advance(now_s());
  lose_uavs();
  hold_uavs();
  regroup();
  sense();
  decide();
  if (reason == StopReason::kRunning && now_s() >= config.time_limit_s) reason = StopReason::kTimeLimit;
  return reason == StopReason::kRunning;
}

void Fleet::Impl::sense() {
  std::vector<std::size_t> sensing;
  for (const Uav& uav : uavs) {
    if (!uav.lost_s) sensing.push_back(uav.id);
  }
  std::vector<Sensed> sensed(sensing.size());
  mapping::share_among_threads(pool.get(), sensing.size(), [&](std::size_t i, int thread) {
    sensed[i] = sense_one(uavs[sensing[i]], carvers[static_cast<std::size_t>(thread)]);
  });
  for (std::size_t i = 0; i < sensing.size(); ++i) {
    mapping::OccupancyMap& map = uavs[sensing[i]].belief->map;
    const double before_s = clock_s();
    integrator.store(sensed[i].carved, map);
    stats.integrate_ms.push_back((sensed[i].computing_s + clock_s() - before_s) * 1e3);
    log.on_scan(now_s(), sensing[i], map);
  }
  for (const auto& belief : beliefs) belief->update(pool.get());
}

Fleet::Impl::Sensed Fleet::Impl::sense_one(const Uav& uav, mapping::ScanIntegrator& carver) const {
  const MotionState state = uav.vehicle->state();
  const Scan raw = uav.sensor->capture(make_pose(state.position_m, state.yaw_rad), now_s());
  std::vector<Eigen::Vector3d> fellows_m;
  for (const Uav* fellow : fellows_of(uav)) fellows_m.push_back(fellow->vehicle->state().position_m);
  const double before_s = clock_s();
  Sensed sensed;
  carver.carve(pipeline.filter(raw, fellows_m), uav.belief->map, sensed.carved, config.threads);
  sensed.computing_s = clock_s() - before_s;
  return sensed;
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
  drafts[uav.id].reset();
  if (uav.held) return true;
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
             std::function<double()> clock_s, const Radio* radio)
    : impl_(std::make_unique<Impl>(config, std::move(uavs), log, std::move(clock_s), radio)) {}
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
std::size_t Fleet::map_count() const { return impl_->beliefs.size(); }
const mapping::OccupancyMap& Fleet::map(std::size_t i) const { return impl_->beliefs.at(i)->map; }
std::uint64_t Fleet::map_id(std::size_t i) const { return impl_->beliefs.at(i)->id; }
const mapping::OccupancyMap& Fleet::map_of(std::size_t uav) const { return impl_->uavs.at(uav).belief->map; }
bool Fleet::shares_one_map() const { return impl_->radio == nullptr; }
const FleetStats& Fleet::stats() const { return impl_->stats; }
mapping::WorkerPool* Fleet::workers() const { return impl_->pool.get(); }
bool Fleet::exploring() const { return impl_->exploration_end_s < 0.0; }
double Fleet::exploration_end_s() const {
  return impl_->exploration_end_s >= 0.0 ? impl_->exploration_end_s : impl_->now_s();
}
std::vector<double> Fleet::layers_m() const {
  return impl_->config.mode == Mode::kSlice ? impl_->beliefs.front()->strategy->motion_rule().layers_m
                                            : std::vector<double>{};
}

}  // namespace stairwell::explore
