#include "explore/radial_scan.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::explore {

namespace {

constexpr int kSectors = 24;

bool meets_unknown(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, double azimuth_rad,
                   double reach_m) {
  const Eigen::Vector3d direction(std::cos(azimuth_rad), std::sin(azimuth_rad), 0.0);
  const double step_m = 0.5 * map.grid().resolution_m();
  for (double r_m = step_m; r_m < reach_m; r_m += step_m) {
    const VoxelIndex v = map.grid().index_of(from_m + r_m * direction);
    if (!map.grid().contains(v)) return false;
    const Occupancy occupancy = map.at(v);
    if (occupancy == Occupancy::kOccupied) return false;
    if (occupancy == Occupancy::kUnknown && map.blocked(v)) return true;
  }
  return false;
}

}  // namespace

double radial_scan_turn(const mapping::OccupancyMap& map, const Eigen::Vector3d& position_m, double yaw_rad,
                        const SensorModel& sensor, double reach_m, const std::function<bool(double)>& wanted) {
  if (sensor.panoramic()) return 0.0;
  const double seen_rad = 0.5 * sensor.azimuth_fov_rad;
  const double half_sector_rad = kPi / kSectors;
  const double full_rad = 2.0 * kPi - sensor.azimuth_fov_rad;  // one way round until the images meet
  double left_rad = 0.0;  // turns that bring the farthest unknown sector on each side to the image's edge
  double right_rad = 0.0;
  double round_left_rad = 0.0;  // turns one way that bring all of them into sight
  double round_right_rad = 0.0;
  for (int i = 0; i < kSectors; ++i) {
    const double leftwards_rad = 2.0 * kPi * (i + 0.5) / kSectors;
    const double relative_rad = wrap_angle(leftwards_rad);
    if (std::abs(relative_rad) <= seen_rad || (wanted && !wanted(yaw_rad + relative_rad))) continue;
    if (!meets_unknown(map, position_m, yaw_rad + relative_rad, reach_m)) continue;
    double& side_rad = relative_rad >= 0.0 ? left_rad : right_rad;
    side_rad = std::max(side_rad, std::abs(relative_rad) - seen_rad);
    round_left_rad = std::max(round_left_rad, std::min(leftwards_rad + half_sector_rad - seen_rad, full_rad));
    round_right_rad =
        std::max(round_right_rad, std::min(2.0 * kPi - leftwards_rad + half_sector_rad - seen_rad, full_rad));
  }
  if (left_rad <= 0.0 && right_rad <= 0.0) return 0.0;
  const double both_ways_rad = std::min(2.0 * left_rad + right_rad, 2.0 * right_rad + left_rad);
  if (left_rad > 0.0 && right_rad > 0.0 && std::min(round_left_rad, round_right_rad) <= both_ways_rad) {
    return round_left_rad <= round_right_rad ? round_left_rad : -round_right_rad;
  }
  return left_rad >= right_rad ? left_rad : -right_rad;
}

bool own_side(std::span<const Eigen::Vector3d> places_m, std::size_t own, double azimuth_rad) {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place_m : places_m) middle_m += place_m / static_cast<double>(places_m.size());
  const auto off_rad = [&](std::size_t i) {
    const Eigen::Vector3d away_m = places_m[i] - middle_m;
    return std::abs(wrap_angle(azimuth_rad - std::atan2(away_m.y(), away_m.x())));
  };
  for (std::size_t i = 0; i < places_m.size(); ++i) {
    if (i < own ? off_rad(i) <= off_rad(own) : off_rad(i) < off_rad(own)) return false;
  }
  return true;
}

}  // namespace stairwell::explore
