#include "explore/pilot.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "planning3d/shorten_path.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::explore {

using planning3d::FreeSpace;
using planning3d::KeepOut;
using planning3d::PlanRequest;
using planning3d::PlanVerdict;

namespace {

// Planned a little wider than the check asks for, so that the smoothed curve still passes it.
constexpr double kKeepOutMargin_m = 0.1;
// Fellows this far along their motion are met where they will be, later ones where they will end.
constexpr double kTubeHorizon_s = 4.0;
constexpr double kTubeStep_s = 0.25;
// In large maps long searches are led by what regions hang together; where a goal is closed off, one would look at all
// that is known, and gives up before that.
constexpr std::size_t kLargeMap = 4'000'000;  // voxels
constexpr std::size_t kMostExpansions = 50'000;
constexpr double kLeastRest_m = 2.0;                // of a path; what is shorter is flown at once
constexpr int kSides = 8;                           // to which it may give way
constexpr std::string_view kLikeRequest = "astar";  // whose answers depend on the request alone

planning3d::SafetyCheck make_check(const FleetConfig& config) {
  planning3d::SafetyCheck::Config check;
  check.fellow_clearance_m = config.fellow_clearance_m;
  return planning3d::SafetyCheck(check);
}

planning3d::FallbackPlanner make_planners(const FleetConfig& config, const planning3d::SafetyCheck& check) {
  planning3d::PlannerOptions options = config.planner_options;
  options.led_from = kLargeMap;
  auto primary = config.own_planner ? config.own_planner() : planning3d::make_planner(config.planner, options);
  if (primary == nullptr) throw InputError("own_planner made no planner");
  std::vector<std::unique_ptr<planning3d::Planner>> fallbacks;
  const std::string_view fallback = planning3d::resolve_fallback(
      config.fallback, config.own_planner ? primary->name() : std::string_view(config.planner));
  if (!fallback.empty()) fallbacks.push_back(planning3d::make_planner(fallback, options));
  return planning3d::FallbackPlanner(std::move(primary), std::move(fallbacks), check);
}

/// Another one for each time, so that an unlucky draw is not drawn again; the same one in a resumed run.
std::uint64_t plan_seed(const FleetConfig& config, double depart_s) {
  return config.seed + 1'000'003 * static_cast<std::uint64_t>(std::max(0.0, 1e3 * depart_s));
}

std::vector<const Trajectory*> motions_of(const std::vector<const Uav*>& fellows) {
  std::vector<const Trajectory*> motions;
  motions.reserve(fellows.size());
  for (const Uav* fellow : fellows) motions.push_back(&fellow->commanded());
  return motions;
}

// Straight from rest to rest with the trapezoidal (or triangular) speed profile. Not checked: a UAV that stands on the
// ground touches it.
Trajectory lift(const MotionLimits& limits, double depart_s, const MotionState& from, const Eigen::Vector3d& to_m) {
  const double length_m = (to_m - from.position_m).norm();
  if (length_m < 1e-6) return Trajectory::hover(depart_s, from.position_m, from.yaw_rad);
  const Eigen::Vector3d direction = (to_m - from.position_m) / length_m;
  const double a = 0.95 * limits.acceleration_mps2;
  const double v = std::min(0.95 * limits.speed_mps, std::sqrt(length_m * a));
  const double ramp_s = v / a;
  const double cruise_s = (length_m - v * ramp_s) / v;
  const double total_s = 2.0 * ramp_s + cruise_s;
  std::vector<MotionState> states;
  for (double t_s = 0.0;; t_s += Trajectory::kStep_s) {
    const double left_s = std::max(0.0, total_s - t_s);
    MotionState state;
    double along_m = 0.0;
    double speed_mps = v;
    if (t_s < ramp_s) {
      along_m = 0.5 * a * t_s * t_s;
      speed_mps = a * t_s;
      state.acceleration_mps2 = a * direction;
    } else if (left_s < ramp_s) {
      along_m = length_m - 0.5 * a * left_s * left_s;
      speed_mps = a * left_s;
      state.acceleration_mps2 = -a * direction;
    } else {
      along_m = 0.5 * v * ramp_s + v * (t_s - ramp_s);
    }
    state.position_m = from.position_m + along_m * direction;
    state.velocity_mps = speed_mps * direction;
    state.yaw_rad = from.yaw_rad;
    states.push_back(state);
    if (left_s <= 0.0) break;
  }
  states.back().acceleration_mps2.setZero();
  return {depart_s, std::move(states)};
}

/// The first metres of a longer path.
std::vector<Eigen::Vector3d> beginning(const std::vector<Eigen::Vector3d>& path_m, double length_m) {
  std::vector<Eigen::Vector3d> begun_m{path_m.front()};
  for (std::size_t i = 1; i < path_m.size(); ++i) {
    const Eigen::Vector3d leg_m = path_m[i] - path_m[i - 1];
    if (leg_m.norm() >= length_m) {
      begun_m.push_back(path_m[i - 1] + length_m * leg_m.normalized());
      break;
    }
    length_m -= leg_m.norm();
    begun_m.push_back(path_m[i]);
  }
  return begun_m;
}

/// At the end of a path; none where it leads straight up or down.
std::optional<double> heading(const std::vector<Eigen::Vector3d>& path_m) {
  const Eigen::Vector3d leg_m = path_m.back() - path_m[path_m.size() - 2];
  if (leg_m.head<2>().norm() < 1e-3) return std::nullopt;
  return std::atan2(leg_m.y(), leg_m.x());
}

}  // namespace

Pilot::Pilot(const FleetConfig& config) : config_(config), check_(make_check(config)), builder_(config.limits, check_) {
  const bool alike = !config.own_planner && config.planner == kLikeRequest;
  for (int i = 0; i < (alike ? config.threads : 1); ++i) planners_.push_back(make_planners(config, check_));
}

std::vector<KeepOut> Pilot::keep_outs(const std::vector<const Uav*>& fellows, const Eigen::Vector3d& start_m,
                                      double depart_s) const {
  const double radius_m = config_.fellow_clearance_m + kKeepOutMargin_m;
  std::vector<KeepOut> spheres;
  const auto add = [&](const Eigen::Vector3d& center_m) {
    // A UAV that is already near a fellow may always move away from it; the space-time check decides.
    if ((center_m - start_m).norm() > radius_m) spheres.push_back({center_m, radius_m});
  };
  for (const Uav* fellow : fellows) {
    const Trajectory& motion = fellow->commanded();
    add(motion.states().back().position_m);
    for (double t_s = depart_s; t_s < std::min(motion.end_time_s(), depart_s + kTubeHorizon_s); t_s += kTubeStep_s) {
      add(motion.sample(t_s).position_m);
    }
  }
  return spheres;
}

std::optional<Trajectory> Pilot::shape(const FreeSpace& space, const Uav& uav,
                                       const std::vector<Eigen::Vector3d>& path_m, double yaw_rad,
                                       double depart_s) const {
  if (config_.motion == MotionModel::kStep) {
    const MotionState from = uav.commanded().sample(depart_s);
    Trajectory steps = planning3d::TrajectoryBuilder::step_along(depart_s, from.yaw_rad, path_m, yaw_rad,
                                                                 config_.step_delta_m, config_.step_period_s);
    if (!check_.check_space(space, steps, depart_s).safe()) return std::nullopt;
    return steps;
  }
  planning3d::TrajectoryRequest request;
  request.previous = &uav.commanded();
  request.depart_s = depart_s;
  request.path_m = path_m;
  const bool panoramic = uav.sensor->model().panoramic();  // sees the same whatever its yaw
  request.goal_yaw_rad = panoramic ? uav.commanded().sample(depart_s).yaw_rad : yaw_rad;
  request.look_along_path = !panoramic;
  return builder_.build(space, request);
}

PlanVerdict Pilot::shape_along(const FreeSpace& space, const Uav& uav, const std::vector<Eigen::Vector3d>& path_m,
                               double yaw_rad, double depart_s, FlightDraft& draft) const {
  draft.part_way = planning3d::path_length_m(path_m) > draft.horizon_m + kLeastRest_m;
  if (draft.part_way) {
    const std::vector<Eigen::Vector3d> begun_m = beginning(path_m, draft.horizon_m);
    draft.motion = shape(space, uav, begun_m, heading(begun_m).value_or(yaw_rad), depart_s);
  } else {
    draft.motion = shape(space, uav, path_m, yaw_rad, depart_s);
  }
  draft.path_m = path_m;
  if (!draft.motion) return {PlanVerdict::Kind::kTryNext, "no trajectory"};
  return {};
}

FlightDraft Pilot::draft(const FreeSpace& space, const Uav& uav, const Eigen::Vector3d& position_m, double yaw_rad,
                         const planning3d::MotionRule& rule, double depart_s, double horizon_m, int thread) {
  FlightDraft draft;
  draft.thread = thread;
  draft.horizon_m = config_.motion == MotionModel::kStep ? kAllTheWay_m : horizon_m;
  draft.request.start_m = uav.commanded().sample(depart_s).position_m;
  draft.request.goal_m = position_m;
  draft.request.rule = rule;
  draft.request.seed = plan_seed(config_, depart_s);
  if (space.grid().voxel_count() >= kLargeMap) draft.request.max_expansions = kMostExpansions;
  const auto judge = [&](const planning3d::PlanResult& plan, std::string_view /*planner*/) -> PlanVerdict {
    return shape_along(space, uav, plan.path_m, yaw_rad, depart_s, draft);
  };
  draft.found = planners_[static_cast<std::size_t>(thread)].decide(space, draft.request, judge);
  return draft;
}

FlightResult Pilot::fly(const FreeSpace& space, const Uav& uav, double yaw_rad, FlightDraft draft,
                        const std::vector<const Uav*>& fellows, double depart_s) {
  // Reciprocal avoidance meets fellows when they are near, not in plans.
  const bool plans_meet = config_.avoidance == Avoidance::kPriority;
  const auto motions = plans_meet ? motions_of(fellows) : std::vector<const Trajectory*>{};
  FlightResult result;
  const auto flying = [&](const planning3d::FallbackResult& found) {
    result.outcome = FlightOutcome::kFlying;
    result.trajectory = std::move(draft.motion);
    result.path_m = std::move(draft.path_m);
    result.part_way = draft.part_way;
    result.planner = found.planner();
    result.fell_back = found.fell_back();
    result.wanted_path_m.clear();
  };
  // First as if fellows' way points did not matter; then round where they are and will be.
  result.not_used = draft.found.reason();
  result.path_m = draft.path_m;
  if (draft.found.hover()) return result;  // fellows are not the reason
  if (check_.check_fellows(*draft.motion, motions, depart_s).safe()) {
    flying(draft.found);
    return result;
  }
  result.outcome = FlightOutcome::kFellowInTheWay;
  result.wanted_path_m = draft.path_m;
  draft.request.keep_out = keep_outs(fellows, draft.request.start_m, depart_s);
  const auto judge = [&](const planning3d::PlanResult& plan, std::string_view /*planner*/) -> PlanVerdict {
    const PlanVerdict shaped = shape_along(space, uav, plan.path_m, yaw_rad, depart_s, draft);
    if (shaped.kind != PlanVerdict::Kind::kUse) return shaped;
    if (check_.check_fellows(*draft.motion, motions, depart_s).safe()) return {};
    return {PlanVerdict::Kind::kStop, "fellow in the way"};  // another planner would meet the same one
  };
  const planning3d::FallbackResult found =
      planners_[static_cast<std::size_t>(draft.thread)].decide(space, draft.request, judge);
  result.not_used = found.reason();
  result.path_m = draft.path_m;
  if (!found.hover()) flying(found);
  return result;
}

std::optional<Trajectory> Pilot::vertical(const FreeSpace& space, const Uav& uav, double to_z_m, double depart_s,
                                          bool checked) const {
  const MotionState from = uav.commanded().sample(depart_s);
  Eigen::Vector3d to_m = from.position_m;
  to_m.z() = to_z_m;
  if (config_.motion == MotionModel::kStep) {
    return planning3d::TrajectoryBuilder::step_along(depart_s, from.yaw_rad, {from.position_m, to_m}, from.yaw_rad,
                                                     config_.step_delta_m, config_.step_period_s);
  }
  if (checked) {
    return shape(space, uav, {from.position_m, to_m}, from.yaw_rad, depart_s);
  }
  return lift(config_.limits, depart_s, from, to_m);
}

Trajectory Pilot::rotate(const Uav& uav, double turn_rad, double depart_s) const {
  const MotionState from = uav.commanded().sample(depart_s);
  return builder_.rotate(depart_s, from.position_m, from.yaw_rad, turn_rad, config_.radial_scan_radps);
}

Trajectory Pilot::brake(const Uav& uav, double depart_s) const {
  if (config_.motion == MotionModel::kStep) {
    const MotionState from = uav.commanded().sample(depart_s);
    return Trajectory::hover(depart_s, from.position_m, from.yaw_rad);
  }
  return builder_.brake(uav.commanded(), depart_s);
}

Trajectory Pilot::brake_clear(const FreeSpace& space, const Uav& uav, const std::vector<const Uav*>& fellows,
                              bool level, double depart_s) const {
  const Trajectory straight = brake(uav, depart_s);
  const Eigen::Vector3d velocity_mps = uav.commanded().sample(depart_s).velocity_mps;
  if (config_.motion == MotionModel::kStep || velocity_mps.isZero(1e-3) || is_safe(space, straight, depart_s))
    return straight;
  Eigen::Vector3d side = velocity_mps.cross(Eigen::Vector3d::UnitZ());
  if (side.norm() < 1e-3 * velocity_mps.norm()) side = Eigen::Vector3d::UnitX();  // straight up or down
  side.normalize();
  const Eigen::Vector3d up = side.cross(velocity_mps).normalized();
  const auto room_m = [&](const Trajectory& motion) {  // the least that is left from half-way on
    const double half_s = 0.5 * (motion.end_time_s() - depart_s);
    double least_m = std::numeric_limits<double>::infinity();
    for (double part = 0.0; part <= 1.0; part += 0.125)
      least_m = std::min(least_m, space.room_m(motion.sample(depart_s + (1.0 + part) * half_s).position_m));
    return least_m;
  };
  Trajectory best = straight;
  bool best_is_safe = false;
  double most_m = room_m(straight);
  for (int eighth = 0; eighth < kSides; eighth += level ? kSides / 2 : 1) {
    const double angle_rad = 2.0 * kPi * eighth / kSides;
    Trajectory aside =
        builder_.brake_aside(uav.commanded(), depart_s, std::cos(angle_rad) * side + std::sin(angle_rad) * up);
    if (!meets(aside, fellows, depart_s).safe()) continue;
    const bool safe = is_safe(space, aside, depart_s);
    const double left_m = room_m(aside);
    if (safe == best_is_safe ? left_m <= most_m : best_is_safe) continue;
    best_is_safe = safe;
    most_m = left_m;
    best = std::move(aside);
  }
  return best;
}

bool Pilot::is_safe(const FreeSpace& space, const Trajectory& motion, double from_s) const {
  return check_.check_space(space, motion, from_s).safe();
}

planning3d::SafetyReport Pilot::still_safe(const FreeSpace& space, const Uav& uav, double time_s) const {
  return check_.check_space(space, uav.commanded(), time_s);
}

planning3d::SafetyReport Pilot::meets(const Trajectory& motion, const std::vector<const Uav*>& fellows,
                                      double from_s) const {
  return check_.check_fellows(motion, motions_of(fellows), from_s);
}

}  // namespace stairwell::explore
