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

constexpr int kStateVersion = 1;
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
  json j = {{"phase", static_cast<int>(uav.avoiding ? Phase::kFindGoal : uav.phase)},
            {"took_off", uav.took_off},
            {"goal_given_s", uav.goal_given_s},
            {"next_decision_s", uav.next_decision_s},
            {"latency_s", uav.latency_s},
            {"waits", uav.waits},
            {"idle", uav.idle},
            {"trajectory", to_json(uav.commanded())}};
  if (uav.goal) j["goal"] = to_json(*uav.goal);
  if (uav.scanned_at_m.allFinite()) j["scanned_at_m"] = to_json(uav.scanned_at_m);
  return j;
}

void restore(Uav& uav, const json& j) {
  const int phase = j.at("phase").get<int>();
  if (phase < 0 || phase > static_cast<int>(Phase::kDone)) throw InputError("the saved fleet state is damaged: phase");
  uav.phase = static_cast<Phase>(phase);
  uav.took_off = j.at("took_off").get<bool>();
  uav.goal_given_s = j.at("goal_given_s").get<double>();
  uav.next_decision_s = j.at("next_decision_s").get<double>();
  uav.latency_s = j.at("latency_s").get<double>();
  uav.waits = j.at("waits").get<int>();
  uav.idle = j.at("idle").get<bool>();
  if (j.contains("goal")) uav.goal = goal_from(j.at("goal"));
  if (j.contains("scanned_at_m")) uav.scanned_at_m = vector_from(j.at("scanned_at_m"));
  uav.vehicle->resume(trajectory_from(j.at("trajectory")));
}

/// Free voxels in which a return once fell, by linear index: a map file does not tell them from others.
std::vector<std::size_t> hit_but_free(const mapping::OccupancyMap& map) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    const VoxelIndex v = map.grid().voxel(i);
    if (map.ever_hit(v) && map.at(v) == Occupancy::kFree) found.push_back(i);
  }
  return found;
}

void mark_hits(mapping::OccupancyMap& map, const std::vector<std::size_t>& voxels) {
  for (const std::size_t i : voxels) {
    if (i >= map.grid().voxel_count()) throw InputError("the saved fleet state is damaged: a voxel beyond the map");
    map.mark_hit(map.grid().voxel(i));
  }
}

}  // namespace

std::string Fleet::save_state() const {
  json j = {{"version", kStateVersion},
            {"ticks", impl_->ticks},
            {"idle_since_s", impl_->idle_since_s},
            {"exploration_end_s", impl_->exploration_end_s},
            {"yield_since_s", impl_->yield_since_s},
            {"yield_voxels", impl_->yield_voxels},
            {"winding_down", impl_->winding_down},
            {"strategy", impl_->strategy->save_state()},
            {"hit_but_free", hit_but_free(impl_->map)},
            {"stats",
             {{"plan_ms", impl_->stats.plan_ms},
              {"integrate_ms", impl_->stats.integrate_ms},
              {"fallbacks", impl_->stats.fallbacks},
              {"fallback_reasons", impl_->stats.fallback_reasons},
              {"emergency_stops", impl_->stats.emergency_stops},
              {"open_targets", impl_->stats.open_targets},
              {"unreachable_targets", impl_->stats.unreachable_targets}}}};
  for (const Uav& uav : impl_->uavs) j["uavs"].push_back(to_json(uav));
  for (const AssumedFree& a : impl_->assumed) j["assumed_free"].push_back({to_json(a.center_m), a.radius_m});
  return j.dump();
}

void Fleet::load_state(const std::string& state, mapping::OccupancyMap map) {
  Impl& fleet = *impl_;
  try {
    const json j = json::parse(state);
    if (j.at("version").get<int>() != kStateVersion) throw InputError("the saved fleet state has another version");
    if (j.at("uavs").size() != fleet.uavs.size()) {
      throw InputError("the saved fleet state is for " + std::to_string(j.at("uavs").size()) + " UAVs, not " +
                       std::to_string(fleet.uavs.size()));
    }
    if (map.grid() != fleet.map.grid()) throw InputError("the saved map has another box or resolution than the run");
    fleet.ticks = j.at("ticks").get<std::size_t>();
    fleet.idle_since_s = j.at("idle_since_s").get<double>();
    fleet.exploration_end_s = j.at("exploration_end_s").get<double>();
    fleet.yield_since_s = j.at("yield_since_s").get<double>();
    fleet.yield_voxels = j.at("yield_voxels").get<std::size_t>();
    fleet.winding_down = j.at("winding_down").get<bool>();
    const json& stats = j.at("stats");
    fleet.stats.plan_ms = stats.at("plan_ms").get<std::vector<double>>();
    fleet.stats.integrate_ms = stats.at("integrate_ms").get<std::vector<double>>();
    fleet.stats.fallbacks = stats.at("fallbacks").get<std::size_t>();
    if (stats.contains("fallback_reasons")) {
      fleet.stats.fallback_reasons = stats.at("fallback_reasons").get<std::map<std::string, std::size_t>>();
    }
    fleet.stats.emergency_stops = stats.at("emergency_stops").get<std::size_t>();
    fleet.stats.open_targets = stats.at("open_targets").get<std::size_t>();
    fleet.stats.unreachable_targets = stats.at("unreachable_targets").get<std::size_t>();
    mark_hits(map, j.at("hit_but_free").get<std::vector<std::size_t>>());
    fleet.map = std::move(map);
    fleet.assumed.clear();
    for (const json& a : j.at("assumed_free")) {
      fleet.assumed.push_back({vector_from(a.at(0)), a.at(1).get<double>()});
      fleet.map.assume_free(fleet.assumed.back().center_m, fleet.assumed.back().radius_m);
    }
    for (std::size_t i = 0; i < fleet.uavs.size(); ++i) {
      restore(fleet.uavs[i], j.at("uavs").at(i));
      fleet.uavs[i].vehicle->advance(fleet.now_s());
    }
    fleet.strategy->load_state(j.at("strategy").get<std::string>());
  } catch (const json::exception& error) {
    throw InputError(std::string("the saved fleet state is damaged: ") + error.what());
  }
  // Everything derived from the map is made again.
  fleet.blocked = mapping::DistanceField(fleet.map.grid(), fleet.blocked.truncation_m(), mapping::Obstacles::kBlocked);
  fleet.blocked.update(fleet.map);
  fleet.blocked_words = mapping::OccupancyWords(fleet.map.grid(), mapping::Obstacles::kBlocked);
  fleet.blocked_words.update(fleet.map);
}

}  // namespace stairwell::explore
