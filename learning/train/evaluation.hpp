/// How good a path agent is in worlds that it has never seen, and A* in the same.
#pragma once

#include "learning/nn/model_file.hpp"
#include "planning3d/planner.hpp"

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace stairwell::train {

/// Tasks in generated worlds. Worlds are those of training by kind, but never of the same stream of random numbers.
struct EvaluationSuite {
  std::string name;
  bool plane = false;  ///< slices (`path2d`), else storeys (`path3d`)
  std::uint64_t seed = 1;
  int worlds = 25;
  int tasks_per_world = 4;
  double least_size_m = 10.0, most_size_m = 10.0;
  double resolution_m = 0.1;
  double least_obstacles = 0.07, most_obstacles = 0.08;  ///< slices
  int least_storeys = 3, most_storeys = 3;               ///< storeys
  bool cross_storey = false;                             ///< start and goal in different storeys
  bool partial = false;  ///< only what a few scans have shown is known, as during exploration
  double robot_radius_m = 0.25;
  double least_way_m = 3.0;  ///< between start and goal, around obstacles

  std::vector<std::string> problems() const;
};

/// Means over episodes; lengths, clearances and turns over those that were reached.
struct PlannerFigures {
  std::string planner;
  std::size_t episodes = 0, reached = 0;
  double success = std::numeric_limits<double>::quiet_NaN();
  double length_over_optimum = std::numeric_limits<double>::quiet_NaN();
  double min_clearance_m = std::numeric_limits<double>::quiet_NaN();    ///< mean of each path's least
  double least_clearance_m = std::numeric_limits<double>::quiet_NaN();  ///< of all paths
  double mean_turn_deg = std::numeric_limits<double>::quiet_NaN();      ///< between steps of 0.12 m (SPEC A14)
  double plan_ms = std::numeric_limits<double>::quiet_NaN();            ///< median
  double max_plan_ms = std::numeric_limits<double>::quiet_NaN();
  std::size_t long_paths = 0;                                          ///< reached by a path of 17 to 23 m
  double long_plan_ms = std::numeric_limits<double>::quiet_NaN();      ///< of these, median
  double max_long_plan_ms = std::numeric_limits<double>::quiet_NaN();  ///< of these
};

struct EvaluationResult {
  PlannerFigures raw;      ///< the agent alone: what its network flies, no search and no safety check behind it
  PlannerFigures strict;   ///< where the network's own step does not fit, it has failed; no second flight
  PlannerFigures net;      ///< the agent with the safety check and A* behind it
  PlannerFigures astar;    ///< on the same tasks
  PlannerFigures way;      ///< the field that the agent is shown, followed without a network
  PlannerFigures teacher;  ///< what the agent was taught by, flown in the same steps
  PlannerFigures widest;   ///< the way whose narrowest place is the widest; only if asked for
  std::vector<std::string> failures;  ///< of the agent alone, by reason and how often
};

struct EvaluationOptions {
  std::function<double()> clock_s;                                  ///< monotonic seconds; empty: no times
  std::function<void(std::size_t done, std::size_t all)> progress;  ///< may be empty
  std::function<bool()> interrupted;                                ///< may be empty
  bool widest = false;                                              ///< measures WidestPlanner too
};

/// Optimum: exact A* without clearance cost, its string pulled. A task is one that it can solve.
/// @throws InputError for an unusable suite, or a model for the other kind of worlds
EvaluationResult evaluate(const EvaluationSuite& suite, const nn::Model& model, const EvaluationOptions& options = {});

}  // namespace stairwell::train
