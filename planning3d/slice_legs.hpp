#pragma once

#include "planning3d/segment_check.hpp"
#include "planning3d/travel_costs.hpp"

#include <Eigen/Core>

#include <vector>

namespace stairwell::planning3d {

/// Corners of a way between layers, for planners that move in one plane: from each to the next it goes either straight
/// up or down (and that is free), or horizontally at a layer's height (a planner has to find out how). The openings are
/// those of the cheapest way by `costs` (SPEC A16), which is computed anew.
/// @param rule  of slices
/// @returns start and goal and what is between them; empty where there is no such way
std::vector<Eigen::Vector3d> slice_legs(const FreeSpace& space, const SegmentCheck& check, const MotionRule& rule,
                                        const Eigen::Vector3d& start_m, const Eigen::Vector3d& goal_m,
                                        TravelCosts& costs);

}  // namespace stairwell::planning3d
