#pragma once

#include "core/pose.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace stairwell {

enum class SensorKind { kDepthCamera, kLidar };

/// What a UAV knows about its own range sensor. Field of view around the sensor's x axis.
struct SensorModel {
  SensorKind kind = SensorKind::kDepthCamera;
  double azimuth_fov_rad = 0.0;   ///< full horizontal angle; 2*pi for a spinning lidar
  double elevation_lo_rad = 0.0;  ///< lowest ray (negative = down), seen along the optical axis
  double elevation_hi_rad = 0.0;  ///< highest ray
  double min_range_m = 0.1;       ///< nothing nearer is returned
  double max_range_m = 5.0;       ///< space is mapped up to here
  double rate_hz = 10.0;
  int rays_azimuth = 160;    ///< columns of the depth image; lattice azimuths of the lidar
  int rays_elevation = 120;  ///< rows; lattice elevations
  int samples_per_scan = 0;  ///< lidar: rays drawn from the lattice each scan; 0 = the whole lattice

  bool panoramic() const;
  /// Whether a point at `point_sensor_m` (sensor frame) lies inside field of view and range.
  bool sees(const Eigen::Vector3d& point_sensor_m) const;
  /// Every reason why the model cannot be used; empty = usable.
  std::vector<std::string> problems() const;
};

/// One sweep of a range sensor: float32 returns in the sensor frame. A return beyond `max_range_m` says only that
/// the ray was free up to that range (as in octomap::OcTree::insertPointCloud with maxrange).
struct Scan {
  Pose T_world_sensor = Pose::Identity();
  double time_s = 0.0;
  double max_range_m = 5.0;
  std::vector<Eigen::Vector3f> points_m;
};

}  // namespace stairwell
