#include "apps/atomic_file.hpp"
#include "apps/commands.hpp"
#include "apps/models_dir.hpp"
#include "apps/option_values.hpp"
#include "apps/plan_run.hpp"
#include "apps/render.hpp"
#include "core/errors.hpp"
#include "planning3d/fallback_planner.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <ostream>
#include <sstream>

namespace stairwell::apps {

namespace {

using nlohmann::ordered_json;
using planning3d::PlanStatus;

constexpr std::size_t kMostDrawnPaths = 60;

constexpr const char* kFooter =
    "Examples:\n"
    "  stairwell plan runs/duplex/map.bt --from -9,0,1 --to 8,4,3.2 --planner theta\n"
    "  stairwell plan worlds/duplex.sdf --from 1,1,1 --to 7,4,4 --all --robot sphere:0.25 --out plans/duplex\n"
    "  stairwell plan --benchmark Complex.3dmap.3dscen --planner astar,astar-plain --json\n"
    "  stairwell plan --benchmark worlds/table_6_1.yaml --data data/thesis --planner astar,theta,apf\n"
    "  stairwell plan --benchmark worlds/cross_storey.yaml --data DIR --planner volume,slice --fallback astar\n"
    "A map counts as known: what is solid is occupied, the rest of its box is free.\n"
    "Exit codes: 0 planned, 1 no planner found a path (or interrupted), 2 bad input, start or goal.";

struct PlanWords {
  std::string map, from, to, box, robot, planners = "astar", attraction = "cone", fallback, out, benchmark, data,
                                         resolution;
  double margin_m = 0.0, clearance_weight = 1.0, deadline_ms = std::numeric_limits<double>::infinity();
  std::size_t most_tasks = 0;
  KnownMapOptions map_options;
  bool all = false, slice = false, experience = false, json = false, quiet = false;
};

std::vector<std::string> planners_of(const PlanWords& words, bool lattice) {
  if (words.all) return known_planners(lattice);
  std::vector<std::string> names;
  std::istringstream list(words.planners);
  for (std::string name; std::getline(list, name, ',');) {
    require_known_planner(parse_planner_word(name).name, lattice);
    names.push_back(name);
  }
  if (names.empty()) throw InputError("--planner: no name given");
  return names;
}

void require_usable_end(const std::string& option, const std::string& text, const Eigen::Vector3d& at_m,
                        const KnownMap& map, const Robot& robot) {
  const std::string what = option + " " + text + ": ";
  const Aabb box = map.box();
  if (!box.contains(at_m)) {
    std::ostringstream bounds;
    bounds << "[" << box.min_m.transpose() << "] to [" << box.max_m.transpose() << "]";
    throw InputError(what + "outside the map's box " + bounds.str());
  }
  if (map.map().at(at_m) == Occupancy::kOccupied) throw InputError(what + "inside a wall (the voxel is solid)");
  if (map.space(robot).sphere_free(at_m, robot.radius_m)) return;
  throw InputError(what + "the robot of radius " + format_number(robot.radius_m) + " m does not fit there (" +
                   format_number(std::round(1e3 * map.clearance_m(at_m)) / 1e3) + " m to the next wall)");
}

PlanTasks single_task(const PlanWords& words) {
  if (words.map.empty()) throw InputError("no map given: stairwell plan MAP --from x,y,z --to x,y,z (see --help)");
  if (words.from.empty() || words.to.empty()) throw InputError("give both --from x,y,z and --to x,y,z");
  PlanTasks tasks;
  tasks.name = std::filesystem::path(words.map).stem().string();
  tasks.maps.emplace_back(words.map);
  tasks.map_options = words.map_options;
  tasks.robot = parse_robot(words.robot.empty() ? "sphere:0.2" : words.robot);
  tasks.robot.margin_m = words.margin_m;
  tasks.clearance_weight = words.clearance_weight;
  tasks.slice = words.slice;
  if (!words.box.empty()) tasks.map_options.box = parse_box("--box", words.box);
  PlanTask task;
  task.name = words.from + " -> " + words.to;
  task.from_m = parse_point("--from", words.from);
  task.to_m = parse_point("--to", words.to);
  tasks.tasks.push_back(task);
  const KnownMap map = load_known_map(words.map, tasks.map_options);
  require_usable_end("--from", words.from, task.from_m, map, tasks.robot);
  require_usable_end("--to", words.to, task.to_m, map, tasks.robot);
  return tasks;
}

PlanTasks benchmark_tasks(const PlanWords& words) {
  if (!words.map.empty() || !words.from.empty() || !words.to.empty()) {
    throw InputError("--benchmark brings its own map and tasks: leave out MAP, --from and --to");
  }
  PlanTasks tasks = load_plan_tasks(words.benchmark, words.data, words.map_options);
  if (!words.robot.empty()) tasks.robot.radius_m = parse_robot(words.robot).radius_m;
  if (words.most_tasks > 0 && words.most_tasks < tasks.tasks.size()) {
    std::vector<PlanTask> some;  // spread evenly: scenarios are often sorted
    for (std::size_t i = 0; i < words.most_tasks; ++i) {
      some.push_back(tasks.tasks[i * tasks.tasks.size() / words.most_tasks]);
    }
    tasks.tasks = std::move(some);
  }
  return tasks;
}

/// A line that is redrawn, on a terminal only.
std::function<void(std::size_t, std::size_t)> progress_of(const PlanWords& words) {
  if (words.quiet || ::isatty(STDERR_FILENO) == 0) return {};
  return [](std::size_t done, std::size_t all) {
    if (all < 20 || (done % std::max<std::size_t>(1, all / 200) != 0 && done != all)) return;
    std::fprintf(stderr, done == all ? "\r\033[K" : "\r%zu of %zu tasks\033[K", done, all);
  };
}

void write_pictures(const PlanTasks& tasks, const std::vector<PlannerRows>& planners,
                    const std::filesystem::path& out) {
  for (std::size_t m = 0; m < tasks.maps.size(); ++m) {
    const KnownMap map = load_known_map(tasks.maps[m], tasks.map_options);
    RenderOptions options;
    options.view = tasks.slice ? RenderOptions::View::kTop : RenderOptions::View::kIso;
    for (const PlannerRows& rows : planners) {
      options.trajectories_m.clear();
      for (const PlanRow& row : rows.rows) {
        if (tasks.tasks[row.task].map != m || !row.reached()) continue;
        if (options.trajectories_m.size() < kMostDrawnPaths) options.trajectories_m.push_back(row.path_m);
      }
      const std::string stem = tasks.maps.size() > 1 ? tasks.maps[m].stem().string() + "-" : "";
      render_map_png(map.map(), options, out / (stem + rows.planner + ".png"));
    }
  }
}

std::string paths_csv(const PlanTasks& tasks, const std::vector<PlannerRows>& planners) {
  std::ostringstream text;
  text << "planner,task,point,x_m,y_m,z_m\n";
  for (const PlannerRows& rows : planners) {
    for (const PlanRow& row : rows.rows) {
      for (std::size_t i = 0; i < row.path_m.size(); ++i) {
        std::string task = tasks.tasks[row.task].name;
        std::ranges::replace(task, ',', ' ');
        text << rows.planner << ',' << task << ',' << i << ',' << row.path_m[i].x() << ',' << row.path_m[i].y() << ','
             << row.path_m[i].z() << '\n';
      }
    }
  }
  return text.str();
}

ordered_json report_of(const PlanTasks& tasks, const std::vector<PlannerRows>& planners, bool single, bool with_rows) {
  ordered_json report;
  report["benchmark"] = tasks.name;
  ordered_json list = ordered_json::array();
  for (const PlannerRows& rows : planners) {
    ordered_json one = single && !rows.rows.empty() ? row_of(tasks, rows.rows.front(), true)
                                                    : summary_of(tasks, rows, planners.front());
    if (single) one = ordered_json{{"planner", rows.planner}, {"setup_ms", rows.setup_ms}, {"result", one}};
    if (single) {
      const ordered_json result = one.at("result");
      one.erase("result");
      one.update(result);
    } else if (with_rows) {
      one["rows"] = ordered_json::array();
      for (const PlanRow& row : rows.rows) one["rows"].push_back(row_of(tasks, row, false));
    }
    list.push_back(std::move(one));
  }
  report.update(list.front());  // of one planner the report is that of the planner
  if (list.size() > 1) report["planners"] = list;
  return report;
}

void plan(const PlanWords& words, CommandContext& context) {
  const bool single = words.benchmark.empty();
  const PlanTasks tasks = single ? single_task(words) : benchmark_tasks(words);
  PlanRunOptions options;
  options.planners = planners_of(words, tasks.lattice);
  options.deadline_ms = words.deadline_ms;
  options.fallback = words.fallback == "none" ? "" : words.fallback;
  if (!options.fallback.empty()) planning3d::resolve_fallback(options.fallback, {});
  options.planner_options.models_dir = models_dir();
  options.planner_options.experience = words.experience;
  if (words.attraction == "geodesic") options.planner_options.attraction = planning3d::Attraction::kGeodesic;
  options.progress = progress_of(words);
  options.interrupted = [&context] { return context.interrupted != 0; };
  options.keep_paths = single || !words.out.empty();
  const std::vector<PlannerRows> planners = run_plan_tasks(tasks, options);
  const ordered_json report = report_of(tasks, planners, single, tasks.tasks.size() <= 1000);
  if (!words.out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(words.out, error);
    if (error) throw RunError(words.out + ": the folder cannot be made: " + error.message());
    write_file_atomically(std::filesystem::path(words.out) / "plan.json", report.dump(2) + "\n");
    write_file_atomically(std::filesystem::path(words.out) / "paths.csv", paths_csv(tasks, planners));
    write_pictures(tasks, planners, words.out);
  }
  if (words.json) {
    context.out << report.dump(2) << "\n";
  } else {
    context.out << plan_table(tasks, planners);
  }
  const bool any = std::ranges::any_of(
      planners, [](const PlannerRows& rows) { return std::ranges::any_of(rows.rows, &PlanRow::reached); });
  if (!any || context.interrupted != 0) context.exit_code = 1;
}

}  // namespace

void add_plan_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("plan", "Plan paths on a known map and measure the planners");
  auto words = std::make_shared<PlanWords>();
  command->add_option("MAP", words->map, "Map or world: .bt .ot .3dmap .sdf .stl .obj .dae .ply .glb .pcd .yaml");
  command->add_option("--from", words->from, "Start")->type_name("x,y,z");
  command->add_option("--to", words->to, "Goal")->type_name("x,y,z");
  command->add_option("--box", words->box, "Where to plan (default: the map's box)")->type_name("x0,y0,z0,x1,y1,z1");
  command->add_option("--planner", words->planners, "Planner, or several with commas between")->capture_default_str();
  command
      ->add_option("--deadline-ms", words->deadline_ms,
                   "For each plan, processor time; NAME@MS gives a planner its own")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--fallback", words->fallback, "Planner that is asked when one has no safe answer (default: none)")
      ->type_name("NAME");
  command->add_option("--attraction", words->attraction, "Of apf to the goal: as the crow flies, or round obstacles")
      ->check(CLI::IsMember({"cone", "geodesic"}))
      ->capture_default_str();
  command->add_flag("--experience", words->experience, "apf fills the local minima that it is caught in");
  command->add_flag("--all", words->all, "Every planner");
  command->add_option("--robot", words->robot, "sphere:R or box:LxWxH, metres (default: sphere:0.2)");
  command->add_option("--margin", words->margin_m, "Kept beyond the robot, metres")->check(CLI::Range(0.0, 100.0));
  command->add_option("--clearance-weight", words->clearance_weight, "Extra cost near walls; 0: shortest path")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_flag("--slice", words->slice, "Horizontal moves only at the heights of start and goal");
  command->add_option("--benchmark", words->benchmark, "Tasks: a Moving AI scenario or a YAML list")
      ->type_name("FILE.3dscen|FILE.yaml");
  command->add_option("--data", words->data, "Folder of a benchmark's maps (default: beside it)")->type_name("DIR");
  command->add_option("--tasks", words->most_tasks, "Only this many of a benchmark's tasks, spread evenly");
  command
      ->add_option("--resolution", words->map_options.resolution_m, "Edge of the voxels (default: the file's, or 0.1)")
      ->check(CLI::PositiveNumber);
  add_world_options(*command, words->map_options.world);
  command->add_option("--out", words->out, "Folder for plan.json, paths.csv and a PNG per planner")->type_name("DIR");
  command->add_flag("--json", words->json, "For machines");
  command->add_flag("--quiet", words->quiet, "No progress on standard error");
  command->footer(kFooter);
  command->callback([words, &context] { plan(*words, context); });
}

}  // namespace stairwell::apps
