#include "core/units.hpp"
#include "explore/fleet_impl.hpp"
#include "explore/radial_scan.hpp"
#include "planning3d/curve.hpp"
#include "planning3d/travel_costs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

namespace stairwell::explore {

using coverage3d::Assignment;
using coverage3d::AssignmentRequest;
using coverage3d::Goal;
using coverage3d::UavView;

namespace {

constexpr double kRetry_s = 0.5;        // after "nothing for you" or a fellow in the way
constexpr int kGiveUpWaiting = 12;      // plans in a row before a goal blocked by fellows is given up
constexpr double kSettled_s = 1.0;      // nobody has anything to do for this long: the end
constexpr double kNearlyThere_s = 2.5;  // a goal this near is not given up for another one
constexpr double kLeastFlight_s = 0.5;  // towards a goal before another is asked for ...
constexpr double kBraking_s = 1.2;      // ... unless the motion ends so soon that it slows down
constexpr double kHorizon_s = 10.0;     // longer ways to goals are flown part by part, ...
constexpr double kPlanOn_s = 5.0;       // the next one planned this long before the last one ends
constexpr double kSameGoal_m = 0.15;
constexpr double kSameYaw_rad = 0.2;
constexpr double kRescan_m = 0.5;         // no second radial scan within this distance of the last one
constexpr double kLatencyHeadroom = 1.5;  // plans depart this many of the last computing times ahead
constexpr double kMaxLatency_s = 1.0;
constexpr double kMakeWayReach_m = 4.0;
constexpr std::size_t kFruitlessEach = 5;  // goals of every UAV that show nothing new, before a fleet asks itself
constexpr double kKept = 1.0 / 3.0;        // of what a remainder promises
constexpr double kLookEvery_s = 0.5;

bool same_goal(const Goal& a, const Goal& b) {
  return (a.position_m - b.position_m).norm() < kSameGoal_m &&
         std::abs(std::remainder(a.yaw_rad - b.yaw_rad, 2.0 * kPi)) < kSameYaw_rad;
}

/// The reachable voxel around `from_m` with the shortest way to it that satisfies `far_enough`.
std::optional<Eigen::Vector3d> nearest_refuge(const planning3d::FreeSpace& space, const planning3d::TravelCosts& costs,
                                              const Eigen::Vector3d& from_m,
                                              const std::function<bool(const Eigen::Vector3d&)>& far_enough) {
  const int reach = static_cast<int>(kMakeWayReach_m / space.grid().resolution_m());
  const VoxelIndex center = space.grid().index_of(from_m);
  std::optional<Eigen::Vector3d> best_m;
  float best_cost_m = std::numeric_limits<float>::infinity();
  for (int dz = -reach / 2; dz <= reach / 2; dz += 2) {
    for (int dy = -reach; dy <= reach; dy += 2) {
      for (int dx = -reach; dx <= reach; dx += 2) {
        const VoxelIndex v = center + VoxelIndex{dx, dy, dz};
        if (!space.traversable(v) || costs.distance_m(v) >= best_cost_m) continue;
        const Eigen::Vector3d p_m = space.grid().center_of(v);
        if (!far_enough(p_m)) continue;
        best_cost_m = costs.distance_m(v);
        best_m = p_m;
      }
    }
  }
  return best_m;
}

/// Where the motion leads, every now and then until it ends.
std::vector<coverage3d::PlannedLook> looks_ahead(const Trajectory& motion, double time_s) {
  std::vector<coverage3d::PlannedLook> looks;
  for (double at_s = time_s + kLookEvery_s; at_s < motion.end_time_s(); at_s += kLookEvery_s) {
    const MotionState state = motion.sample(at_s);
    looks.push_back({state.position_m, state.yaw_rad});
  }
  return looks;
}

}  // namespace

void Fleet::Impl::decide() {
  guard();
  if (config.avoidance == Avoidance::kOrca) avoid();
  for (Uav& uav : uavs) {
    watch_battery(uav);
    watch_progress(uav);
    if (!uav.lost_s) advance_phase(uav);
  }
  for (const auto& belief : beliefs) decide_together(*belief);
  finish_if_nothing_left();
}

/// The members of a group share out what their map holds.
void Fleet::Impl::decide_together(Belief& belief) {
  belief.winding_down = belief.winding_down || (!config.finish_slab && !worth_going_on(belief));
  std::vector<std::size_t> wanting;
  for (const std::size_t id : belief.members) {
    if (belief.winding_down) uavs[id].idle = true;
    if (!belief.winding_down && wants_goal(uavs[id])) wanting.push_back(id);
  }
  if (!wanting.empty()) assign_goals(belief, wanting);
}

void Fleet::Impl::advance_phase(Uav& uav) {
  switch (uav.phase) {
    case Phase::kGrounded:
      take_off(uav);
      break;
    case Phase::kTakeoff:
      if (uav.at_rest(now_s())) lifted(uav) ? scan_around_or_find_goal(uav) : take_off(uav);
      break;
    case Phase::kRadialScan:
      if (uav.at_rest(now_s())) scan_around_or_find_goal(uav);
      break;
    case Phase::kTravel:
      if (uav.at_rest(now_s()) && !uav.avoiding) arrive(uav);
      break;
    case Phase::kReturn:
      if (uav.at_rest(now_s()) && !uav.avoiding) fly_home(uav);
      break;
    case Phase::kLand:
      if (uav.at_rest(now_s())) enter(uav, Phase::kDone);
      break;
    case Phase::kFindGoal:
    case Phase::kDone:
      break;
  }
}

void Fleet::Impl::take_off(Uav& uav) {
  if (!uav.took_off || config.takeoff_height_m <= 0.0) {
    scan_around_or_find_goal(uav);
    return;
  }
  const auto lift = pilot.vertical(uav.belief->space(), uav, uav.home_m.z(), now_s(), false);
  if (lift && command(uav, *lift)) enter(uav, Phase::kTakeoff);
}

void Fleet::Impl::scan_around_or_find_goal(Uav& uav) {
  const MotionState state = uav.vehicle->state();
  if (config.radial_scan && (state.position_m - uav.scanned_at_m).norm() > kRescan_m) {
    const double turn_rad = look_round_turn(uav);
    uav.scanned_at_m = state.position_m;
    if (std::abs(turn_rad) > 0.05 && command(uav, pilot.rotate(uav, turn_rad, now_s()))) {
      enter(uav, Phase::kRadialScan);
      return;
    }
  }
  enter(uav, Phase::kFindGoal);
}

/// Those who start side by side share the first look round.
double Fleet::Impl::look_round_turn(const Uav& uav) const {
  const MotionState state = uav.vehicle->state();
  const double reach_m = 0.5 * config.sensor.max_range_m;
  std::vector<Eigen::Vector3d> beside_m;
  std::size_t own = 0;
  for (const std::size_t id : uav.belief->members) {
    const Uav& other = uavs[id];
    if (id == uav.id) own = beside_m.size();
    const bool looks = id == uav.id || !(other.lost_s || other.stalled_s);
    if (looks && (other.home_m - uav.home_m).norm() < reach_m) beside_m.push_back(other.home_m);
  }
  const bool shared = !uav.scanned_at_m.allFinite() && beside_m.size() > 1;
  const auto own_azimuth = [&](double azimuth_rad) { return !shared || own_side(beside_m, own, azimuth_rad); };
  return radial_scan_turn(uav.belief->map, state.position_m, state.yaw_rad, config.sensor, reach_m, own_azimuth);
}

/// At the goal, with the scan from there in the map: what is still unseen cannot be seen from here.
void Fleet::Impl::arrive(Uav& uav) {
  if (uav.goal && !reached(uav)) {
    uav.next_decision_s = now_s() + kRetry_s;
    return enter(uav, Phase::kFindGoal);
  }
  if (uav.goal) note_progress(uav);
  if (uav.goal && uav.belief->strategy->still_useful(uav.belief->space(), *uav.goal)) {
    uav.belief->strategy->report_failure(*uav.goal, now_s());
    log.on_event(now_s(), uav.id, "goal_failed", "nothing_new_seen");
    ++uav.belief->fruitless;
  }
  uav.goal.reset();
  enter(uav, Phase::kFindGoal);
}

bool Fleet::Impl::wants_goal(const Uav& uav) {
  if (uav.lost_s || now_s() < uav.next_decision_s) return false;
  if (uav.phase == Phase::kFindGoal) return true;
  if (uav.phase != Phase::kTravel || !uav.goal) return false;
  const double left_s = uav.commanded().end_time_s() - now_s();
  const double flown_s = now_s() - uav.goal_given_s;
  if (flown_s < kLeastFlight_s && left_s > kBraking_s) return false;
  if (must_plan_on(uav)) return true;
  const bool far_to_go = left_s > kNearlyThere_s;
  if (far_to_go && flown_s >= config.replan_period_s) return true;
  return !uav.belief->strategy->still_useful(uav.belief->space(), *uav.goal);
}

double Fleet::Impl::depart_time(const Uav& uav) const {
  // Whole ticks, so that every motion starts where the simulation looks at it.
  return (static_cast<double>(ticks) + std::max(1.0, std::ceil(uav.latency_s / tick_s))) * tick_s;
}

/// Time spent computing passes in the simulation: nothing new is decided meanwhile, and the next plan departs late
/// enough for as long a computation.
void Fleet::Impl::charge(Uav& uav, double computing_s) {
  stats.plan_ms.push_back(computing_s * 1e3);
  if (!config.charge_planning) return;
  uav.next_decision_s = std::max(uav.next_decision_s, now_s() + computing_s);
  uav.latency_s = std::clamp(kLatencyHeadroom * computing_s, config.plan_latency_s, kMaxLatency_s);
}

void Fleet::Impl::assign_goals(Belief& belief, const std::vector<std::size_t>& wanting) {
  const double before_s = clock_s();
  AssignmentRequest request;
  request.time_s = now_s();
  request.workers = pool.get();
  for (const Uav& uav : uavs) {
    const MotionState state = uav.commanded().sample(depart_time(uav));
    UavView& view = request.uavs.emplace_back();
    view.position_m = state.position_m;
    view.velocity_mps = state.velocity_mps;
    view.yaw_rad = state.yaw_rad;
    view.wants_goal = std::find(wanting.begin(), wanting.end(), uav.id) != wanting.end();
    const bool gave_back = forgotten(uav) || (uav.stalled_s && !view.wants_goal);
    if (!gave_back) view.goal = uav.goal;
    if (view.goal && !view.wants_goal) view.ahead = looks_ahead(uav.commanded(), now_s());
    view.placed =
        !uav.retired() && !gave_back && (belief.has(uav.id) || belief.map.at(state.position_m) == Occupancy::kFree);
    view.shares_map = belief.has(uav.id);
  }
  request.passed_m = belief.passed_m();
  if (radio != nullptr) request.tasks = &tasks;
  const Assignment assignment = belief.strategy->assign(belief.space(), request);
  stats.open_targets = assignment.open_targets;
  stats.unreachable_targets = assignment.unreachable_targets;
  const double assign_s = clock_s() - before_s;
  draft_flights(wanting, assignment);
  for (const std::size_t id : wanting) {
    Uav& uav = uavs[id];
    uav.idle = !assignment.goals[id].has_value();
    if (uav.idle) {
      no_goal(uav);
      charge(uav, assign_s);
    } else {
      fly(uav, *assignment.goals[id], assign_s);
    }
  }
}

void Fleet::Impl::no_goal(Uav& uav) {
  uav.next_decision_s = now_s() + kRetry_s;
  if (uav.phase == Phase::kTravel) {  // flies its last goal to the end first, unless motion counts as exploring
    if (config.finish_slab) stop_short(uav);
    return;
  }
  uav.goal.reset();
  scan_around_or_find_goal(uav);
}

/// Nothing is left for it: it brakes where that ends its motion sooner than flying on.
void Fleet::Impl::stop_short(Uav& uav) {
  if (uav.avoiding) return;
  const double depart_s = depart_time(uav);
  const Trajectory stop = pilot.brake(uav, depart_s);
  if (stop.end_time_s() >= uav.commanded().end_time_s() || !pilot.is_safe(uav.belief->space(), stop, depart_s)) return;
  if (command(uav, stop)) uav.goal.reset();
}

/// Its motion leads part of the way and ends before long.
bool Fleet::Impl::must_plan_on(const Uav& uav) const {
  return uav.part_way && !uav.avoiding && uav.commanded().end_time_s() - now_s() < kPlanOn_s;
}

bool Fleet::Impl::keeps_goal(const Uav& uav, const Goal& goal) const {
  return uav.phase == Phase::kTravel && uav.goal && same_goal(*uav.goal, goal) && !uav.at_rest(depart_time(uav)) &&
         !must_plan_on(uav);
}

Fleet::Impl::Draft Fleet::Impl::draft_flight(const Uav& uav, const Goal& goal, int thread) {
  const double before_s = clock_s();
  Draft draft;
  draft.flight =
      pilot.draft(uav.belief->space(), uav, goal.position_m, goal.yaw_rad, uav.belief->strategy->motion_rule(),
                  depart_time(uav), kHorizon_s * config.limits.speed_mps, thread);
  draft.computing_s = clock_s() - before_s;
  return draft;
}

/// By all threads, as far as the UAVs do not depend on each other.
void Fleet::Impl::draft_flights(const std::vector<std::size_t>& wanting, const coverage3d::Assignment& assignment) {
  for (auto& draft : drafts) draft.reset();
  if (pilot.drafting_threads() == 1) return;
  std::vector<std::size_t> flying;
  for (const std::size_t id : wanting) {
    if (assignment.goals[id] && !keeps_goal(uavs[id], *assignment.goals[id])) flying.push_back(id);
  }
  mapping::share_among_threads(pool.get(), flying.size(), [&](std::size_t i, int thread) {
    const std::size_t id = flying[i];
    drafts[id] = draft_flight(uavs[id], *assignment.goals[id], thread);
  });
}

void Fleet::Impl::fly(Uav& uav, const Goal& goal, double assign_s) {
  uav.goal_given_s = now_s();
  if (keeps_goal(uav, goal)) {
    uav.goal = goal;
    charge(uav, assign_s);
    return;
  }
  const double depart_s = depart_time(uav);
  Draft draft = drafts[uav.id] ? std::move(*drafts[uav.id]) : draft_flight(uav, goal, 0);
  drafts[uav.id].reset();
  const double before_s = clock_s();
  FlightResult flight =
      pilot.fly(uav.belief->space(), uav, goal.yaw_rad, std::move(draft.flight), fellows_of(uav), depart_s);
  const double computing_s = assign_s + draft.computing_s + (clock_s() - before_s);
  charge(uav, computing_s);
  const bool too_late = config.charge_planning && now_s() + computing_s > depart_s;
  if (flight.outcome == FlightOutcome::kFlying && too_late) {
    log.on_event(now_s(), uav.id, "plan_discarded", "too_late");
    return;
  }
  if (flight.outcome == FlightOutcome::kFlying && command(uav, *flight.trajectory)) {
    if (flight.fell_back) {
      ++stats.fallbacks;
      ++stats.fallback_reasons[flight.not_used];
      log.on_event(now_s(), uav.id, "fallback", flight.not_used + "; used " + std::string(flight.planner));
    }
    uav.goal = goal;
    uav.part_way = flight.part_way;
    uav.waits = 0;
    uav.avoiding = uav.on_segment = false;
    avoider.remember_path(uav, std::move(flight.path_m));
    log.on_goal(now_s(), uav.id, goal.position_m, goal.gain_m3, flight.planner);
    enter(uav, Phase::kTravel);
    return;
  }
  if (flight.outcome == FlightOutcome::kFellowInTheWay && ++uav.waits < kGiveUpWaiting) {
    log.on_event(now_s(), uav.id, "waiting", "fellow_in_the_way");
    make_way(uav, flight.wanted_path_m);
    uav.next_decision_s = std::max(uav.next_decision_s, now_s() + kRetry_s);
    return;
  }
  uav.waits = 0;
  uav.belief->strategy->report_failure(goal, now_s());
  log.on_event(now_s(), uav.id, "goal_failed", "unreachable");
}

/// An idle UAV stays an obstacle; when it is in a fellow's way it moves to the nearest place that is not.
void Fleet::Impl::make_way(const Uav& blocked_uav, const std::vector<Eigen::Vector3d>& wanted_path_m) {
  const double room_m = 1.5 * config.fellow_clearance_m;
  for (Uav& fellow : uavs) {
    const bool resting = !fellow.lost_s && fellow.phase == Phase::kFindGoal && fellow.at_rest(now_s());
    if (fellow.id == blocked_uav.id || !resting || now_s() < fellow.next_decision_s - kRetry_s) continue;
    const Eigen::Vector3d at_m = fellow.vehicle->state().position_m;
    if (planning3d::distance_to_polyline(wanted_path_m, at_m) > room_m) continue;
    planning3d::TravelCosts costs;
    costs.compute(fellow.belief->space(), at_m, fellow.belief->strategy->motion_rule(), 2.0 * kMakeWayReach_m,
                  &fellow.belief->passable);
    const auto refuge = nearest_refuge(fellow.belief->space(), costs, at_m, [&](const Eigen::Vector3d& p_m) {
      return planning3d::distance_to_polyline(wanted_path_m, p_m) > room_m;
    });
    if (!refuge) continue;
    FlightResult flight = pilot.fly_to(fellow.belief->space(), fellow, *refuge, fellow.vehicle->state().yaw_rad,
                                       fellow.belief->strategy->motion_rule(), fellows_of(fellow), depart_time(fellow));
    if (flight.outcome == FlightOutcome::kFlying && command(fellow, *flight.trajectory)) {
      log.on_event(now_s(), fellow.id, "makes_way", "idle");
      fellow.goal.reset();
      fellow.avoiding = fellow.on_segment = false;
      avoider.remember_path(fellow, std::move(flight.path_m));
      enter(fellow, Phase::kTravel);
    }
  }
}

/// Views into unknown space promise more than they show, most where it is the inside of solids: many of them in a row
/// that showed next to nothing, for the size of the map and for goals that are no remainders, say that this is left.
bool Fleet::Impl::promises_nothing(Belief& belief) const {
  if (belief.fruitless < std::max(config.fruitless_visits, kFruitlessEach * belief.members.size())) return false;
  const std::size_t known = belief.map.known_voxels();
  const auto growth = static_cast<double>(known) - static_cast<double>(belief.fruitless_voxels);
  const double worth_m3 = kKept * config.remainder_gain_m3 * static_cast<double>(belief.fruitless);
  if (growth < config.min_growth * static_cast<double>(known) && growth * std::pow(config.resolution_m, 3) < worth_m3) {
    return true;
  }
  belief.fruitless = 0;
  belief.fruitless_voxels = known;
  return false;
}

/// The last visible crumbs cost more flight than all the rest: the fleet stops when only remainders are left to fly to
/// and, over some time, hardly anything new was seen.
bool Fleet::Impl::worth_going_on(Belief& belief) {
  if (promises_nothing(belief)) {
    log.on_event(now_s(), belief.members.front(), "winding_down", "promises_not_kept");
    return false;
  }
  const auto out_of_it = [this](std::size_t id) { return uavs[id].stalled_s || uavs[id].lost_s; };
  const bool nobody_moves = std::ranges::all_of(belief.members, out_of_it);
  const bool promising = nobody_moves || std::ranges::any_of(belief.members, [&](std::size_t id) {
                           const Uav& uav = uavs[id];
                           if (out_of_it(id)) return false;
                           return (uav.goal && uav.goal->gain_m3 >= config.remainder_gain_m3) ||
                                  (uav.phase != Phase::kTravel && uav.phase != Phase::kFindGoal);
                         });
  const auto growth = static_cast<double>(belief.map.known_voxels()) - static_cast<double>(belief.yield_voxels);
  if (promising || growth > config.min_growth * static_cast<double>(belief.yield_voxels)) {
    belief.yield_since_s = now_s();
    belief.yield_voxels = belief.map.known_voxels();
  }
  if (now_s() - belief.yield_since_s < config.patience_s) return true;
  log.on_event(now_s(), belief.members.front(), "winding_down", "only_remainders_left");
  return false;
}

void Fleet::Impl::finish_if_nothing_left() {
  if (exploration_end_s >= 0.0) return end_run_when_down();
  const bool all_idle = std::ranges::all_of(uavs, [this](const Uav& uav) {
    return uav.retired() || dispensable(uav) || (uav.phase == Phase::kFindGoal && uav.idle && uav.at_rest(now_s()));
  });
  if (!all_idle) {
    idle_since_s = -1.0;
    return;
  }
  if (idle_since_s < 0.0) idle_since_s = now_s();
  if (now_s() - idle_since_s < kSettled_s) return;
  exploration_end_s = idle_since_s;
  for (Uav& uav : uavs) {
    if (!uav.retired()) retire(uav);
  }
}

void Fleet::Impl::end_run_when_down() {
  const auto down = [](const Uav& uav) { return uav.lost_s || uav.stalled_s || uav.phase == Phase::kDone; };
  if (!std::ranges::all_of(uavs, down)) return;
  reason = StopReason::kNothingReachableLeft;
  if (stats.out_of_battery > 0 && stats.open_targets > 0) reason = StopReason::kBattery;
  if (stats.lost == uavs.size()) reason = StopReason::kAllLost;
}

}  // namespace stairwell::explore
