/// What ways, turns and partial views cost a UAV in seconds, and what it saves by keeping to what it is doing.
#include "core/units.hpp"
#include "coverage3d/frontier_strategy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace stairwell::coverage3d {
namespace {

constexpr double kPartialView_s = 4.0;           // price of a view that gains nothing of what the best one gains
constexpr double kCommitment_s = 4.0;            // another goal must be this much better than the one under way, ...
constexpr double kPanoramicCommitment_s = 10.0;  // ... or this much for a sensor that sees all round, ...
constexpr double kPanoramicCommitment_m = 4.0;   // ... and there what is near its target too, the less the farther
constexpr double kStorey_m = 1.8;                // a climb of more than this ...
constexpr double kStoreyDetour = 1.2;  // ... by a way this much longer than the straight line is a change of storey ...
constexpr double kStoreyChange_s = 6.0;  // ... which is put off while there is work near

/// From rest to rest with the trapezoidal rate profile.
double turn_time_s(const MotionLimits& limits, double turn_rad) {
  const double angle_rad = std::abs(turn_rad);
  const double ramps_rad = limits.yaw_rate_radps * limits.yaw_rate_radps / limits.yaw_acceleration_radps2;
  if (angle_rad < ramps_rad) return 2.0 * std::sqrt(angle_rad / limits.yaw_acceleration_radps2);
  return angle_rad / limits.yaw_rate_radps + limits.yaw_rate_radps / limits.yaw_acceleration_radps2;
}

/// At full speed over `way_m` metres that lead by `offset_m` altogether.
double cruise_s(const MotionLimits& limits, double way_m, const Eigen::Vector3d& offset_m) {
  const double stretch = offset_m.norm() > 1e-6 ? limits.stretch(offset_m) : 1.0;
  return way_m / (stretch * limits.speed_mps);
}

}  // namespace

FrontierStrategy::Crew FrontierStrategy::crew_of(const AssignmentRequest& request) const {
  Crew crew;
  for (std::size_t i = 0; i < request.uavs.size(); ++i) {
    const UavView& uav = request.uavs[i];
    if (!uav.placed) continue;
    crew.ways.push_back(crew.uavs.size());
    crew.uavs.push_back(i);
    crew.target_m.push_back(uav.wants_goal && uav.goal ? std::optional(uav.goal->target_m) : std::nullopt);
    if (uav.wants_goal || !uav.goal) {
      crew.start_m.push_back(uav.position_m);
      crew.velocity_mps.push_back(uav.velocity_mps);
      crew.yaw_rad.push_back(uav.yaw_rad);
      crew.ready_s.push_back(0.0);
      continue;
    }
    const double way_m = std::max(uav.goal->travel_m * 0.5, (uav.goal->position_m - uav.position_m).norm());
    crew.start_m.push_back(uav.goal->position_m);
    crew.velocity_mps.emplace_back(Eigen::Vector3d::Zero());
    crew.yaw_rad.push_back(uav.goal->yaw_rad);
    crew.ready_s.push_back(cruise_s(config_.limits, way_m, uav.goal->position_m - uav.position_m));
  }
  return crew;
}

double FrontierStrategy::leg_s(double way_m, const Eigen::Vector3d& from_m, const Eigen::Vector3d& velocity_mps,
                               double yaw_rad, const Viewpoint& to) const {
  const MotionLimits& limits = config_.limits;
  const Eigen::Vector3d offset_m = to.position_m - from_m;
  const double straight_m = offset_m.norm();
  double move_s = cruise_s(limits, way_m, offset_m);
  if (straight_m > 1e-6) {  // changing to full speed in the new direction
    const double stretch = limits.stretch(offset_m);
    const double fastest_mps = stretch * limits.speed_mps;
    const Eigen::Vector3d wanted_mps = offset_m * (fastest_mps / straight_m);
    // Half the change's duration for setting off, four times that for turning back: braking and the way back count.
    move_s += 0.5 * (wanted_mps - velocity_mps).squaredNorm() / (stretch * limits.acceleration_mps2 * fastest_mps);
  }
  if (std::abs(offset_m.z()) > kStorey_m && way_m > kStoreyDetour * straight_m) move_s += kStoreyChange_s;
  const double turn_s = config_.sensor.panoramic() ? 0.0 : turn_time_s(limits, wrap_angle(to.yaw_rad - yaw_rad));
  return std::max(move_s, turn_s);
}

double FrontierStrategy::start_s(const Crew& crew, std::size_t vehicle, const Viewpoint& to) const {
  const auto way_m = static_cast<double>(costs_[crew.ways[vehicle]].distance_m(to.voxel));
  if (!std::isfinite(way_m)) return std::numeric_limits<double>::infinity();
  const double straight_m = (to.position_m - crew.start_m[vehicle]).norm();
  return leg_s(std::max(way_m, straight_m), crew.start_m[vehicle], crew.velocity_mps[vehicle], crew.yaw_rad[vehicle],
               to) +
         reluctance_s(crew.uavs[vehicle], to);
}

double FrontierStrategy::soonest_s(const Crew& crew, const Viewpoint& to) const {
  double time_s = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < crew.uavs.size(); ++k) time_s = std::min(time_s, crew.ready_s[k] + start_s(crew, k, to));
  return time_s;
}

double FrontierStrategy::between_s(double way_m, const Viewpoint& from, const Viewpoint& to) const {
  return leg_s(way_m, from.position_m, Eigen::Vector3d::Zero(), from.yaw_rad, to);
}

double FrontierStrategy::price_s(const Stop& stop, const Viewpoint& view) const {
  double most_m3 = 1e-9;
  for (const Viewpoint* other : stop.views) most_m3 = std::max(most_m3, other->gain_m3);
  return kPartialView_s * (1.0 - view.gain_m3 / most_m3);
}

/// By how much a stop is favoured because the vehicle is on its way there. What sees all round sees its targets from
/// afar, whatever way it flies; it must not turn round each time.
double FrontierStrategy::commitment_s(const Crew& crew, std::size_t vehicle, const Stop& stop) const {
  if (!crew.target_m[vehicle]) return 0.0;
  const Eigen::Vector3d& target_m = *crew.target_m[vehicle];
  const bool panoramic = config_.sensor.panoramic();
  if (belongs(*stop.cluster, target_m)) return panoramic ? kPanoramicCommitment_s : kCommitment_s;
  if (!panoramic) return 0.0;
  const double off_m = std::min((stop.cluster->center_m - target_m).norm(), (stop.pose().position_m - target_m).norm());
  return kPanoramicCommitment_s * std::max(0.0, 1.0 - off_m / kPanoramicCommitment_m);
}

}  // namespace stairwell::coverage3d
