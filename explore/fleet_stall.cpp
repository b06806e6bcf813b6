/// UAVs that are heard of and make no progress (`stalled_after_s`, `--stall`).
#include "core/units.hpp"
#include "explore/fleet_impl.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::explore {

namespace {

constexpr double kProgress_m = 0.3;
constexpr double kThere_m = 0.5;  // from the goal, at the end of a motion towards it
constexpr double kThere_rad = 0.5;

}  // namespace

void Fleet::Impl::hold_uavs() {
  for (Uav& uav : uavs) {
    const bool hold = std::ranges::any_of(config.stalls, [&](const Stall& stall) {
      return stall.uav == uav.id && now_s() >= stall.from_s && now_s() < stall.to_s;
    });
    if (hold && !uav.held) command(uav, pilot.brake(uav, now_s()));
    uav.held = hold;
  }
}

/// Where its goal is, as far as the vehicle knows. A sensor that sees all round is not turned.
bool Fleet::Impl::reached(const Uav& uav) const {
  const MotionState state = uav.vehicle->state();
  const bool turned =
      uav.sensor->model().panoramic() || std::abs(wrap_angle(state.yaw_rad - uav.goal->yaw_rad)) < kThere_rad;
  return turned && (state.position_m - uav.goal->position_m).norm() < kThere_m;
}

/// In the air, as high as its take-off leads.
bool Fleet::Impl::lifted(const Uav& uav) const {
  return uav.home_m.z() - uav.vehicle->state().position_m.z() < kProgress_m;
}

/// Progress is to have moved, to have reached the goal (Fleet::Impl::arrive), or to have nowhere to go. Waiting for a
/// fellow does not count.
void Fleet::Impl::watch_progress(Uav& uav) {
  if (uav.lost_s) return;
  const Eigen::Vector3d at_m = uav.vehicle->state().position_m;
  if ((at_m - uav.progress_m).norm() > kProgress_m) return note_progress(uav);
  const bool under_way = uav.goal || uav.phase == Phase::kTakeoff || uav.phase == Phase::kReturn;
  const bool waits = uav.waits > 0 || uav.failed_returns > 0 || uav.avoiding;
  if (!under_way) uav.progress_s = now_s();
  if (waits) uav.progress_s += tick_s;
  if (now_s() - uav.progress_s >= config.stalled_after_s) give_task_back(uav);
}

void Fleet::Impl::note_progress(Uav& uav) {
  uav.progress_m = uav.vehicle->state().position_m;
  uav.progress_s = now_s();
  if (!uav.stalled_s) return;
  uav.stalled_s.reset();
  --stats.stalled;
  log.on_event(now_s(), uav.id, "moves_again", "progress");
}

/// Others take it; its surroundings are not avoided, for nothing is known against them. It tries again after the same
/// time, and until it has moved others look at nothing that it is given as taken.
void Fleet::Impl::give_task_back(Uav& uav) {
  if (!uav.stalled_s) {
    uav.stalled_s = now_s();
    ++stats.stalls;
    ++stats.stalled;
    log.on_event(now_s(), uav.id, "stalled", "no_progress");
  }
  if (uav.goal) log.on_event(now_s(), uav.id, "task_given_back", "stalled");
  uav.goal.reset();
  uav.progress_s = now_s();
  uav.next_decision_s = std::max(uav.next_decision_s, now_s() + config.stalled_after_s);
  if (uav.phase == Phase::kTravel) enter(uav, Phase::kFindGoal);
}

/// Stalled, and somebody else is not: the end does not wait for it.
bool Fleet::Impl::dispensable(const Uav& uav) const {
  return uav.stalled_s &&
         std::ranges::any_of(uavs, [](const Uav& other) { return !other.retired() && !other.stalled_s; });
}

}  // namespace stairwell::explore
