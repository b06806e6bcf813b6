/// Slow, plain judges of paths and trajectories; every one returns the reason, empty = fine.
#pragma once

#include "core/trajectory.hpp"
#include "core/units.hpp"
#include "planning3d/free_space.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace stairwell::checkers {

/// Depth by which a sphere enters blocked voxels, from every voxel around it.
inline double penetration_m(const mapping::OccupancyMap& map, const Eigen::Vector3d& center_m, double radius_m) {
  const GridSpec& grid = map.grid();
  const VoxelIndex lo = grid.index_of(center_m - Eigen::Vector3d::Constant(radius_m));
  const VoxelIndex hi = grid.index_of(center_m + Eigen::Vector3d::Constant(radius_m));
  double worst_m = 0.0;
  for (int z = lo.z; z <= hi.z; ++z) {
    for (int y = lo.y; y <= hi.y; ++y) {
      for (int x = lo.x; x <= hi.x; ++x) {
        if (!map.blocked({x, y, z})) continue;
        const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(0.5 * grid.resolution_m());
        const Eigen::Vector3d c_m = grid.center_of({x, y, z});
        const Eigen::Vector3d nearest_m = center_m.cwiseMax(c_m - half_m).cwiseMin(c_m + half_m);
        worst_m = std::max(worst_m, radius_m - (nearest_m - center_m).norm());
      }
    }
  }
  return worst_m;
}

inline std::string place_problem(const planning3d::FreeSpace& space, const Eigen::Vector3d& at_m, double tolerance_m) {
  std::ostringstream reason;
  const double depth_m = penetration_m(space.map(), at_m, space.robot().radius_m);
  if (depth_m > tolerance_m) reason << "enters blocked space by " << depth_m << " m at " << at_m.transpose();
  if (!space.flight_box().inflated(1e-6).contains(at_m)) reason << "leaves the flight box at " << at_m.transpose();
  return reason.str();
}

/// Every 1 cm of the path is in free space and inside the flight box.
inline std::string path_problem(const planning3d::FreeSpace& space, const std::vector<Eigen::Vector3d>& path_m,
                                double tolerance_m = 2e-3) {
  if (path_m.size() < 2) return "fewer than two points";
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    const int pieces = std::max(1, static_cast<int>(std::ceil((path_m[i + 1] - path_m[i]).norm() / 0.01)));
    for (int k = 0; k <= pieces; ++k) {
      const Eigen::Vector3d at_m = path_m[i] + static_cast<double>(k) / pieces * (path_m[i + 1] - path_m[i]);
      const std::string problem = place_problem(space, at_m, tolerance_m);
      if (!problem.empty()) return problem;
    }
  }
  return {};
}

/// Segments are horizontal within a layer's voxels or vertical within a voxel column.
inline std::string slice_problem(const GridSpec& grid, const std::vector<Eigen::Vector3d>& path_m,
                                 const std::vector<double>& layers_m) {
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    const VoxelIndex a = grid.index_of(path_m[i]);
    const VoxelIndex b = grid.index_of(path_m[i + 1]);
    if (a.x == b.x && a.y == b.y) continue;
    const bool level = a.z == b.z && std::any_of(layers_m.begin(), layers_m.end(), [&](double height_m) {
                         return grid.index_of({0.0, 0.0, height_m}).z == a.z;
                       });
    if (!level) return "segment " + std::to_string(i) + " is neither in a layer nor vertical";
  }
  return {};
}

/// Limits by finite differences of the stored states, positions against velocities, rest at the end.
inline std::string motion_problem(const Trajectory& trajectory, const MotionLimits& limits) {
  const auto size_of = [&limits](const Eigen::Vector3d& v) {
    return limits.norm == MotionLimits::Norm::kEuclidean ? v.norm() : v.cwiseAbs().maxCoeff();
  };
  const auto& s = trajectory.states();
  const double dt_s = Trajectory::kStep_s;
  const double slack = 1.0 + 1e-6;
  std::ostringstream reason;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (size_of(s[i].velocity_mps) > limits.speed_mps * slack) reason << "speed " << s[i].velocity_mps.transpose();
    if (size_of(s[i].acceleration_mps2) > limits.acceleration_mps2 * slack) {
      reason << "stored acceleration " << s[i].acceleration_mps2.transpose();
    }
    if (std::abs(s[i].yaw_rate_radps) > limits.yaw_rate_radps * slack) reason << "yaw rate " << s[i].yaw_rate_radps;
    if (i + 1 < s.size()) {
      const Eigen::Vector3d a = (s[i + 1].velocity_mps - s[i].velocity_mps) / dt_s;
      if (size_of(a) > limits.acceleration_mps2 * slack) reason << "acceleration " << a.transpose();
      const double yaw_a = (s[i + 1].yaw_rate_radps - s[i].yaw_rate_radps) / dt_s;
      if (std::abs(yaw_a) > limits.yaw_acceleration_radps2 * slack) reason << "yaw acceleration " << yaw_a;
      const Eigen::Vector3d moved_m = s[i + 1].position_m - s[i].position_m;
      const Eigen::Vector3d mean_mps = 0.5 * (s[i + 1].velocity_mps + s[i].velocity_mps);
      const double drift_m = (moved_m - dt_s * mean_mps).norm();
      if (drift_m > 0.5 * limits.acceleration_mps2 * dt_s * dt_s + 1e-9) {
        reason << "position jumps " << drift_m << " m, velocity " << s[i].velocity_mps.transpose() << " then "
               << s[i + 1].velocity_mps.transpose() << ", moved " << moved_m.transpose();
      }
      const double turned = wrap_angle(s[i + 1].yaw_rad - s[i].yaw_rad);
      const double mean_rate = 0.5 * (s[i + 1].yaw_rate_radps + s[i].yaw_rate_radps);
      if (std::abs(turned - dt_s * mean_rate) > 0.5 * limits.yaw_acceleration_radps2 * dt_s * dt_s + 1e-9) {
        reason << "yaw jumps";
      }
    }
    if (!reason.str().empty()) {
      reason << " at state " << i << " of " << s.size();
      return reason.str();
    }
  }
  if (!s.back().velocity_mps.isZero(1e-9) || std::abs(s.back().yaw_rate_radps) > 1e-9) return "not at rest at the end";
  return {};
}

/// Every 5 ms of the motion is in free space and inside the flight box.
inline std::string motion_space_problem(const planning3d::FreeSpace& space, const Trajectory& trajectory,
                                        double tolerance_m = 2e-3) {
  for (double t = trajectory.start_time_s(); t <= trajectory.end_time_s(); t += 0.005) {
    const std::string problem = place_problem(space, trajectory.sample(t).position_m, tolerance_m);
    if (!problem.empty()) return problem;
  }
  return {};
}

}  // namespace stairwell::checkers
