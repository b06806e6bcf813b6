/// Optimal reciprocal collision avoidance in 3D (van den Berg, Guy, Lin and Manocha 2011, "Reciprocal n-body collision
/// avoidance") for UAVs with limited acceleration among obstacles. Nothing is communicated: each UAV sees where the
/// others are and how they move, and knows their fixed numbers.
#pragma once

#include "core/trajectory.hpp"
#include "planning3d/free_cell.hpp"
#include "planning3d/free_space.hpp"
#include "planning3d/half_space_program.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <string>
#include <vector>

namespace stairwell::planning3d {

/// A UAV as others see it, in the world frame.
struct SeenUav {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  std::size_t number = 0;  ///< fixed before the flight; the lower has the right of way where one must have it
};

/// Settings of the reciprocal avoidance.
struct OrcaConfig {
  MotionLimits limits;
  double margin_m = 0.1;         ///< wanted between two UAVs' surfaces
  double wall_spare_m = 0.03;    ///< kept from obstacles beyond the radius
  double horizon_s = 3.0;        ///< collisions sooner than this are avoided
  double overlap_s = 0.5;        ///< UAVs nearer than wanted part within this time
  double sight_m = 6.0;          ///< fellows farther away are not looked at
  double period_s = 0.1;         ///< a velocity is chosen this often
  double right_bias_rad = 0.15;  ///< the wish turns so far to the right while a fellow is ahead
  double used_share = 0.95;      ///< of the limits; the rest absorbs rounding

  std::vector<std::string> problems() const;
  double speed_mps() const { return used_share * limits.speed_mps; }
  double acceleration_mps2() const { return used_share * limits.acceleration_mps2; }
};

/// ORCA's half-space for `own`: velocities with which it does its share of keeping `combined_m` away from `fellow` for
/// `horizon_s`. Exactly opposite motions are told apart by passing on the right, same places by number.
/// @param share of the change of velocity that own makes: 0.5 when both avoid, 1 when the fellow does not
HalfSpace reciprocal_half_space(const SeenUav& own, const SeenUav& fellow, double combined_m, double horizon_s,
                                double overlap_s, double share = 0.5);

/// The velocity chosen.
struct OrcaChoice {
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();  ///< after the period, reached at constant acceleration
  bool braking = false;        ///< no wish passed the brake test: as hard as possible along the present velocity
  double violation_mps = 0.0;  ///< of the reciprocal half-spaces, 0 = all are kept
};

/// The velocity after the next period: the one nearest to `wish_mps` by the linear programme (obstacles and own halves
/// of the gaps are hard, ORCA's half-spaces soft), within the acceleration limit. It is used only as far as it passes
/// the brake test: from there the UAV can stop on a straight line inside its convex free cell of the map and on its
/// side of the planes midway to all fellows. Deterministic. What is not finite is ignored (fellows) or zero (wish);
/// a UAV without a finite state of its own is told to stop.
OrcaChoice choose_velocity(const FreeSpace& space, const OrcaConfig& config, const SeenUav& own,
                           const Eigen::Vector3d& wish_mps, const std::vector<SeenUav>& fellows);

}  // namespace stairwell::planning3d
