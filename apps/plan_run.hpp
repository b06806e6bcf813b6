/// Runs planners on tasks and measures their paths.
#pragma once

#include "apps/known_map.hpp"
#include "apps/plan_tasks.hpp"
#include "planning3d/planner.hpp"

#include <nlohmann/json_fwd.hpp>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace stairwell::apps {

struct PathMeasures {
  double length_m = std::numeric_limits<double>::quiet_NaN();
  double clearance_m = std::numeric_limits<double>::quiet_NaN();  ///< least, from the path to anything solid
  double turn_deg = std::numeric_limits<double>::quiet_NaN();     ///< mean change of direction between steps (SPEC A14)
};

/// Steps of 0.12 m (SPEC A5), or of a voxel where voxels are larger.
PathMeasures measure_path(const KnownMap& map, const std::vector<Eigen::Vector3d>& path_m);

struct PlanRow {
  std::size_t task = 0;
  planning3d::PlanStatus status = planning3d::PlanStatus::kNoPath;
  PathMeasures measures;
  double ms = 0.0;      ///< on the wall
  double cpu_ms = 0.0;  ///< of this thread
  std::size_t nodes = 0;
  bool fell_back = false;  ///< the answer is the fallback's
  std::string reason;      ///< why, as "slice: no path"; also when nobody had an answer
  std::vector<Eigen::Vector3d> path_m;

  bool reached() const { return status == planning3d::PlanStatus::kReached; }
};

struct PlannerRows {
  std::string planner;    ///< as given: NAME or NAME@MS
  double setup_ms = 0.0;  ///< once per map, before the first task; not in the rows' times
  std::vector<PlanRow> rows;
};

struct PlanRunOptions {
  std::vector<std::string> planners;
  std::function<void(std::size_t done, std::size_t all)> progress;  ///< may be empty
  std::function<bool()> interrupted;                                ///< may be empty
  bool keep_paths = true;
  /// For each plan, of this thread's processor time, which other programs do not shorten; OMPL's planners then have no
  /// other limit. `NAME@MS` has its own. Infinite: none.
  double deadline_ms = std::numeric_limits<double>::infinity();
  planning3d::PlannerOptions planner_options;
  std::string fallback;  ///< asked when a planner has no answer that passes the safety check; empty: nobody
};

/// `NAME` or `NAME@MS`.
struct PlannerWord {
  std::string name;
  double deadline_ms = std::numeric_limits<double>::infinity();
};
/// @throws InputError for a deadline that is no positive number.
PlannerWord parse_planner_word(const std::string& word);

/// Names that `--planner` takes: planning3d's, and on .3dscen tasks `astar-plain`.
std::vector<std::string> known_planners(bool lattice);
/// @throws InputError listing the known names.
void require_known_planner(const std::string& name, bool lattice);

/// Every planner on every task, the planners in turn on each. On lattice tasks `astar` is the exact grid search and
/// `astar-plain` the textbook's. @throws InputError for a map that cannot be read or a task outside its map's box.
std::vector<PlannerRows> run_plan_tasks(const PlanTasks& tasks, const PlanRunOptions& options);

/// `tasks, reached, statuses, fell_back, mean_length_over_optimum, median_ms, ...` of one planner.
/// @param first  lengths are given over this one's too, for tasks that both answered without a fallback
nlohmann::ordered_json summary_of(const PlanTasks& tasks, const PlannerRows& rows, const PlannerRows& first);
nlohmann::ordered_json row_of(const PlanTasks& tasks, const PlanRow& row, bool with_path);

/// A line per planner, and one per task and planner unless there are too many.
std::string plan_table(const PlanTasks& tasks, const std::vector<PlannerRows>& planners);

}  // namespace stairwell::apps
