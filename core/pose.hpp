#pragma once

#include <Eigen/Geometry>

namespace stairwell {

/// Rigid transform `T_a_b`: coordinates in frame b become coordinates in frame a.
/// World: z up, metres. Body and sensor: x forward, y left, z up.
using Pose = Eigen::Isometry3d;

/// `T_world_body` of a level body at `position_m` that looks along `yaw_rad` (0 = world x, counter-clockwise).
inline Pose make_pose(const Eigen::Vector3d& position_m, double yaw_rad = 0.0) {
  Pose T_world_body = Pose::Identity();
  T_world_body.translation() = position_m;
  T_world_body.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T_world_body;
}

/// Heading of the body's x axis in the world's xy plane.
inline double yaw_of(const Pose& T_world_body) {
  const Eigen::Vector3d forward = T_world_body.linear().col(0);
  return std::atan2(forward.y(), forward.x());
}

}  // namespace stairwell
