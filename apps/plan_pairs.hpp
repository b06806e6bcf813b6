/// Random tasks on a known map for `stairwell plan --benchmark`.
#pragma once

#include "apps/known_map.hpp"
#include "apps/plan_tasks.hpp"
#include "core/robot.hpp"

#include <vector>

namespace stairwell::apps {

/// Starts and goals are centres of voxels where the robot fits, connected with each other (through faces of such
/// voxels), drawn evenly. The same seed gives the same pairs on the same map.
/// @throws InputError when there are not so many, or for `cross_storey` on a map that shows fewer than two storeys.
std::vector<PlanTask> random_pairs(const KnownMap& map, const Robot& robot, const PairRules& rules);

}  // namespace stairwell::apps
