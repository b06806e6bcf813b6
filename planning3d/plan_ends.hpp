#pragma once

#include "planning3d/planner.hpp"
#include "planning3d/segment_check.hpp"

namespace stairwell::planning3d {

/// How far a start or goal may lie off traversable space; it is led to the nearest of it.
constexpr double kSnap_m = 0.3;

/// The two ends of a request for a search over voxels.
struct PlanEnds {
  VoxelIndex start;
  VoxelIndex goal;
  Eigen::Vector3d start_m;  ///< as asked for where the robot fits there, else the centre of its voxel
  Eigen::Vector3d goal_m;   ///< likewise
};

/// @returns kReached when `ends` is set, else kStartBlocked or kGoalBlocked (not finite, farther than kSnap_m from
/// traversable space, or a goal inside a keep-out sphere)
PlanStatus find_ends(const FreeSpace& space, const PlanRequest& request, const SegmentCheck& check, PlanEnds& ends);

}  // namespace stairwell::planning3d
