/// Motions under way are looked at on every tick: for what came into sight, and for fellows.
#include "explore/fleet_impl.hpp"

#include <algorithm>
#include <atomic>

namespace stairwell::explore {

namespace {

constexpr double kBrakeEarly_s = 0.3;  // for a fellow in the way: this much before it would be too late

}  // namespace

bool Fleet::Impl::braking(const Uav& uav) const {
  return uav.phase == Phase::kFindGoal && !uav.lost_s && !uav.at_rest(now_s());
}

bool Fleet::Impl::guarded(const Uav& uav) const {
  const bool flies = uav.phase == Phase::kTravel || uav.phase == Phase::kReturn;
  return flies && !uav.lost_s && !uav.at_rest(now_s());
}

/// The way ahead is checked on every tick: the map may have changed under a trajectory.
void Fleet::Impl::guard() {
  std::vector<planning3d::SafetyReport> reports(uavs.size());
  mapping::for_each_index(pool.get(), uavs.size(), [&](std::size_t i) {
    const Uav& uav = uavs[i];
    if (guarded(uav) || braking(uav)) reports[i] = pilot.still_safe(uav.belief->space(), uav, now_s());
  });
  std::vector<bool> stopped(uavs.size(), false);
  for (Uav& uav : uavs) {
    if (reports[uav.id].safe()) continue;
    const bool level = uav.belief->strategy->motion_rule().kind == planning3d::MotionRule::Kind::kSlice;
    const Trajectory stop = pilot.brake_clear(uav.belief->space(), uav, fellows_of(uav), level, now_s());
    if (braking(uav)) {  // it stops already: more of what is in the way came into sight
      command(uav, stop);
      continue;
    }
    stop_at_once(uav, stop, reports[uav.id].verdict);
    stopped[uav.id] = true;
  }
  for (bool again = meets_anyone(stopped); again;) {  // who stops may be in the way of one that was looked at before
    again = false;
    for (Uav& uav : uavs) {
      if (stopped[uav.id] || !guarded(uav) || !mind_fellows(uav)) continue;
      stopped[uav.id] = true;
      again = true;
    }
  }
}

void Fleet::Impl::stop_at_once(Uav& uav, const Trajectory& stop, planning3d::Verdict verdict) {
  log.on_event(now_s(), uav.id, "emergency_stop", planning3d::to_string(verdict));
  ++stats.emergency_stops;
  command(uav, stop);
  uav.goal.reset();
  if (uav.phase == Phase::kTravel) enter(uav, Phase::kFindGoal);
}

/// Whether one of those that did not stop just now has a fellow in its way.
bool Fleet::Impl::meets_anyone(const std::vector<bool>& stopped) {
  if (config.avoidance != Avoidance::kPriority) return false;
  std::atomic<bool> found{false};
  mapping::for_each_index(pool.get(), uavs.size(), [&](std::size_t i) {
    const Uav& uav = uavs[i];
    if (stopped[i] || !guarded(uav)) return;
    if (!pilot.meets(uav.commanded(), fellows_of(uav), now_s()).safe()) found = true;
  });
  return found;
}

/// Motions are planned clear of each other, but a fellow may have braked since then, whatever the reason, and stand in
/// the way. @returns whether the UAV stops for one
bool Fleet::Impl::mind_fellows(Uav& uav) {
  const std::vector<const Uav*> fellows = fellows_of(uav);
  const auto meeting = pilot.meets(uav.commanded(), fellows, now_s());
  if (meeting.safe()) return false;
  const Trajectory stop = pilot.brake(uav, now_s());
  const double early_s = std::max(kBrakeEarly_s, 1.5 * tick_s);       // it is looked at again after a tick
  if (meeting.at_time_s > stop.end_time_s() + early_s) return false;  // there is time to plan another way
  const auto at_rest = pilot.meets(stop, fellows, now_s());
  if (!at_rest.safe() && at_rest.at_time_s < meeting.at_time_s) return false;
  stop_at_once(uav, stop, meeting.verdict);
  return true;
}

}  // namespace stairwell::explore
