#include "planning3d/trajectory_builder.hpp"

#include "core/units.hpp"
#include "planning3d/curve.hpp"
#include "planning3d/elastic_band.hpp"
#include "planning3d/jerk_limit.hpp"
#include "planning3d/speed_profile.hpp"
#include "planning3d/yaw_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::planning3d {

namespace {

// Asked for first, in voxels: rays that graze a surface within a voxel make it free, usually those that leave out half
// of it (an edge or a plane in its middle). Where that much does not fit, less, then none.
constexpr double kSpares_voxels[] = {0.5, 0.3};
constexpr double kYawShare = 0.98;
constexpr double kBandSpare_m = 0.02;  // around control points: between them corners come nearer
constexpr double kLeastTurn_m = 0.3;
constexpr double kSlow_mps = 0.05;   // below this the UAV stops (in a step or two) before it sets off
constexpr double kMaxReach_m = 1.5;  // of the rounding of a corner
constexpr double kJoinSlack = 1.01;  // for the differences of sampled states
constexpr double kLeastLeg_m = 0.05;
constexpr int kMaxTightenings = 16;
constexpr LimitShares kCautious{};
constexpr LimitShares kFirm{0.995, 0.985, 0.97};  // when the motion under way leaves no choice
// Less than planned with (the old speed is never exceeded anyway); the later ones where the curve bends sharply between
// two states.
constexpr LimitShares kBraking{0.98, 0.95, 0.85};
constexpr double kBrakingAccelerations[] = {0.95, 0.88, 0.75, 0.5};
constexpr double kBrakingAlong = 0.9;  // of the acceleration, when the rest is spent on giving way: ...
constexpr double kBrakingAside[] = {0.35, 0.25, 0.15};  // ... as much as the limits allow

using Path = std::vector<Eigen::Vector3d>;
using Ride = TrajectoryBuilder::Ride;

/// The rest of a path as seen from a point near it: from the nearest place on it plus `ahead_m`, to the end.
Path rest_of_path(const Path& path_m, const Eigen::Vector3d& from_m, double search_m, double ahead_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  double nearest_arc_m = 0.0;
  double arc_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_m.size() && arc_m <= search_m; ++i) {
    const Eigen::Vector3d leg_m = path_m[i + 1] - path_m[i];
    const double u = std::clamp((from_m - path_m[i]).dot(leg_m) / leg_m.squaredNorm(), 0.0, 1.0);
    const double away_m = (path_m[i] + u * leg_m - from_m).norm();
    if (away_m < nearest_m - 1e-9) {
      nearest_m = away_m;
      nearest_arc_m = arc_m + u * leg_m.norm();
    }
    arc_m += leg_m.norm();
  }
  const double wanted_m = nearest_arc_m + ahead_m;
  Path rest_m;
  arc_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    const Eigen::Vector3d leg_m = path_m[i + 1] - path_m[i];
    const double end_m = arc_m + leg_m.norm();
    if (rest_m.empty() && end_m > wanted_m) rest_m.push_back(path_m[i] + (wanted_m - arc_m) / leg_m.norm() * leg_m);
    if (!rest_m.empty()) rest_m.push_back(path_m[i + 1]);
    arc_m = end_m;
  }
  if (rest_m.empty()) rest_m.push_back(path_m.back());
  return rest_m;
}

/// Corners a few millimetres from the start would ask for turns within millimetres.
void drop_corners_near_start(Path& way_m, std::size_t first) {
  const auto from = way_m.begin() + static_cast<std::ptrdiff_t>(first);
  while (from + 1 < way_m.end() - 1 && (*(from + 1) - *from).norm() < kLeastLeg_m) way_m.erase(from + 1);
}

/// `shape` (an ElasticBand or a RoundedPath) behind the lead-in, given way where it does not fit; nullopt where it has
/// no more way to give.
template <typename Shape, typename GiveWay>
std::optional<Curve> fitted(const FreeSpace& space, const SafetyCheck& check, const Curve& lead_in, Shape& shape,
                            const GiveWay& give_way) {
  for (int attempt = 0; attempt < kMaxTightenings; ++attempt) {
    Curve curve = lead_in;
    curve.append(shape.curve());
    const SafetyReport report = check.check_path(space, curve.point_m);
    if (report.safe()) return curve;
    if (!give_way(shape, report.at_m)) return std::nullopt;
  }
  return std::nullopt;
}

/// A free curve along the polyline: an elastic band; where that finds none, the polyline rounded as widely as the space
/// allows; nullopt where even tight corners do not fit.
std::optional<Curve> free_curve(const FreeSpace& space, const SafetyCheck& check, const MotionLimits& limits,
                                const Path& corners_m, const Curve& lead_in) {
  const Path polyline_m = without_repeats(corners_m);
  if (polyline_m.size() < 2) return std::nullopt;
  if (polyline_m.size() > 2) {
    const double radius_m = space.robot().radius_m + check.config().spare_m + kBandSpare_m;
    const double turn_m = limits.speed_mps * limits.speed_mps / limits.acceleration_mps2;
    ElasticBand band(space, polyline_m, radius_m, std::max(turn_m, kLeastTurn_m), lead_in.size() > 0);
    auto curve = fitted(space, check, lead_in, band,
                        [](ElasticBand& shape, const Eigen::Vector3d& at_m) { return shape.loosen_near(at_m); });
    if (curve) return curve;
  }
  RoundedPath rounded(polyline_m, kMaxReach_m);
  return fitted(space, check, lead_in, rounded,
                [](RoundedPath& shape, const Eigen::Vector3d& at_m) { return shape.tighten_near(at_m); });
}

/// @param start at rest, or with the acceleration that it has been flown with
std::optional<Ride> ride_along(const Curve& curve, const MotionLimits& limits, const MotionState& start) {
  const double start_mps = start.velocity_mps.norm();
  if (limits.limits_jerk()) {
    const double start_mps2 = start_mps > 0.0 ? start.acceleration_mps2.dot(start.velocity_mps) / start_mps : 0.0;
    auto states = jerk_limited_states(curve, limits, start_mps, start_mps2, kCautious);
    if (!states) return std::nullopt;
    states->front().position_m = start.position_m;
    states->front().velocity_mps = start.velocity_mps;
    return Ride{std::move(*states)};
  }
  auto speeds = squared_speeds(curve, limits, start_mps, kCautious);
  if (!speeds && start_mps > 0.0) speeds = squared_speeds(curve, limits, start_mps, kFirm);
  if (!speeds) return std::nullopt;
  Ride ride{timed_states(curve, *speeds, limits)};
  ride.states.front().position_m = start.position_m;
  ride.states.front().velocity_mps = start.velocity_mps;
  return ride;
}

/// Lookaheads at which a motion from rest beside the path is led on to it, best first.
std::vector<Path> ways_from_rest(const Path& path_m, const Eigen::Vector3d& from_m) {
  std::vector<Path> ways;
  for (const double ahead_m : {0.0, 0.3, 0.8}) {
    Path way_m = rest_of_path(path_m, from_m, 2.0, ahead_m);
    way_m.insert(way_m.begin(), from_m);
    drop_corners_near_start(way_m, 0);
    ways.push_back(std::move(way_m));
    if (ahead_m == 0.0 && (ways.front()[1] - from_m).norm() < 0.02) break;  // on the path
  }
  std::reverse(ways.begin(), ways.end());
  return ways;
}

void join_at_rest(Ride& ride, const Ride& next) {
  if (!ride.states.empty()) ride.states.pop_back();
  ride.states.insert(ride.states.end(), next.states.begin(), next.states.end());
}

/// Straight legs with a stop at every corner: fits wherever the path itself does.
std::optional<Ride> stop_and_go(const FreeSpace& space, const SafetyCheck& check, const MotionLimits& limits,
                                const Path& way_m) {
  Ride whole;
  const Path corners_m = without_repeats(way_m);
  for (std::size_t i = 0; i + 1 < corners_m.size(); ++i) {
    const auto curve = free_curve(space, check, limits, {corners_m[i], corners_m[i + 1]}, {});
    if (!curve) return std::nullopt;
    MotionState start;
    start.position_m = corners_m[i];
    const auto leg = ride_along(*curve, limits, start);
    if (!leg) return std::nullopt;
    join_at_rest(whole, *leg);
  }
  if (whole.states.empty()) return std::nullopt;
  return whole;
}

/// @param stops at every corner
std::vector<Ride> rides_from_rest(const FreeSpace& space, const SafetyCheck& check, const MotionLimits& limits,
                                  const Path& path_m, const Eigen::Vector3d& from_m, bool stops) {
  MotionState start;
  start.position_m = from_m;
  if ((path_m.back() - from_m).norm() < 1e-3 && path_m.size() <= 2) return {Ride{{start}}};
  const std::vector<Path> ways = ways_from_rest(path_m, from_m);
  std::vector<Ride> rides;
  for (const Path& way_m : ways) {
    std::optional<Ride> ride;
    if (stops) {
      ride = stop_and_go(space, check, limits, way_m);
    } else if (const auto curve = free_curve(space, check, limits, way_m, {})) {
      ride = ride_along(*curve, limits, start);
    }
    if (ride) rides.push_back(std::move(*ride));
  }
  return rides;
}

/// Candidates that keep moving: the old curve for a while, on along its tangent, then over to the path.
std::vector<Ride> moving_rides(const FreeSpace& space, const SafetyCheck& check, const MotionLimits& limits,
                               const Path& path_m, const MotionState& start, const FlownCurve& flown,
                               double stopping_m) {
  std::vector<Ride> rides;
  for (const double part : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const Curve lead_in = cut(flown.curve, std::max(1e-9, part * stopping_m));
    const Eigen::Vector3d from_m = lead_in.point_m.back();
    const Eigen::Vector3d along = lead_in.tangent.back();
    for (const double reach : {0.5, 1.5}) {
      const double ahead_m = 0.2 + reach * stopping_m;
      Path way_m = rest_of_path(path_m, from_m, stopping_m + 2.0, 2.0 * ahead_m);
      const double straight_m = std::min(0.6 * ahead_m, 0.5 * (way_m.front() - from_m).norm());
      if (straight_m < kLeastLeg_m) continue;
      way_m.insert(way_m.begin(), {from_m, from_m + straight_m * along});
      drop_corners_near_start(way_m, 1);
      const auto curve = free_curve(space, check, limits, way_m, lead_in);
      if (!curve) continue;
      if (auto ride = ride_along(*curve, limits, start)) rides.push_back(std::move(*ride));
    }
  }
  return rides;
}

/// Back over where the brakes were applied to the departure, then along the path.
Path way_back(const Ride& braked, const Path& path_m) {
  Path way_m{braked.states.back().position_m};
  std::for_each(braked.states.rbegin(), braked.states.rend(), [&way_m](const MotionState& state) {
    if ((state.position_m - way_m.back()).norm() > kLeastLeg_m) way_m.push_back(state.position_m);
  });
  way_m.push_back(braked.states.front().position_m);
  way_m.insert(way_m.end(), path_m.begin(), path_m.end());
  return without_repeats(way_m);
}

bool usable(const TrajectoryRequest& request) {
  if (request.previous == nullptr || request.previous->empty() || request.path_m.empty()) return false;
  if (!std::isfinite(request.depart_s) || !std::isfinite(request.goal_yaw_rad)) return false;
  return std::all_of(request.path_m.begin(), request.path_m.end(),
                     [](const Eigen::Vector3d& p) { return p.array().isFinite().all(); });
}

/// Straight on to rest: for speeds that take less than a millimetre to lose.
Ride short_stop(const MotionState& start, const MotionLimits& limits) {
  Ride ride{{start}};
  const double speed_mps = start.velocity_mps.norm();
  const Eigen::Vector3d along = start.velocity_mps.normalized();
  double brake = kFirm.acceleration * limits.acceleration_mps2;
  if (limits.norm == MotionLimits::Norm::kPerAxis) brake /= along.cwiseAbs().maxCoeff();
  ride.states.front().acceleration_mps2 = -brake * along;
  const double duration_s = speed_mps / brake;
  while (Trajectory::kStep_s * static_cast<double>(ride.states.size()) < duration_s) {
    const double time_s = Trajectory::kStep_s * static_cast<double>(ride.states.size());
    MotionState state = ride.states.front();
    state.position_m += (speed_mps - 0.5 * brake * time_s) * time_s * along;
    state.velocity_mps = (speed_mps - brake * time_s) * along;
    ride.states.push_back(state);
  }
  MotionState rest;
  rest.position_m = start.position_m + 0.5 * speed_mps * duration_s * along;
  ride.states.push_back(rest);
  return ride;
}

/// Brakes on the curve being flown; a single state at rest when it is not moving.
Ride braking_ride(const Trajectory& flying, double depart_s, const MotionLimits& limits) {
  const MotionState start = flying.sample(depart_s);
  const FlownCurve flown = flown_curve(flying, depart_s);
  Ride ride;
  for (const double acceleration : kBrakingAccelerations) {
    const FlownCurve stop = hardest_stop(flown, limits, {kBraking.speed, acceleration, kBraking.bend});
    if (stop.curve.size() < 2) {
      MotionState rest;
      rest.position_m = start.position_m;
      return start.velocity_mps.isZero(0.0) ? Ride{{rest}} : short_stop(start, limits);
    }
    ride.states = timed_states(stop.curve, stop.squared_speed, limits);
    ride.states.front().position_m = start.position_m;
    ride.states.front().velocity_mps = start.velocity_mps;
    if (SafetyCheck{}.check_limits(Trajectory(depart_s, ride.states), limits, depart_s).safe()) break;
  }
  return ride;
}

/// The present state; its acceleration is that of the last step, which the next one must not differ from by a jerk.
MotionState state_flown(const Trajectory& flying, double time_s) {
  MotionState state = flying.sample(time_s);
  const Eigen::Vector3d before_mps = flying.sample(time_s - Trajectory::kStep_s).velocity_mps;
  state.acceleration_mps2 = (state.velocity_mps - before_mps) / Trajectory::kStep_s;
  return state;
}

/// Comes to rest on the curve being flown within the limit of jerk, early if that can be done, else as it was planned.
Ride gentle_stop(const Trajectory& flying, double depart_s, const MotionLimits& limits) {
  const MotionState start = state_flown(flying, depart_s);
  const FlownCurve flown = flown_curve(flying, depart_s);
  const double speed_mps = start.velocity_mps.norm();
  const double braking_m =
      speed_mps * (speed_mps / limits.acceleration_mps2 + limits.acceleration_mps2 / limits.jerk_mps3);
  for (const double share : {1.0, 1.5, 2.5}) {
    if (share * braking_m >= flown.curve.length_m() || speed_mps <= kSlow_mps) break;
    if (auto ride = ride_along(cut(flown.curve, share * braking_m), limits, start)) return std::move(*ride);
  }
  Ride rest;
  for (std::size_t i = 0;; ++i) {
    const double time_s = depart_s + Trajectory::kStep_s * static_cast<double>(i);
    rest.states.push_back(flying.sample(time_s));
    if (time_s >= flying.end_time_s()) return rest;
  }
}

/// Whether the step into a ride changes the acceleration no faster than the limit of jerk, which a bend that begins or
/// ends at the departure would.
bool joins_gently(const MotionState& start, const Ride& ride, const MotionLimits& limits) {
  if (!limits.limits_jerk() || ride.states.size() < 2) return true;
  const double step_s = Trajectory::kStep_s;
  const Eigen::Vector3d acceleration_mps2 = (ride.states[1].velocity_mps - start.velocity_mps) / step_s;
  const Eigen::Vector3d jerk_mps3 = (acceleration_mps2 - start.acceleration_mps2) / step_s;
  return limits.size_of(jerk_mps3) <= kJoinSlack * limits.jerk_mps3;
}

}  // namespace

std::optional<Trajectory> TrajectoryBuilder::build(const FreeSpace& space, const TrajectoryRequest& request) const {
  if (!usable(request)) return std::nullopt;
  for (const double spare_voxels : kSpares_voxels) {
    SafetyCheck::Config roomy = check_.config();
    roomy.spare_m += spare_voxels * space.grid().resolution_m();
    if (auto trajectory = build_checked(space, request, SafetyCheck(roomy), false)) return trajectory;
  }
  if (auto trajectory = build_checked(space, request, check_, false)) return trajectory;
  return build_checked(space, request, check_, true);
}

std::optional<Trajectory> TrajectoryBuilder::build_checked(const FreeSpace& space, const TrajectoryRequest& request,
                                                           const SafetyCheck& check, bool stops) const {
  const MotionState start = state_flown(*request.previous, request.depart_s);
  Path path_m = without_repeats(request.path_m);
  if (path_m.size() == 1) path_m.insert(path_m.begin(), start.position_m);
  path_m = without_repeats(path_m);

  std::vector<Ride> rides;
  if (start.velocity_mps.norm() > kSlow_mps && !stops) {
    const FlownCurve flown = flown_curve(*request.previous, request.depart_s);
    const FlownCurve stop = hardest_stop(flown, limits_, kBraking);
    if (stop.curve.size() > 1) {
      double stopping_m = stop.curve.length_m();
      if (limits_.limits_jerk()) {
        stopping_m += start.velocity_mps.norm() * limits_.acceleration_mps2 / limits_.jerk_mps3;
      }
      rides = moving_rides(space, check, limits_, path_m, start, flown, stopping_m);
    }
  }
  const Ride braked = limits_.limits_jerk() ? gentle_stop(*request.previous, request.depart_s, limits_)
                                            : braking_ride(*request.previous, request.depart_s, limits_);
  const Eigen::Vector3d stopped_m = braked.states.back().position_m;
  auto after = rides_from_rest(space, check, limits_, path_m, stopped_m, stops);
  if (after.empty()) after = rides_from_rest(space, check, limits_, way_back(braked, path_m), stopped_m, stops);
  for (const Ride& next : after) {
    rides.push_back(braked);
    join_at_rest(rides.back(), next);
  }
  return quickest_safe(space, request, check, path_m.back(), std::move(rides));
}

std::optional<Trajectory> TrajectoryBuilder::quickest_safe(const FreeSpace& space, const TrajectoryRequest& request,
                                                           const SafetyCheck& check, const Eigen::Vector3d& goal_m,
                                                           std::vector<Ride> rides) const {
  std::stable_sort(rides.begin(), rides.end(),
                   [](const Ride& a, const Ride& b) { return a.states.size() < b.states.size(); });
  const MotionState start = state_flown(*request.previous, request.depart_s);
  const YawPlan yaw(limits_, start.yaw_rad, start.yaw_rate_radps);
  for (Ride& ride : rides) {
    if (!joins_gently(start, ride, limits_)) continue;
    if (ride.states.size() > 1) ride.states.back().position_m = goal_m;
    if (request.look_along_path) {
      yaw.look_along(ride.states, request.goal_yaw_rad);
    } else {
      yaw.turn(ride.states, request.goal_yaw_rad);
    }
    Trajectory trajectory(request.depart_s, std::move(ride.states));
    if (!check.check_limits(trajectory, limits_, request.depart_s).safe()) continue;
    if (!check.check_space(space, trajectory, request.depart_s).safe()) continue;
    return trajectory;
  }
  return std::nullopt;
}

Trajectory TrajectoryBuilder::brake(const Trajectory& flying, double depart_s) const {
  return without_turning_on(flying, depart_s, braking_ride(flying, depart_s, limits_));
}

// Half of the time the way aside gets faster, half of it slower; where the course bends that way, less of it is left.
Trajectory TrajectoryBuilder::brake_aside(const Trajectory& flying, double depart_s,
                                          const Eigen::Vector3d& aside) const {
  MotionLimits along = limits_;
  along.acceleration_mps2 *= kBrakingAlong;
  const Ride braking = braking_ride(flying, depart_s, along);
  const double end_s = Trajectory::kStep_s * static_cast<double>(braking.states.size() - 1);
  for (const double share : kBrakingAside) {
    const double acceleration = share * limits_.acceleration_mps2;
    Ride ride = braking;
    for (std::size_t i = 0; i < ride.states.size(); ++i) {
      const double time_s = Trajectory::kStep_s * static_cast<double>(i);
      const double left_s = end_s - time_s;
      const bool faster = time_s < left_s;
      const double way_m = 0.5 * acceleration * (faster ? time_s * time_s : 0.5 * end_s * end_s - left_s * left_s);
      ride.states[i].position_m += way_m * aside;
      ride.states[i].velocity_mps += acceleration * std::min(time_s, left_s) * aside;
      if (left_s > 0.0) ride.states[i].acceleration_mps2 += (faster ? acceleration : -acceleration) * aside;
    }
    const bool stored = std::all_of(ride.states.begin(), ride.states.end(), [this](const MotionState& state) {
      return limits_.size_of(state.acceleration_mps2) <= limits_.acceleration_mps2;
    });
    if (stored && SafetyCheck{}.check_limits(Trajectory(depart_s, ride.states), limits_, depart_s).safe())
      return without_turning_on(flying, depart_s, std::move(ride));
  }
  return brake(flying, depart_s);
}

Trajectory TrajectoryBuilder::without_turning_on(const Trajectory& flying, double depart_s, Ride ride) const {
  const MotionState start = flying.sample(depart_s);
  const YawTurn stop =
      YawTurn::stop(start.yaw_rate_radps, limits_.yaw_rate_radps, kYawShare * limits_.yaw_acceleration_radps2);
  YawPlan(limits_, start.yaw_rad, start.yaw_rate_radps)
      .turn(ride.states, start.yaw_rad + stop.at(stop.duration_s()).turned_rad);
  return {depart_s, std::move(ride.states)};
}

Trajectory TrajectoryBuilder::rotate(double depart_s, const Eigen::Vector3d& position_m, double yaw_rad,
                                     double turn_rad, double rate_radps) const {
  const YawTurn turn(0.0, turn_rad, kYawShare * std::min(std::abs(rate_radps), limits_.yaw_rate_radps),
                     kYawShare * limits_.yaw_acceleration_radps2);
  const auto steps = static_cast<std::size_t>(std::ceil(turn.duration_s() / Trajectory::kStep_s - 1e-9));
  std::vector<MotionState> states(steps + 1);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const YawTurn::State yaw = turn.at(Trajectory::kStep_s * static_cast<double>(i));
    states[i].position_m = position_m;
    states[i].yaw_rad = wrap_angle(yaw_rad + yaw.turned_rad);
    states[i].yaw_rate_radps = yaw.rate_radps;
  }
  return {depart_s, std::move(states)};
}

Trajectory TrajectoryBuilder::step_along(double depart_s, double yaw_rad, const std::vector<Eigen::Vector3d>& path_m,
                                         double goal_yaw_rad, double delta_m, double period_s) {
  const Path way_m = without_repeats(path_m);
  double length_m = 0.0;
  for (std::size_t i = 0; i + 1 < way_m.size(); ++i) length_m += (way_m[i + 1] - way_m[i]).norm();
  const double speed_mps = delta_m / period_s;
  const double duration_s = std::max(length_m / speed_mps, period_s);
  const double turn_rad = wrap_angle(goal_yaw_rad - yaw_rad);
  const auto steps = static_cast<std::size_t>(std::ceil(duration_s / Trajectory::kStep_s - 1e-9));
  std::vector<MotionState> states(steps + 1);
  std::size_t leg = 0;
  double leg_start_m = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double time_s = Trajectory::kStep_s * static_cast<double>(i);
    const double arc_m = std::min(length_m, speed_mps * time_s);
    while (leg + 2 < way_m.size() && arc_m > leg_start_m + (way_m[leg + 1] - way_m[leg]).norm()) {
      leg_start_m += (way_m[leg + 1] - way_m[leg]).norm();
      ++leg;
    }
    states[i].position_m = way_m.empty() ? Eigen::Vector3d::Zero().eval() : way_m[leg];
    if (way_m.size() > 1) {
      const Eigen::Vector3d along = (way_m[leg + 1] - way_m[leg]).normalized();
      states[i].position_m += (arc_m - leg_start_m) * along;
      if (arc_m < length_m) states[i].velocity_mps = speed_mps * along;
    }
    states[i].yaw_rad = wrap_angle(yaw_rad + std::min(1.0, time_s / duration_s) * turn_rad);
    if (i + 1 < states.size()) states[i].yaw_rate_radps = turn_rad / duration_s;
  }
  if (!way_m.empty()) states.back().position_m = way_m.back();
  states.back().velocity_mps.setZero();
  states.back().yaw_rad = wrap_angle(goal_yaw_rad);
  return {depart_s, std::move(states)};
}

}  // namespace stairwell::planning3d
