/// Local avoidance of fellows on every tick (`--avoidance orca`).
#include "explore/fleet_impl.hpp"

namespace stairwell::explore {

using planning3d::SeenUav;

namespace {

constexpr double kAtLeast_s = 0.5;       // avoiding, once begun
constexpr double kMakeWayAfter_s = 3.0;  // then idle fellows are asked to leave
constexpr double kGiveUp_s = 15.0;       // then the goal is given up

}  // namespace

/// All look first and move then, as if at the same moment.
void Fleet::Impl::avoid() {
  std::vector<SeenUav> all;
  for (const Uav& uav : uavs) all.push_back(Avoider::seen(uav));
  for (Uav& uav : uavs) {
    const bool free_to_move =
        uav.phase == Phase::kTravel || uav.phase == Phase::kFindGoal || uav.phase == Phase::kReturn;
    if (!free_to_move || uav.lost_s) continue;
    std::vector<SeenUav> fellows = all;
    fellows.erase(fellows.begin() + static_cast<std::ptrdiff_t>(uav.id));
    if (!uav.avoiding && avoider.must_avoid(uav, fellows, now_s())) begin_avoiding(uav);
    if (uav.avoiding) avoid_fellows(uav, fellows);
  }
}

void Fleet::Impl::begin_avoiding(Uav& uav) {
  uav.avoiding = true;
  uav.avoiding_since_s = now_s();
  if (uav.phase == Phase::kTravel) log.on_event(now_s(), uav.id, "avoiding", "fellow_near");
}

void Fleet::Impl::avoid_fellows(Uav& uav, const std::vector<SeenUav>& fellows) {
  const bool travels = uav.phase == Phase::kTravel || uav.phase == Phase::kReturn;
  const auto wish = travels ? avoider.wish(uav.belief->space(), uav, fellows) : Wish{};
  const auto flown = avoider.segment(uav.belief->space(), uav, wish.value_or(Wish{}).velocity_mps, fellows, now_s());
  if (flown) {
    uav.on_segment = command(uav, *flown);
  } else if (!uav.on_segment) {
    command(uav, pilot.brake(uav, now_s()));
  }
  const double avoided_s = now_s() - uav.avoiding_since_s;
  const bool clear =
      avoided_s >= kAtLeast_s && wish && !wish->held && avoider.is_clear(uav, wish->velocity_mps, fellows);
  if (!travels) {
    uav.avoiding = false;  // looks again on the next tick
  } else if (avoided_s > kGiveUp_s) {
    if (uav.goal) uav.belief->strategy->report_failure(*uav.goal, now_s());
    log.on_event(now_s(), uav.id, "goal_failed", "fellows_in_the_way");
    uav.goal.reset();
    stop_avoiding(uav);
  } else if (clear || !wish || wish->arrived) {
    stop_avoiding(uav);
  } else if (avoided_s > kMakeWayAfter_s) {
    make_way(uav, uav.path_m);
  }
}

/// From here on by a new plan.
void Fleet::Impl::stop_avoiding(Uav& uav) {
  uav.avoiding = false;
  if (uav.phase != Phase::kReturn) enter(uav, Phase::kFindGoal);
}

}  // namespace stairwell::explore
