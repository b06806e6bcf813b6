#include "planning3d/safety_check.hpp"

#include "core/units.hpp"
#include "mapping/collision.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::planning3d {

namespace {

constexpr double kTouch_m = 1e-6;  // resting against a face is no collision
constexpr double kBoxRounding_m = 1e-6;
constexpr double kLimitRounding = 1e-4;  // relative
constexpr double kStraight_m = 1e-9;
constexpr double kComingApart_m = 1e-6;  // less is no nearer
constexpr double kBowShare =
    1.5;  // a cubic is at most this much farther from its chord than half-way (1 for a parabola)

/// Touching counts.
bool sphere_hits_voxel(const Eigen::Vector3d& sphere_m, double radius_m, const Eigen::Vector3d& voxel_m,
                       double half_m) {
  const Eigen::Vector3d outside_m = ((sphere_m - voxel_m).cwiseAbs().array() - half_m).max(0.0).matrix();
  return outside_m.squaredNorm() <= radius_m * radius_m;
}

/// The occupancy words' answer, for a sphere larger by a nanometre: one that touches is not free.
bool free_by_words(const FreeSpace& space, const Eigen::Vector3d& position_m, double radius_m) {
  if (space.blocked_words() == nullptr || !space.grid().box().contains(position_m)) return false;
  const mapping::SphereShape sphere{radius_m + 2.0 * mapping::kCollisionTouch_m};
  const mapping::CollisionChecker checker(*space.blocked_words(), space.blocked_distance(), sphere);
  return !checker.collides(Pose(Eigen::Translation3d(position_m)));
}

Verdict close_call(const FreeSpace& space, const Eigen::Vector3d& position_m, double radius_m) {
  const GridSpec& grid = space.grid();
  const double sphere_radius_m = std::max(kTouch_m, radius_m - kTouch_m);
  if (free_by_words(space, position_m, sphere_radius_m)) return Verdict::kSafe;
  const double half_m = 0.5 * grid.resolution_m();
  const VoxelIndex from = grid.index_of(position_m - Eigen::Vector3d::Constant(radius_m));
  const VoxelIndex to = grid.index_of(position_m + Eigen::Vector3d::Constant(radius_m));
  Verdict worst = Verdict::kSafe;
  for (int z = from.z; z <= to.z; ++z) {
    for (int y = from.y; y <= to.y; ++y) {
      for (int x = from.x; x <= to.x; ++x) {
        const VoxelIndex v{x, y, z};
        if (!space.map().blocked(v)) continue;
        if (!sphere_hits_voxel(position_m, sphere_radius_m, grid.center_of(v), half_m)) continue;
        if (space.map().at(v) == Occupancy::kOccupied || space.map().ever_hit(v)) return Verdict::kOccupied;
        if (worst != Verdict::kUnknown) worst = grid.contains(v) ? Verdict::kUnknown : Verdict::kOutsideBox;
      }
    }
  }
  return worst;
}

/// Checks one place after the other, and the way between them, with the escape allowance.
class Walker {
 public:
  Walker(const SafetyCheck& check, const FreeSpace& space)
      : check_(check), space_(space), whole_m_(space.robot().radius_m + check.config().spare_m), radius_m_(whole_m_) {}

  /// @param bow_m how far the way to here bends away from the straight line
  Verdict visit(const Eigen::Vector3d& at_m, double bow_m = 0.0) {
    if (first_) start(at_m);
    const Eigen::Vector3d from_m = std::exchange(last_m_, at_m);
    gone_m_ += (at_m - from_m).norm();
    Verdict verdict = check_.check_position(space_, at_m, radius_m_);
    if (verdict == Verdict::kSafe) verdict = on_the_way(from_m, at_m, bow_m);
    if (verdict == Verdict::kSafe && radius_m_ < whole_m_) verdict = grow(at_m);
    return verdict;
  }

 private:
  /// The sphere grows to the robot's size as soon as that fits, and so on to the whole one; far from the start it must.
  Verdict grow(const Eigen::Vector3d& at_m) {
    const Verdict whole = check_.check_position(space_, at_m, whole_m_);
    if (whole == Verdict::kSafe || gone_m_ > check_.config().escape_m) {
      radius_m_ = whole_m_;
      return whole;
    }
    const double robot_m = space_.robot().radius_m;
    if (radius_m_ < robot_m && check_.check_position(space_, at_m, robot_m) == Verdict::kSafe) radius_m_ = robot_m;
    return Verdict::kSafe;
  }

  void start(const Eigen::Vector3d& at_m) {
    first_ = false;
    last_m_ = at_m;
    const double robot_m = space_.robot().radius_m;
    if (!(check_.config().escape_m > 0.0)) return;
    for (const double radius_m : {whole_m_, robot_m, 0.75 * robot_m, 0.5 * robot_m, 0.25 * robot_m, 0.05 * robot_m}) {
      radius_m_ = radius_m;
      if (check_.check_position(space_, at_m, radius_m_) == Verdict::kSafe) return;
    }
    radius_m_ = whole_m_;
  }

  Verdict on_the_way(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double bow_m) const {
    const double swept_m = std::max(kTouch_m, radius_m_ + bow_m - kTouch_m);
    if (from_m == to_m || space_.swept_sphere_free(from_m, to_m, swept_m)) return Verdict::kSafe;
    // The sphere around both ends holds what is touched, and names it.
    const Verdict around =
        check_.check_position(space_, 0.5 * (from_m + to_m), radius_m_ + bow_m + 0.5 * (to_m - from_m).norm());
    return around == Verdict::kSafe ? Verdict::kOccupied : around;
  }

  const SafetyCheck& check_;
  const FreeSpace& space_;
  bool first_ = true;
  double whole_m_;
  double radius_m_;
  double gone_m_ = 0.0;
  Eigen::Vector3d last_m_ = Eigen::Vector3d::Zero();
};

double off_line_m(const Eigen::Vector3d& p_m, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const Eigen::Vector3d way_m = to_m - from_m;
  const double u = std::clamp((p_m - from_m).dot(way_m) / std::max(way_m.squaredNorm(), 1e-18), 0.0, 1.0);
  const double off_m = (from_m + u * way_m - p_m).norm();
  return off_m > kStraight_m ? off_m : 0.0;
}

double fastest_mps(const Trajectory& trajectory) {
  double most = 0.0;
  for (const MotionState& state : trajectory.states()) most = std::max(most, state.velocity_mps.squaredNorm());
  return std::sqrt(most);
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kSafe:
      return "safe";
    case Verdict::kOccupied:
      return "occupied";
    case Verdict::kUnknown:
      return "unknown";
    case Verdict::kOutsideBox:
      return "outside box";
    case Verdict::kLimits:
      return "limits";
    case Verdict::kFellow:
      return "fellow";
  }
  return "?";
}

Verdict SafetyCheck::check_position(const FreeSpace& space, const Eigen::Vector3d& position_m, double radius_m) const {
  if (!position_m.array().isFinite().all()) return Verdict::kOutsideBox;
  if (!space.flight_box().inflated(kBoxRounding_m).contains(position_m)) return Verdict::kOutsideBox;
  if (space.surely_free(position_m, radius_m)) return Verdict::kSafe;
  return close_call(space, position_m, radius_m);
}

SafetyReport SafetyCheck::check_path(const FreeSpace& space, const std::vector<Eigen::Vector3d>& path_m) const {
  Walker walker(*this, space);
  double gone_m = 0.0;
  for (std::size_t i = 0; i < path_m.size(); ++i) {
    const Eigen::Vector3d from_m = i > 0 ? path_m[i - 1] : path_m[i];
    const double leg_m = (path_m[i] - from_m).norm();
    const double ratio = std::ceil(leg_m / config_.step_m);
    if (!std::isfinite(ratio)) return {Verdict::kOutsideBox, gone_m, path_m[i]};
    const int pieces = std::max(1, static_cast<int>(ratio));
    for (int k = 1; k <= pieces; ++k) {
      const double u = static_cast<double>(k) / pieces;
      const Eigen::Vector3d at_m = from_m + u * (path_m[i] - from_m);
      const Verdict verdict = walker.visit(at_m);
      if (verdict != Verdict::kSafe) return {verdict, gone_m + u * leg_m, at_m};
    }
    gone_m += leg_m;
  }
  return {};
}

SafetyReport SafetyCheck::check_space(const FreeSpace& space, const Trajectory& trajectory, double from_s) const {
  if (trajectory.empty()) return {};
  Walker walker(*this, space);
  const double end_s = trajectory.end_time_s();
  Eigen::Vector3d checked_m = trajectory.sample(from_s).position_m;
  Verdict verdict = walker.visit(checked_m);
  if (verdict != Verdict::kSafe) return {verdict, from_s, checked_m};
  for (double time_s = from_s; time_s < end_s;) {
    const double speed_mps = trajectory.sample(time_s).velocity_mps.norm();
    // Half a step at the present speed, so that no two checked places are farther apart than a whole one.
    const double wait_s =
        std::clamp(0.5 * config_.step_m / std::max(speed_mps, 1e-3), 0.1 * Trajectory::kStep_s, Trajectory::kStep_s);
    const double before_s = std::exchange(time_s, std::min(end_s, time_s + wait_s));
    const Eigen::Vector3d at_m = trajectory.sample(time_s).position_m;
    if (at_m == checked_m) continue;
    const Eigen::Vector3d middle_m = trajectory.sample(0.5 * (before_s + time_s)).position_m;
    verdict = walker.visit(at_m, kBowShare * off_line_m(middle_m, checked_m, at_m));
    if (verdict != Verdict::kSafe) return {verdict, time_s, at_m};
    checked_m = at_m;
  }
  return {};
}

SafetyReport SafetyCheck::check_limits(const Trajectory& trajectory, const MotionLimits& limits, double from_s) const {
  const auto& states = trajectory.states();
  const double dt_s = Trajectory::kStep_s;
  const double slack = 1.0 + kLimitRounding;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double time_s = trajectory.start_time_s() + dt_s * static_cast<double>(i);
    if (time_s < from_s - 1e-9) continue;
    const MotionState& now = states[i];
    bool fine = limits.size_of(now.velocity_mps) <= limits.speed_mps * slack &&
                std::abs(now.yaw_rate_radps) <= limits.yaw_rate_radps * slack;
    if (fine && i + 1 < states.size()) {
      const MotionState& next = states[i + 1];
      const Eigen::Vector3d change_mps = next.velocity_mps - now.velocity_mps;
      const Eigen::Vector3d moved_m = next.position_m - now.position_m;
      fine = limits.size_of(change_mps) <= limits.acceleration_mps2 * dt_s * slack &&
             std::abs(next.yaw_rate_radps - now.yaw_rate_radps) <= limits.yaw_acceleration_radps2 * dt_s * slack &&
             limits.size_of(moved_m) <= limits.speed_mps * dt_s * slack + 1e-6 &&
             std::abs(wrap_angle(next.yaw_rad - now.yaw_rad)) <= limits.yaw_rate_radps * dt_s * slack + 1e-6;
    } else if (fine) {  // it rests from the last state on
      fine = limits.size_of(now.velocity_mps) <= limits.acceleration_mps2 * dt_s * slack &&
             std::abs(now.yaw_rate_radps) <= limits.yaw_acceleration_radps2 * dt_s * slack;
    }
    if (fine && limits.limits_jerk() && i > 0 && time_s - dt_s >= from_s - 1e-9) {
      const Eigen::Vector3d after_mps = i + 1 < states.size() ? states[i + 1].velocity_mps : Eigen::Vector3d::Zero();
      const Eigen::Vector3d twice_mps = after_mps - 2.0 * now.velocity_mps + states[i - 1].velocity_mps;
      fine = limits.size_of(twice_mps) <= limits.jerk_mps3 * dt_s * dt_s * slack;
    }
    if (!fine) return {Verdict::kLimits, time_s, now.position_m};
  }
  return {};
}

SafetyReport SafetyCheck::check_fellows(const Trajectory& trajectory, const std::vector<const Trajectory*>& fellows,
                                        double from_s) const {
  SafetyReport first;
  if (trajectory.empty()) return first;
  const double own_mps = fastest_mps(trajectory);
  for (const Trajectory* fellow : fellows) {
    if (fellow == nullptr || fellow->empty()) continue;
    double end_s = std::max(trajectory.end_time_s(), fellow->end_time_s());
    if (!first.safe()) end_s = std::min(end_s, first.at_time_s);
    const double closing_mps = own_mps + fastest_mps(*fellow) + 1e-6;
    double least_m = 0.0;  // that is allowed; less than the clearance until they have come apart
    for (double time_s = from_s;;) {
      const Eigen::Vector3d at_m = trajectory.sample(time_s).position_m;
      const double apart_m = (at_m - fellow->sample(time_s).position_m).norm();
      const bool clear = apart_m >= config_.fellow_clearance_m;
      if (apart_m < least_m - kComingApart_m || (!clear && time_s >= end_s)) {
        if (first.safe() || time_s < first.at_time_s) first = {Verdict::kFellow, time_s, at_m};
        break;
      }
      if (time_s >= end_s) break;
      least_m = std::min(config_.fellow_clearance_m, std::max(least_m, apart_m));
      // They cannot meet sooner than this; near misses are looked at in half states.
      const double wait_s = (apart_m - config_.fellow_clearance_m) / closing_mps;
      time_s = std::min(end_s, time_s + std::max(0.5 * Trajectory::kStep_s, wait_s));
    }
  }
  return first;
}

}  // namespace stairwell::planning3d
