#include "core/scan.hpp"

#include "core/units.hpp"

#include <cmath>

namespace stairwell {

namespace {
constexpr double kFullTurnTolerance_rad = 1e-6;
}

bool SensorModel::panoramic() const { return azimuth_fov_rad >= 2.0 * kPi - kFullTurnTolerance_rad; }

bool SensorModel::sees(const Eigen::Vector3d& point_sensor_m) const {
  const double range_m = point_sensor_m.norm();
  if (range_m < min_range_m || range_m > max_range_m) return false;
  const double azimuth_rad = std::atan2(point_sensor_m.y(), point_sensor_m.x());
  if (!panoramic() && std::abs(azimuth_rad) > 0.5 * azimuth_fov_rad) return false;
  // A pinhole image is flat: its upper edge is a straight line, so the elevation is measured along the optical axis.
  const double forward_m = kind == SensorKind::kDepthCamera ? point_sensor_m.x() : point_sensor_m.head<2>().norm();
  const double elevation_rad = std::atan2(point_sensor_m.z(), forward_m);
  return elevation_rad >= elevation_lo_rad && elevation_rad <= elevation_hi_rad;
}

std::vector<std::string> SensorModel::problems() const {
  std::vector<std::string> found;
  if (!(azimuth_fov_rad > 0.0) || azimuth_fov_rad > 2.0 * kPi + kFullTurnTolerance_rad) {
    found.emplace_back("horizontal field of view must be above 0 and at most 360 degrees");
  }
  if (kind == SensorKind::kDepthCamera && azimuth_fov_rad >= kPi) {
    found.emplace_back("a depth camera's horizontal field of view must be below 180 degrees (use --sensor lidar)");
  }
  if (!(elevation_lo_rad < elevation_hi_rad) || std::abs(elevation_lo_rad) > kPi / 2 ||
      std::abs(elevation_hi_rad) > kPi / 2) {
    found.emplace_back("vertical field of view must be a non-empty interval within -90..90 degrees");
  }
  if (!(min_range_m >= 0.0) || !(max_range_m > min_range_m) || !std::isfinite(max_range_m)) {
    found.emplace_back("sensor range must be finite and above the minimum range");
  }
  if (!(rate_hz > 0.0) || !std::isfinite(rate_hz)) found.emplace_back("sensor rate must be positive");
  if (rays_azimuth < 1 || rays_elevation < 1) found.emplace_back("a sensor needs at least one ray per axis");
  if (samples_per_scan < 0) found.emplace_back("samples per scan must not be negative");
  return found;
}

}  // namespace stairwell
