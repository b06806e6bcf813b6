/// Closed-loop scenarios of reciprocal avoidance: several UAVs in a known box, each knowing only where the others are
/// and how they move. For tests and for benchmarks/avoidance_scenarios.
#pragma once

#include "planning3d/orca.hpp"
#include "test_world.hpp"

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::test {

struct ScenarioUav {
  Eigen::Vector3d start_m;
  Eigen::Vector3d goal_m;
  double cruise_mps;
};

struct AvoidanceScenario {
  std::shared_ptr<TestWorld> world;
  std::vector<ScenarioUav> uavs;
  double time_limit_s = 120.0;  ///< who has not arrived by then is stuck
};

/// head_on, head_on_corridor, doorway, crossing, sphere_swap.
const std::vector<std::string_view>& avoidance_scenario_names();
/// Starts, goals and speeds jittered by the seed; seed 0 has none. @throws InputError for unknown names
AvoidanceScenario make_avoidance_scenario(std::string_view name, std::uint64_t seed);

struct AvoidanceOutcome {
  int collisions = 0;   ///< pairs nearer than two radii, and UAVs that touched the map; each counted once
  int not_arrived = 0;  ///< UAVs
  double finish_s = 0.0;
  double least_s = 0.0;                                             ///< lower bound: the slowest UAV alone on its path
  double min_distance_m = std::numeric_limits<double>::infinity();  ///< between two centres
  double max_speed_mps = 0.0;
  double max_acceleration_mps2 = 0.0;
  std::vector<double> step_us;  ///< computing time of one UAV's decision
  std::size_t brakings = 0;     ///< decisions that fell back to braking
};

AvoidanceOutcome run_avoidance(const AvoidanceScenario& scenario, const planning3d::OrcaConfig& config);

}  // namespace stairwell::test
