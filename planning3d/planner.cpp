#include "planning3d/planner.hpp"

#include "core/errors.hpp"
#include "planning3d/agent_planner.hpp"
#include "planning3d/apf_planner.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/ompl_planner.hpp"
#include "planning3d/slice_planner.hpp"
#include "planning3d/theta_planner.hpp"
#include "planning3d/volume_planner.hpp"

#include <string>

namespace stairwell::planning3d {

namespace {
// Saves about two thirds of the time; string pulling takes back nearly all of the detours (see the planner tests).
constexpr double kHeuristicWeight = 1.5;
constexpr std::size_t kMostPots = 300;  // of the experience layer, for one path
}  // namespace

const char* to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::kReached:
      return "reached";
    case PlanStatus::kStartBlocked:
      return "start blocked";
    case PlanStatus::kGoalBlocked:
      return "goal blocked";
    case PlanStatus::kNoPath:
      return "no path";
    case PlanStatus::kTimedOut:
      return "timed out";
    case PlanStatus::kLocalMinimum:
      return "local minimum";
  }
  return "?";
}

std::vector<std::string_view> planner_names() {
  std::vector<std::string_view> names{"astar", "theta", "apf", "agent2d", "agent3d", "slice", "volume"};
  for (const std::string_view name : OmplPlanner::names()) names.push_back(name);
  return names;
}

std::unique_ptr<Planner> make_planner(std::string_view name, const PlannerOptions& options) {
  if (name == "astar") {
    AstarPlanner::Config config;
    config.heuristic_weight = kHeuristicWeight;
    config.led_from = options.led_from;
    return std::make_unique<AstarPlanner>(config);
  }
  if (name == "theta") return std::make_unique<ThetaPlanner>();
  if (name == "apf") {
    ApfPlanner::Config config;
    config.attraction = options.attraction;
    if (options.experience) config.most_pots = kMostPots;
    return std::make_unique<ApfPlanner>(config);
  }
  if (name == "slice") return std::make_unique<SlicePlanner>(make_planner("astar", options));
  if (name == "volume") return std::make_unique<VolumePlanner>(make_planner("astar", options));
  if (name == "agent2d" || name == "agent3d") return AgentPlanner::load(name, options.models_dir);
  if (auto planner = OmplPlanner::make(name)) return planner;
  std::string message("unknown planner '");
  message.append(name).append("'; known:");
  for (const std::string_view known : planner_names()) message.append(" ").append(known);
  throw InputError(message);
}

}  // namespace stairwell::planning3d
