/// What a resumed run needs, as JSON text.
#include "core/errors.hpp"
#include "explore/fleet_impl.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <utility>
#include <vector>

namespace stairwell::explore {

using coverage3d::Goal;
using nlohmann::json;

namespace {

constexpr int kStateVersion = 4;
constexpr std::size_t kNumbersPerState = 11;

json to_json(const Eigen::Vector3d& v) { return json::array({v.x(), v.y(), v.z()}); }

Eigen::Vector3d vector_from(const json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

json to_json(const Trajectory& trajectory) {
  json numbers = json::array();
  for (const MotionState& s : trajectory.states()) {
    for (const Eigen::Vector3d* v : {&s.position_m, &s.velocity_mps, &s.acceleration_mps2}) {
      for (int axis = 0; axis < 3; ++axis) numbers.push_back((*v)[axis]);
    }
    numbers.push_back(s.yaw_rad);
    numbers.push_back(s.yaw_rate_radps);
  }
  return {{"start_s", trajectory.start_time_s()}, {"states", std::move(numbers)}};
}

Trajectory trajectory_from(const json& j) {
  const auto numbers = j.at("states").get<std::vector<double>>();
  if (numbers.empty() || numbers.size() % kNumbersPerState != 0) {
    throw InputError("the saved fleet state is damaged: a trajectory has " + std::to_string(numbers.size()) +
                     " numbers");
  }
  std::vector<MotionState> states(numbers.size() / kNumbersPerState);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double* n = numbers.data() + i * kNumbersPerState;
    states[i].position_m = {n[0], n[1], n[2]};
    states[i].velocity_mps = {n[3], n[4], n[5]};
    states[i].acceleration_mps2 = {n[6], n[7], n[8]};
    states[i].yaw_rad = n[9];
    states[i].yaw_rate_radps = n[10];
  }
  return {j.at("start_s").get<double>(), std::move(states)};
}

json to_json(const Goal& goal) {
  return {{"position_m", to_json(goal.position_m)},
          {"yaw_rad", goal.yaw_rad},
          {"target_m", to_json(goal.target_m)},
          {"gain_m3", goal.gain_m3},
          {"travel_m", goal.travel_m}};
}

Goal goal_from(const json& j) {
  Goal goal;
  goal.position_m = vector_from(j.at("position_m"));
  goal.yaw_rad = j.at("yaw_rad").get<double>();
  goal.target_m = vector_from(j.at("target_m"));
  goal.gain_m3 = j.at("gain_m3").get<double>();
  goal.travel_m = j.at("travel_m").get<double>();
  return goal;
}

json to_json(const Uav& uav) {
  json j = {{"phase", static_cast<int>(uav.avoiding && uav.phase == Phase::kTravel ? Phase::kFindGoal : uav.phase)},
            {"took_off", uav.took_off},
            {"goal_given_s", uav.goal_given_s},
            {"part_way", uav.part_way},
            {"next_decision_s", uav.next_decision_s},
            {"latency_s", uav.latency_s},
            {"waits", uav.waits},
            {"idle", uav.idle},
            {"out_of_battery", uav.out_of_battery},
            {"failed_returns", uav.failed_returns},
            {"home_m", to_json(uav.home_m)},
            {"flying_since_s", uav.flying_since_s},
            {"progress_m", to_json(uav.progress_m)},
            {"progress_s", uav.progress_s},
            {"held", uav.held},
            {"trajectory", to_json(uav.commanded())}};
  if (uav.goal) j["goal"] = to_json(*uav.goal);
  if (uav.lost_s) j["lost_s"] = *uav.lost_s;
  if (uav.stalled_s) j["stalled_s"] = *uav.stalled_s;
  if (uav.scanned_at_m.allFinite()) j["scanned_at_m"] = to_json(uav.scanned_at_m);
  return j;
}

void restore(Uav& uav, const json& j) {
  const int phase = j.at("phase").get<int>();
  if (phase < 0 || phase > static_cast<int>(Phase::kReturn))
    throw InputError("the saved fleet state is damaged: phase");
  uav.phase = static_cast<Phase>(phase);
  uav.took_off = j.at("took_off").get<bool>();
  uav.goal_given_s = j.at("goal_given_s").get<double>();
  uav.part_way = j.value("part_way", false);
  uav.next_decision_s = j.at("next_decision_s").get<double>();
  uav.latency_s = j.at("latency_s").get<double>();
  uav.waits = j.at("waits").get<int>();
  uav.idle = j.at("idle").get<bool>();
  uav.out_of_battery = j.at("out_of_battery").get<bool>();
  uav.failed_returns = j.at("failed_returns").get<int>();
  uav.home_m = vector_from(j.at("home_m"));
  uav.flying_since_s = j.at("flying_since_s").get<double>();
  uav.progress_m = vector_from(j.at("progress_m"));
  uav.progress_s = j.at("progress_s").get<double>();
  uav.held = j.at("held").get<bool>();
  if (j.contains("stalled_s")) uav.stalled_s = j.at("stalled_s").get<double>();
  if (j.contains("lost_s")) uav.lost_s = j.at("lost_s").get<double>();
  if (j.contains("goal")) uav.goal = goal_from(j.at("goal"));
  if (j.contains("scanned_at_m")) uav.scanned_at_m = vector_from(j.at("scanned_at_m"));
  uav.vehicle->resume(trajectory_from(j.at("trajectory")));
}

/// Free voxels in which a return once fell, by linear index: a map file does not tell them from others.
std::vector<std::size_t> hit_but_free(const mapping::OccupancyMap& map) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    if (map.at(i) == Occupancy::kFree && map.ever_hit(i)) found.push_back(i);
  }
  return found;
}

void mark_hits(mapping::OccupancyMap& map, const std::vector<std::size_t>& voxels) {
  for (const std::size_t i : voxels) {
    if (i >= map.grid().voxel_count()) throw InputError("the saved fleet state is damaged: a voxel beyond the map");
    map.mark_hit(map.grid().voxel(i));
  }
}

json to_json(const FleetStats& stats) {
  return {{"plan_ms", stats.plan_ms},
          {"integrate_ms", stats.integrate_ms},
          {"fallbacks", stats.fallbacks},
          {"fallback_reasons", stats.fallback_reasons},
          {"emergency_stops", stats.emergency_stops},
          {"open_targets", stats.open_targets},
          {"unreachable_targets", stats.unreachable_targets},
          {"out_of_battery", stats.out_of_battery},
          {"lost", stats.lost},
          {"stalls", stats.stalls},
          {"stalled", stats.stalled},
          {"map_exchanges", stats.map_exchanges},
          {"voxels_told", stats.voxels_told}};
}

FleetStats stats_from(const json& j) {
  FleetStats stats;
  stats.plan_ms = j.at("plan_ms").get<std::vector<double>>();
  stats.integrate_ms = j.at("integrate_ms").get<std::vector<double>>();
  stats.fallbacks = j.at("fallbacks").get<std::size_t>();
  stats.fallback_reasons = j.at("fallback_reasons").get<std::map<std::string, std::size_t>>();
  stats.emergency_stops = j.at("emergency_stops").get<std::size_t>();
  stats.open_targets = j.at("open_targets").get<std::size_t>();
  stats.unreachable_targets = j.at("unreachable_targets").get<std::size_t>();
  stats.out_of_battery = j.at("out_of_battery").get<std::size_t>();
  stats.lost = j.at("lost").get<std::size_t>();
  stats.stalls = j.at("stalls").get<std::size_t>();
  stats.stalled = j.at("stalled").get<std::size_t>();
  stats.map_exchanges = j.at("map_exchanges").get<std::size_t>();
  stats.voxels_told = j.at("voxels_told").get<std::size_t>();
  return stats;
}

/// What others know of the map is not saved: they are told all of it again, which changes nothing.
json to_json(const Belief& belief) {
  json j = {{"members", belief.members},
            {"strategy", belief.strategy->save_state()},
            {"hit_but_free", hit_but_free(belief.map)},
            {"yield_since_s", belief.yield_since_s},
            {"yield_voxels", belief.yield_voxels},
            {"fruitless", belief.fruitless},
            {"fruitless_voxels", belief.fruitless_voxels},
            {"winding_down", belief.winding_down},
            {"passed", json::array()}};
  for (const auto& [uav, track] : belief.passed) {
    json places = json::array();
    for (const Eigen::Vector3d& at_m : track) places.push_back(to_json(at_m));
    j["passed"].push_back({{"uav", uav}, {"places", std::move(places)}});
  }
  return j;
}

void restore(Belief& belief, const json& j, mapping::OccupancyMap map) {
  mark_hits(map, j.at("hit_but_free").get<std::vector<std::size_t>>());
  belief.map = std::move(map);
  belief.members = j.at("members").get<std::vector<std::size_t>>();
  belief.strategy->load_state(j.at("strategy").get<std::string>());
  belief.yield_since_s = j.at("yield_since_s").get<double>();
  belief.yield_voxels = j.at("yield_voxels").get<std::size_t>();
  belief.fruitless = j.value("fruitless", std::size_t{0});
  belief.fruitless_voxels = j.value("fruitless_voxels", std::size_t{0});
  belief.winding_down = j.at("winding_down").get<bool>();
  for (const json& track : j.at("passed")) {
    std::vector<Eigen::Vector3d>& places = belief.passed[track.at("uav").get<std::size_t>()];
    for (const json& at_m : track.at("places")) places.push_back(vector_from(at_m));
  }
}

}  // namespace

std::string Fleet::save_state() const {
  json j = {{"version", kStateVersion},
            {"ticks", impl_->ticks},
            {"idle_since_s", impl_->idle_since_s},
            {"exploration_end_s", impl_->exploration_end_s},
            {"tasks", impl_->tasks.to_json()},
            {"stats", to_json(impl_->stats)}};
  for (const Uav& uav : impl_->uavs) j["uavs"].push_back(to_json(uav));
  for (const auto& belief : impl_->beliefs) j["beliefs"].push_back(to_json(*belief));
  for (const AssumedFree& a : impl_->assumed) j["assumed_free"].push_back({to_json(a.center_m), a.radius_m});
  return j.dump();
}

void Fleet::load_state(const std::string& state, std::vector<mapping::OccupancyMap> maps) {
  try {
    impl_->load(json::parse(state), std::move(maps));
  } catch (const json::exception& error) {
    throw InputError(std::string("the saved fleet state is damaged: ") + error.what());
  }
}

void Fleet::Impl::load(const json& j, std::vector<mapping::OccupancyMap> maps) {
  if (j.at("version").get<int>() != kStateVersion) throw InputError("the saved fleet state has another version");
  if (j.at("uavs").size() != uavs.size()) {
    throw InputError("the saved fleet state is for " + std::to_string(j.at("uavs").size()) + " UAVs, not " +
                     std::to_string(uavs.size()));
  }
  if (j.at("beliefs").size() != maps.size()) {
    throw InputError("the saved fleet state is for " + std::to_string(j.at("beliefs").size()) + " maps, not " +
                     std::to_string(maps.size()));
  }
  ticks = j.at("ticks").get<std::size_t>();
  idle_since_s = j.at("idle_since_s").get<double>();
  exploration_end_s = j.at("exploration_end_s").get<double>();
  tasks.from_json(j.at("tasks"));
  stats = stats_from(j.at("stats"));
  assumed.clear();
  for (const json& a : j.at("assumed_free")) assumed.push_back({vector_from(a.at(0)), a.at(1).get<double>()});
  for (std::size_t i = 0; i < uavs.size(); ++i) {
    restore(uavs[i], j.at("uavs").at(i));
    uavs[i].vehicle->advance(now_s());
    uavs[i].belief = nullptr;
  }
  const GridSpec grid = beliefs.front()->map.grid();
  beliefs.clear();
  for (std::size_t i = 0; i < maps.size(); ++i) {
    if (maps[i].grid() != grid) throw InputError("the saved map has another box or resolution than the run");
    beliefs.push_back(std::make_unique<Belief>(config, next_belief_id++));
    restore(*beliefs.back(), j.at("beliefs").at(i), std::move(maps[i]));
    for (const AssumedFree& a : assumed) beliefs.back()->map.assume_free(a.center_m, a.radius_m);
    beliefs.back()->update(pool.get());
    for (const std::size_t uav : beliefs.back()->members) uavs.at(uav).belief = beliefs.back().get();
  }
  for (const Uav& uav : uavs) {
    if (uav.belief == nullptr) throw InputError("the saved fleet state is damaged: a UAV without a map");
  }
}

}  // namespace stairwell::explore
