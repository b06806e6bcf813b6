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
                        const SensorModel& sensor, double reach_m) {
  if (sensor.panoramic()) return 0.0;
  const double seen_rad = 0.5 * sensor.azimuth_fov_rad;
  double left_rad = 0.0;  // turns that bring the farthest unknown sector on each side to the image's edge
  double right_rad = 0.0;
  for (int i = 0; i < kSectors; ++i) {
    const double relative_rad = wrap_angle(2.0 * kPi * (i + 0.5) / kSectors);
    if (!meets_unknown(map, position_m, yaw_rad + relative_rad, reach_m)) continue;
    if (relative_rad >= 0.0) {
      left_rad = std::max(left_rad, relative_rad - seen_rad);
    } else {
      right_rad = std::max(right_rad, -relative_rad - seen_rad);
    }
  }
  if (left_rad <= 0.0 && right_rad <= 0.0) return 0.0;
  const double full_rad = 2.0 * kPi - sensor.azimuth_fov_rad;  // one way round until the images meet
  const double both_ways_rad = std::min(2.0 * left_rad + right_rad, 2.0 * right_rad + left_rad);
  if (left_rad > 0.0 && right_rad > 0.0 && full_rad <= both_ways_rad) return full_rad;
  return left_rad >= right_rad ? left_rad : -right_rad;
}

}  // namespace stairwell::explore
