#include "apps/plan_run.hpp"

#include "apps/option_values.hpp"
#include "core/errors.hpp"
#include "core/units.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/fallback_planner.hpp"
#include "planning3d/grid_search.hpp"
#include "planning3d/theta_planner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <optional>

namespace stairwell::apps {

using planning3d::FreeSpace;
using planning3d::Planner;
using planning3d::PlanRequest;
using planning3d::PlanResult;
using planning3d::PlanStatus;

namespace {

constexpr double kStep_m = 0.12;  // SPEC A5
constexpr const char* kPlain = "astar-plain";

double wall_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// The grid searches as planners of one map: paths from cell to cell.
class LatticePlanner final : public Planner {
 public:
  LatticePlanner(const FreeSpace& space, bool plain) : graph_(space.grid().size(), free_cells(space)) {
    if (plain) {
      plain_.emplace(graph_);
    } else {
      fast_.emplace(graph_);
    }
  }
  std::string_view name() const override { return plain_ ? kPlain : "astar"; }

  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override {
    const VoxelIndex start = space.grid().index_of(request.start_m);
    const VoxelIndex goal = space.grid().index_of(request.goal_m);
    planning3d::GridPath path = plain_ ? plain_->search(start, goal) : fast_->search(start, goal);
    PlanResult result;
    result.status = path.status;
    result.expansions = path.expansions;
    if (path.status != PlanStatus::kReached) return result;
    result.length_m = path.length * space.grid().resolution_m();
    for (const VoxelIndex& v : path.cells) result.path_m.push_back(space.grid().center_of(v));
    if (result.path_m.size() == 1) result.path_m.push_back(result.path_m.front());
    return result;
  }

 private:
  static std::vector<std::uint8_t> free_cells(const FreeSpace& space) {
    std::vector<std::uint8_t> free(space.grid().voxel_count());
    for (std::size_t i = 0; i < free.size(); ++i) free[i] = space.traversable(space.grid().voxel(i)) ? 1 : 0;
    return free;
  }

  planning3d::MoveGraph graph_;
  std::optional<planning3d::GridAstar> fast_;
  std::optional<planning3d::PlainGridAstar> plain_;
};

std::unique_ptr<Planner> planner_for(const std::string& name, const PlanTasks& tasks, const PlanRunOptions& options,
                                     const FreeSpace& space) {
  if (tasks.lattice && (name == "astar" || name == kPlain))
    return std::make_unique<LatticePlanner>(space, name == kPlain);
  if (std::isfinite(tasks.comfort_m) && name == "astar") {
    return std::make_unique<planning3d::AstarPlanner>(planning3d::AstarPlanner::Config{1.0, tasks.comfort_m, true});
  }
  if (std::isfinite(tasks.comfort_m) && name == "theta") {
    return std::make_unique<planning3d::ThetaPlanner>(planning3d::ThetaPlanner::Config{1.0, tasks.comfort_m, true});
  }
  return planning3d::make_planner(name, options.planner_options);
}

PlanRequest request_of(const PlanTasks& tasks, const PlanTask& task) {
  PlanRequest request;
  request.start_m = task.from_m;
  request.goal_m = task.to_m;
  request.clearance_weight = tasks.clearance_weight;
  if (tasks.slice) request.rule = planning3d::MotionRule::slice({task.from_m.z(), task.to_m.z()});
  return request;
}

/// A planner of one map with what may answer in its place, and its deadline.
struct Contestant {
  std::unique_ptr<Planner> alone;
  std::unique_ptr<planning3d::FallbackPlanner> with_fallback;
  double deadline_ms;
};

Contestant contestant_for(const std::string& text, const PlanTasks& tasks, const PlanRunOptions& options,
                          const FreeSpace& space) {
  const PlannerWord word = parse_planner_word(text);
  Contestant made{planner_for(word.name, tasks, options, space), {}, std::min(word.deadline_ms, options.deadline_ms)};
  if (options.fallback.empty()) return made;
  std::vector<std::unique_ptr<Planner>> fallbacks;
  const auto name = planning3d::resolve_fallback(options.fallback, word.name);
  if (!name.empty()) fallbacks.push_back(planner_for(std::string(name), tasks, options, space));
  made.with_fallback = std::make_unique<planning3d::FallbackPlanner>(std::move(made.alone), std::move(fallbacks));
  return made;
}

PlanRow run_one(Contestant& planner, const FreeSpace& space, PlanRequest request, PlanResult& result) {
  PlanRow row;
  const double wall_begin_ms = wall_ms();
  const double cpu_begin_ms = thread_ms();
  if (std::isfinite(planner.deadline_ms)) {
    request.clock_s = [] { return 1e-3 * thread_ms(); };
    request.deadline_s = 1e-3 * (cpu_begin_ms + planner.deadline_ms);
    request.max_checks = std::numeric_limits<std::size_t>::max();
  }
  if (planner.with_fallback) {
    planning3d::FallbackResult decided = planner.with_fallback->decide(space, request);
    row.fell_back = decided.fell_back();
    row.reason = decided.reason();
    result = std::move(decided.plan);
  } else {
    result = planner.alone->plan(space, request);
  }
  row.cpu_ms = thread_ms() - cpu_begin_ms;
  row.ms = wall_ms() - wall_begin_ms;
  row.status = result.status;
  row.nodes = result.expansions;
  return row;
}

void require_inside(const PlanTasks& tasks, const PlanTask& task, const KnownMap& map) {
  for (const Eigen::Vector3d& at_m : {task.from_m, task.to_m}) {
    if (map.box().contains(at_m)) continue;
    throw InputError(tasks.file.string() + ", " + task.name + ": outside the box of " + tasks.maps[task.map].string());
  }
}

}  // namespace

PathMeasures measure_path(const KnownMap& map, const std::vector<Eigen::Vector3d>& path_m) {
  PathMeasures measures;
  if (path_m.empty()) return measures;
  const double step_m = std::max(kStep_m, map.map().grid().resolution_m());
  measures.length_m = 0.0;
  measures.clearance_m = map.clearance_m(path_m.front());
  std::vector<Eigen::Vector3d> steps_m{path_m.front()};
  double since_step_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    const Eigen::Vector3d leg_m = path_m[i + 1] - path_m[i];
    const double length_m = leg_m.norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length_m / (0.25 * map.map().grid().resolution_m()))));
    for (int k = 1; k <= pieces; ++k) {
      const double clearance_m = map.clearance_m(path_m[i] + static_cast<double>(k) / pieces * leg_m);
      measures.clearance_m = std::min(measures.clearance_m, clearance_m);
    }
    double along_m = step_m - since_step_m;
    for (; along_m <= length_m; along_m += step_m) steps_m.emplace_back(path_m[i] + along_m / length_m * leg_m);
    since_step_m = length_m - (along_m - step_m);
    measures.length_m += length_m;
  }
  double turned_rad = 0.0;
  for (std::size_t i = 1; i + 1 < steps_m.size(); ++i) {
    const Eigen::Vector3d in_m = steps_m[i] - steps_m[i - 1];
    const Eigen::Vector3d out_m = steps_m[i + 1] - steps_m[i];
    turned_rad += std::atan2(in_m.cross(out_m).norm(), in_m.dot(out_m));
  }
  measures.turn_deg = steps_m.size() > 2 ? deg_from_rad(turned_rad / static_cast<double>(steps_m.size() - 2)) : 0.0;
  return measures;
}

std::vector<std::string> known_planners(bool lattice) {
  std::vector<std::string> names;
  for (const std::string_view name : planning3d::planner_names()) names.emplace_back(name);
  if (lattice) names.emplace_back(kPlain);
  return names;
}

PlannerWord parse_planner_word(const std::string& word) {
  PlannerWord parsed{word};
  const std::size_t at = word.find('@');
  if (at == std::string::npos) return parsed;
  parsed.name = word.substr(0, at);
  parsed.deadline_ms = parse_number(word.substr(at + 1));
  if (!(parsed.deadline_ms > 0.0)) throw InputError("planner '" + word + "': the deadline must be positive");
  return parsed;
}

void require_known_planner(const std::string& name, bool lattice) {
  const std::vector<std::string> names = known_planners(lattice);
  if (std::ranges::find(names, name) != names.end()) return;
  std::string message = "--planner " + name + ": unknown; known are";
  for (const std::string& known : names) message += " " + known;
  throw InputError(message);
}

std::vector<PlannerRows> run_plan_tasks(const PlanTasks& tasks, const PlanRunOptions& options) {
  std::vector<PlannerRows> all;
  for (const std::string& name : options.planners) {
    require_known_planner(parse_planner_word(name).name, tasks.lattice);
    all.push_back({name, 0.0, {}});
  }
  std::size_t done = 0;
  for (std::size_t m = 0; m < tasks.maps.size(); ++m) {
    const KnownMap map = load_known_map(tasks.maps[m], tasks.map_options);
    const FreeSpace space = map.space(tasks.robot);
    std::vector<Contestant> planners;
    for (PlannerRows& rows : all) {
      const double begin_ms = wall_ms();
      planners.push_back(contestant_for(rows.planner, tasks, options, space));
      rows.setup_ms += wall_ms() - begin_ms;
    }
    for (std::size_t t = 0; t < tasks.tasks.size(); ++t) {
      if (tasks.tasks[t].map != m) continue;
      require_inside(tasks, tasks.tasks[t], map);
      const PlanRequest request = request_of(tasks, tasks.tasks[t]);
      for (std::size_t p = 0; p < planners.size(); ++p) {
        if (options.interrupted && options.interrupted()) return all;
        PlanResult result;
        PlanRow row = run_one(planners[p], space, request, result);
        row.task = t;
        if (row.reached()) row.measures = measure_path(map, result.path_m);
        if (options.keep_paths) row.path_m = std::move(result.path_m);
        all[p].rows.push_back(std::move(row));
      }
      if (options.progress) options.progress(++done, tasks.tasks.size());
    }
  }
  return all;
}

}  // namespace stairwell::apps
