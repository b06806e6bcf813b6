#include "planning3d/orca.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr double kTiny = 1e-9;

/// A unit vector to the right of `direction` (horizontal), the same for all UAVs; of vertical ones any horizontal one.
Eigen::Vector3d right_of(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d right = direction.cross(Eigen::Vector3d::UnitZ());
  if (right.norm() > 1e-3 * direction.norm()) return right.normalized();
  return direction.z() >= 0.0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d(-Eigen::Vector3d::UnitX());
}

/// Distance flown until the speed can have fallen from v to zero, one period of lag included: v t + v^2 / 2a = gap.
double brakeable_mps(double gap_m, double acceleration_mps2, double period_s) {
  if (gap_m <= 0.0) return 0.0;
  const double lag_mps = acceleration_mps2 * period_s;
  return std::sqrt(lag_mps * lag_mps + 2.0 * acceleration_mps2 * gap_m) - lag_mps;
}

bool usable(const SeenUav& uav) { return uav.position_m.allFinite() && uav.velocity_mps.allFinite(); }

/// Everything about one UAV at one moment.
struct Situation {
  const OrcaConfig& config;
  const SeenUav& own;
  std::vector<SeenUav> fellows;  ///< usable and in sight
  FreeCell cell;
  double combined_m;  ///< wanted between centres
  double closest_m;   ///< between centres, beyond which each has its half of the gap
};

Situation look_around(const FreeSpace& space, const OrcaConfig& config, const SeenUav& own,
                      const std::vector<SeenUav>& fellows) {
  const double fastest_mps = own.velocity_mps.norm() + config.acceleration_mps2() * config.period_s;
  const double reach_m = fastest_mps * config.period_s + 0.5 * fastest_mps * fastest_mps / config.acceleration_mps2() +
                         space.grid().resolution_m();
  const double diameter_m = 2.0 * space.robot().radius_m;
  Situation now{config,
                own,
                {},
                FreeCell(space, own.position_m, reach_m, config.wall_spare_m),
                diameter_m + config.margin_m,
                diameter_m + 0.5 * config.margin_m};
  for (const SeenUav& fellow : fellows) {
    if (usable(fellow) && (fellow.position_m - own.position_m).norm() < config.sight_m) now.fellows.push_back(fellow);
  }
  return now;
}

/// Hard: obstacles and the planes midway to fellows, as speeds towards them from which one can stop.
std::vector<HalfSpace> brakeable(const Situation& now) {
  std::vector<HalfSpace> hard;
  const double a = now.config.acceleration_mps2();
  for (const FreeCell::Plane& plane : now.cell.planes()) {
    hard.push_back({plane.normal, -brakeable_mps(plane.gap_m(now.own.position_m), a, now.config.period_s)});
  }
  for (const SeenUav& fellow : now.fellows) {
    const Eigen::Vector3d apart_m = now.own.position_m - fellow.position_m;
    const double distance_m = apart_m.norm();
    if (distance_m < kTiny) continue;
    const double half_gap_m = 0.5 * (distance_m - now.closest_m);
    hard.push_back({apart_m / distance_m, -brakeable_mps(half_gap_m, a, now.config.period_s)});
  }
  return hard;
}

Eigen::Vector3d biased(const Situation& now, const Eigen::Vector3d& wish_mps) {
  const double speed_mps = wish_mps.norm();
  if (speed_mps < kTiny) return wish_mps;
  const bool met = std::any_of(now.fellows.begin(), now.fellows.end(), [&](const SeenUav& fellow) {
    const Eigen::Vector3d to_m = fellow.position_m - now.own.position_m;
    const Eigen::Vector3d closing_mps = wish_mps - fellow.velocity_mps;
    const bool ahead = to_m.dot(wish_mps) > 0.7 * to_m.norm() * speed_mps;
    return ahead && to_m.norm() < closing_mps.norm() * now.config.horizon_s + now.combined_m;
  });
  if (!met) return wish_mps;
  const double angle_rad = now.config.right_bias_rad;
  return std::cos(angle_rad) * wish_mps + std::sin(angle_rad) * speed_mps * right_of(wish_mps);
}

/// After this period at constant acceleration, and then braking along a straight line: inside the free cell and on the
/// own side of the planes midway to the fellows. Convex, so the ends of the pieces are enough.
bool passes_brake_test(const Situation& now, const Eigen::Vector3d& velocity_mps) {
  const double period_s = now.config.period_s;
  const Eigen::Vector3d& from_m = now.own.position_m;
  const Eigen::Vector3d bend_m = from_m + 0.5 * period_s * now.own.velocity_mps;  // control point of the parabola
  const Eigen::Vector3d next_m = bend_m + 0.5 * period_s * velocity_mps;
  const Eigen::Vector3d rest_m = next_m + 0.5 * velocity_mps.norm() / now.config.acceleration_mps2() * velocity_mps;
  for (const Eigen::Vector3d& point_m : {bend_m, next_m, rest_m}) {
    if (!now.cell.contains(point_m)) return false;
    for (const SeenUav& fellow : now.fellows) {
      const Eigen::Vector3d to_m = fellow.position_m - from_m;
      const double distance_m = to_m.norm();
      const double half_gap_m = std::max(0.0, 0.5 * (distance_m - now.closest_m));
      if (to_m.dot(point_m - from_m) > (half_gap_m + kTiny) * distance_m) return false;
    }
  }
  return true;
}

}  // namespace

std::vector<std::string> OrcaConfig::problems() const {
  std::vector<std::string> found = limits.problems();
  const auto positive = [&found](double value, const char* name) {
    if (!(value > 0.0) || !std::isfinite(value)) found.push_back(std::string(name) + " must be a positive number");
  };
  positive(horizon_s, "avoidance horizon");
  positive(overlap_s, "time to part");
  positive(sight_m, "sight");
  positive(period_s, "avoidance period");
  if (!(margin_m >= 0.0)) found.emplace_back("margin between UAVs must not be negative");
  if (!(wall_spare_m >= 0.0)) found.emplace_back("spare to obstacles must not be negative");
  if (!(used_share > 0.0 && used_share <= 1.0)) found.emplace_back("share of the limits must lie in (0, 1]");
  return found;
}

HalfSpace reciprocal_half_space(const SeenUav& own, const SeenUav& fellow, double combined_m, double horizon_s,
                                double overlap_s, double share) {
  const Eigen::Vector3d to_m = fellow.position_m - own.position_m;
  const Eigen::Vector3d relative_mps = own.velocity_mps - fellow.velocity_mps;
  const double distance_m = to_m.norm();
  const bool overlap = distance_m <= combined_m;
  const double time_s = overlap ? overlap_s : horizon_s;
  // From the centre of the sphere that cuts the cone of forbidden relative velocities off.
  const Eigen::Vector3d from_center_mps = relative_mps - to_m / time_s;
  const double length_mps = from_center_mps.norm();
  const double facing = from_center_mps.dot(to_m);
  Eigen::Vector3d normal;
  double change_mps = 0.0;
  if (overlap || (facing < 0.0 && -facing > combined_m * length_mps)) {
    normal = from_center_mps / std::max(length_mps, kTiny);
    if (length_mps < kTiny) {
      normal = Eigen::Vector3d::UnitX() * (own.number < fellow.number ? 1.0 : -1.0);
    }
    change_mps = combined_m / time_s - length_mps;
  } else {  // the nearest line of the cone's mantle
    const Eigen::Vector3d axis = to_m / distance_m;
    Eigen::Vector3d off_axis = relative_mps - relative_mps.dot(axis) * axis;
    off_axis = off_axis.norm() > kTiny ? off_axis.normalized() : right_of(axis);
    const double sine = combined_m / distance_m;
    normal = std::sqrt(1.0 - sine * sine) * off_axis - sine * axis;
    change_mps = -relative_mps.dot(normal);
  }
  return {normal, normal.dot(own.velocity_mps) + share * change_mps};
}

OrcaChoice choose_velocity(const FreeSpace& space, const OrcaConfig& config, const SeenUav& own,
                           const Eigen::Vector3d& wish_mps, const std::vector<SeenUav>& fellows) {
  if (!usable(own)) return {Eigen::Vector3d::Zero(), true, 0.0};
  const Situation now = look_around(space, config, own, fellows);
  std::vector<HalfSpace> half_spaces = brakeable(now);
  const std::size_t hard = half_spaces.size();
  for (const SeenUav& fellow : now.fellows) {
    half_spaces.push_back(reciprocal_half_space(own, fellow, now.combined_m, config.horizon_s, config.overlap_s));
  }
  const Eigen::Vector3d wish = wish_mps.allFinite() ? biased(now, wish_mps) : Eigen::Vector3d::Zero();
  const ProgramResult best = nearest_velocity(half_spaces, hard, config.speed_mps(), wish);
  const double step_mps = config.acceleration_mps2() * config.period_s;
  const double speed_mps = own.velocity_mps.norm();
  const Eigen::Vector3d braked_mps = std::max(0.0, 1.0 - step_mps / std::max(speed_mps, kTiny)) * own.velocity_mps;
  const Eigen::Vector3d change_mps = best.velocity_mps - own.velocity_mps;
  const Eigen::Vector3d wanted_mps =
      own.velocity_mps + std::min(1.0, step_mps / std::max(change_mps.norm(), kTiny)) * change_mps;
  for (const double part : {1.0, 0.75, 0.5, 0.25}) {
    const Eigen::Vector3d velocity_mps = braked_mps + part * (wanted_mps - braked_mps);
    if (passes_brake_test(now, velocity_mps)) return {velocity_mps, false, best.violation_mps};
  }
  return {braked_mps, true, best.violation_mps};
}

}  // namespace stairwell::planning3d
