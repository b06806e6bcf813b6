#include "explore/avoider.hpp"

#include "core/units.hpp"
#include "planning3d/yaw_turn.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::explore {

using planning3d::FreeSpace;
using planning3d::PathFollower;
using planning3d::RightOfWay;
using planning3d::SeenUav;

namespace {

constexpr double kHorizon_s = 3.0;
constexpr double kLookStep_s = 0.1;
constexpr double kNear_m = 0.2;         // nearer than the clearance and this: avoid
constexpr double kClear_m = 0.5;        // farther than the clearance and this: clear again
constexpr double kReaction_s = 0.4;     // before both brake
constexpr double kTurnAbove_mps = 0.3;  // look where it flies
constexpr double kRounding_m = 0.02;    // two that hover side by side
constexpr double kArrived_m = 0.3;
constexpr double kYawShare = 0.95;  // of the limits

planning3d::OrcaConfig orca_config(const FleetConfig& config, double tick_s) {
  planning3d::OrcaConfig orca;
  orca.limits = config.limits;
  orca.margin_m = std::max(0.0, config.fellow_clearance_m - 2.0 * config.robot.radius_m);
  orca.period_s = tick_s;
  return orca;
}

}  // namespace

Avoider::Avoider(const FleetConfig& config, double tick_s)
    : limits_(config.limits),
      clearance_m_(config.fellow_clearance_m),
      radius_m_(config.robot.radius_m),
      orca_(orca_config(config, tick_s)) {}

SeenUav Avoider::seen(const Uav& uav) {
  const MotionState state = uav.vehicle->state();
  return {state.position_m, state.velocity_mps, uav.id};
}

bool Avoider::must_avoid(const Uav& uav, const std::vector<SeenUav>& fellows, double now_s) const {
  const SeenUav own = seen(uav);
  const double speed_mps = own.velocity_mps.norm();
  const double stop_m = 0.5 * speed_mps * speed_mps / orca_.acceleration_mps2() + kReaction_s * speed_mps;
  for (const SeenUav& fellow : fellows) {
    const Eigen::Vector3d to_m = fellow.position_m - own.position_m;
    const double distance_m = to_m.norm();
    // Each has its half of the gap to stop in, on a straight line.
    const double towards = own.velocity_mps.dot(to_m) / std::max(1e-9, speed_mps * distance_m);
    const double needed_m = towards > 0.0 ? kNear_m + 2.0 * towards * stop_m : 0.0;
    if (distance_m < clearance_m_ - kRounding_m + needed_m) return true;
    for (double t_s = kLookStep_s; t_s <= kHorizon_s; t_s += kLookStep_s) {
      const Eigen::Vector3d there_m = fellow.position_m + t_s * fellow.velocity_mps;
      const double apart_m = (uav.commanded().sample(now_s + t_s).position_m - there_m).norm();
      if (apart_m < std::min(distance_m, clearance_m_ + kNear_m)) return true;
    }
  }
  return false;
}

bool Avoider::is_clear(const Uav& uav, const Eigen::Vector3d& wish_mps, const std::vector<SeenUav>& fellows) const {
  const SeenUav own = seen(uav);
  return std::all_of(fellows.begin(), fellows.end(), [&](const SeenUav& fellow) {
    const double now_m = (own.position_m - fellow.position_m).norm();
    for (double t_s = kLookStep_s; t_s <= kHorizon_s; t_s += kLookStep_s) {
      const Eigen::Vector3d apart_m = own.position_m + t_s * wish_mps - fellow.position_m - t_s * fellow.velocity_mps;
      if (apart_m.norm() < std::min(now_m, clearance_m_ + kClear_m)) return false;
    }
    return true;
  });
}

std::optional<Wish> Avoider::wish(const FreeSpace& space, Uav& uav, const std::vector<SeenUav>& fellows) const {
  if (uav.path_m.empty()) return Wish{};
  const SeenUav own = seen(uav);
  if (!uav.follower) {
    uav.follower.emplace(uav.path_m, limits_, orca_.speed_mps());
    uav.follower->seek(own.position_m);
    const double abreast_m = 2.0 * radius_m_ + 2.0 * orca_.margin_m;
    uav.way.emplace(narrow_sections(space, *uav.follower, abreast_m), abreast_m);
  }
  uav.follower->update(own.position_m);
  const double stop_m = uav.way->stop_arc_m(*uav.follower, own, fellows, orca_);
  const auto velocity_mps = uav.follower->wish_mps(space, own.position_m, stop_m);
  if (!velocity_mps) return std::nullopt;
  const bool arrived = (uav.follower->goal_m() - own.position_m).norm() < kArrived_m;
  return Wish{*velocity_mps, std::isfinite(stop_m), arrived};
}

Trajectory Avoider::motion(const MotionState& from, const Eigen::Vector3d& velocity_mps, double now_s) const {
  const double period_s = orca_.period_s;
  const double speed_mps = velocity_mps.norm();
  const double brake_s = speed_mps / orca_.acceleration_mps2();
  const Eigen::Vector3d push_mps2 = (velocity_mps - from.velocity_mps) / period_s;
  const Eigen::Vector3d brake_mps2 = brake_s > 0.0 ? Eigen::Vector3d(-velocity_mps / brake_s) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d next_m = from.position_m + 0.5 * period_s * (from.velocity_mps + velocity_mps);
  const double rate = std::max(kYawShare * limits_.yaw_rate_radps, std::abs(from.yaw_rate_radps));
  const double yaw_acceleration = kYawShare * limits_.yaw_acceleration_radps2;
  const bool turns = velocity_mps.head<2>().norm() > kTurnAbove_mps;
  const double heading_rad = std::atan2(velocity_mps.y(), velocity_mps.x());
  const auto turn = turns ? planning3d::YawTurn::to_heading(from.yaw_rate_radps, wrap_angle(heading_rad - from.yaw_rad),
                                                            rate, yaw_acceleration)
                          : planning3d::YawTurn::stop(from.yaw_rate_radps, rate, yaw_acceleration);
  const double end_s = std::max(period_s + brake_s, turn.duration_s());
  std::vector<MotionState> states;
  for (double t_s = 0.0;; t_s += Trajectory::kStep_s) {
    MotionState state;
    if (t_s < period_s) {
      state.position_m = from.position_m + t_s * from.velocity_mps + 0.5 * t_s * t_s * push_mps2;
      state.velocity_mps = from.velocity_mps + t_s * push_mps2;
      state.acceleration_mps2 = push_mps2;
    } else {
      const double braked_s = std::min(t_s - period_s, brake_s);
      state.position_m = next_m + braked_s * velocity_mps + 0.5 * braked_s * braked_s * brake_mps2;
      state.velocity_mps = velocity_mps + braked_s * brake_mps2;
      if (braked_s < brake_s) state.acceleration_mps2 = brake_mps2;
    }
    const planning3d::YawTurn::State yaw = turn.at(t_s);
    state.yaw_rad = wrap_angle(from.yaw_rad + yaw.turned_rad);
    state.yaw_rate_radps = yaw.rate_radps;
    states.push_back(state);
    if (t_s >= end_s) break;
  }
  return {now_s, std::move(states)};
}

std::optional<Trajectory> Avoider::segment(const FreeSpace& space, const Uav& uav, const Eigen::Vector3d& wish_mps,
                                           const std::vector<SeenUav>& fellows, double now_s) const {
  const auto choice = planning3d::choose_velocity(space, orca_, seen(uav), wish_mps, fellows);
  if (choice.braking && choice.velocity_mps.norm() > 1e-6) return std::nullopt;
  Trajectory flown = motion(uav.vehicle->state(), choice.velocity_mps, now_s);
  if (!check_.check_space(space, flown, now_s).safe()) return std::nullopt;
  if (!check_.check_limits(flown, limits_, now_s).safe()) return std::nullopt;
  return flown;
}

void Avoider::remember_path(Uav& uav, std::vector<Eigen::Vector3d> path_m) const {
  uav.path_m = std::move(path_m);
  uav.follower.reset();
  uav.way.reset();
}

}  // namespace stairwell::explore
