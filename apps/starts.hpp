/// Where UAVs start: checks of given positions and choice of missing ones, against the true world.
#pragma once

#include "apps/run_config.hpp"
#include "sim3d/ground_truth.hpp"

#include <vector>

namespace stairwell::apps {

/// A start that can be used.
struct CheckedStart {
  Start start;
  bool landed = false;                                   ///< stands on something and takes off first
  Eigen::Vector3d airborne_m = Eigen::Vector3d::Zero();  ///< nearest collision-free position above it
};

/// Checks the given starts and adds further ones until there are `config.uavs`: near the given ones, or near the
/// middle of the lowest storey's free space; then moves each as `config.start_spread_m` says, without passing
/// through walls or coming too near another, or leaves it where that cannot be. Places that can be had with the room
/// around them that is assumed free (`start_bubble_m`, at their height) come before others. Deterministic.
/// @throws InputError naming the start (or box) and the mend.
std::vector<CheckedStart> place_starts(const RunConfig& config, const sim3d::GroundTruth& truth);

}  // namespace stairwell::apps
