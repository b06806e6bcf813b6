/// Velocities allowed by half-spaces: the linear programme of reciprocal avoidance in three dimensions.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <limits>
#include <vector>

namespace stairwell::planning3d {

/// Velocities v (world frame, m/s) with normal . v >= offset_mps.
struct HalfSpace {
  Eigen::Vector3d normal;  ///< unit length
  double offset_mps = 0.0;

  double violation_mps(const Eigen::Vector3d& velocity_mps) const { return offset_mps - normal.dot(velocity_mps); }
};

/// The optimum, if there is one.
struct ProgramResult {
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  double violation_mps = 0.0;  ///< of the soft half-space that is violated most; 0 = none is
};

/// The velocity nearest to `preferred_mps` within the ball |v| <= max_speed_mps and all half-spaces. Where there is
/// none, the one within the ball and the first `hard` half-spaces that violates the others least (the greatest
/// violation is minimised). Zero where even the hard ones have nothing in common.
/// van den Berg et al. 2011, "Reciprocal n-body collision avoidance", sections 5.2 and 5.3 (in 3D planes for lines);
/// incremental as in de Berg et al., "Computational Geometry", chapter 4.
/// @pre finite numbers, unit normals, hard <= half_spaces.size()
ProgramResult nearest_velocity(const std::vector<HalfSpace>& half_spaces, std::size_t hard, double max_speed_mps,
                               const Eigen::Vector3d& preferred_mps);

}  // namespace stairwell::planning3d
