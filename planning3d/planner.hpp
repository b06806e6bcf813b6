#pragma once

#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string_view>
#include <vector>

namespace stairwell::planning3d {

enum class PlanStatus { kReached, kStartBlocked, kGoalBlocked, kNoPath, kTimedOut, kLocalMinimum };
const char* to_string(PlanStatus status);

/// What a planner is asked.
struct PlanRequest {
  Eigen::Vector3d start_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d goal_m = Eigen::Vector3d::Zero();
  MotionRule rule;
  std::vector<KeepOut> keep_out;
  double clearance_weight = 1.0;           ///< extra cost near obstacles; 0 = shortest path
  std::size_t max_expansions = 5'000'000;  ///< iteration budget: repeatable, unlike a time budget
  // Planners that sample (OMPL):
  std::uint64_t seed = 1;
  std::size_t max_checks = 20'000;  ///< iteration budget: states, motions and rounds asked about
  /// Time budget beside the iteration budget: none while `clock_s` is empty. Answers then follow the processor.
  std::function<double()> clock_s;                              ///< monotonic seconds
  double deadline_s = std::numeric_limits<double>::infinity();  ///< by `clock_s`

  bool late() const { return clock_s && clock_s() >= deadline_s; }
};

/// What it answers; poisoned until it has reached the goal.
struct PlanResult {
  PlanStatus status = PlanStatus::kNoPath;
  std::vector<Eigen::Vector3d>
      path_m;  ///< straight segments from start to goal, each traversable; empty unless reached
  double length_m = std::numeric_limits<double>::quiet_NaN();
  std::size_t expansions = 0;
};

/// Finds paths through known-free space. Implement it for a planner of one's own (explore::FleetConfig::own_planner).
class Planner {
 public:
  virtual ~Planner() = default;
  virtual std::string_view name() const = 0;
  virtual PlanResult plan(const FreeSpace& space, const PlanRequest& request) = 0;
};

/// What draws the potential field planner to the goal: the distance as the crow flies, or round the obstacles.
enum class Attraction { kCone, kGeodesic };

/// What make_planner passes on to the planners.
struct PlannerOptions {
  Attraction attraction = Attraction::kCone;  ///< `apf`
  bool experience = false;                    ///< `apf`: fill local minima
  std::filesystem::path models_dir;           ///< weights of the learned agents: path2d.model, path3d.model
  std::size_t led_from = 20'000'000;          ///< `astar`: in grids of so many voxels long searches are led
};

/// `astar` (heuristic weight 1.5: cost on the lattice at most 1.5 times the least; AstarPlanner itself is exact by
/// default), `theta`, `apf`, `slice` and `volume` (that A* within layers, and in 3D), the learned `agent2d` and
/// `agent3d`, or one of OMPL. @throws InputError listing the known names, or naming a model that cannot be used.
std::unique_ptr<Planner> make_planner(std::string_view name, const PlannerOptions& options = {});
std::vector<std::string_view> planner_names();

}  // namespace stairwell::planning3d
