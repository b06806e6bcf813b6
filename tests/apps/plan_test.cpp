#include "apps/cli.hpp"
#include "apps/known_map.hpp"
#include "apps/plan_run.hpp"
#include "apps/plan_tasks.hpp"
#include "core/errors.hpp"
#include "run_words.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace stairwell::apps {

using Catch::Contains;
using testing::fresh_folder;
using testing::Outcome;
using testing::run;
using testing::write_text;

namespace {

void require_refused(const std::vector<std::string>& words, const std::string& text) {
  const Outcome outcome = run(words);
  CAPTURE(words, outcome.err);
  CHECK(outcome.code == kExitBadInput);
  CHECK(outcome.out.empty());
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK_THAT(outcome.err, Contains(text));
}

/// 7 x 5 x 1 cells; a wall of one cell's thickness across at x = 3 that leaves y = 4 open.
std::filesystem::path write_cells(const std::filesystem::path& folder) {
  return write_text(folder / "wall.3dmap", "voxel 7 5 1\n3 0 0\n3 1 0\n3 2 0\n3 3 0\n");
}

/// Corners may not be cut: (1,1) -> (2,2) -> (2,3) -> (2,4) -> (3,4) -> (4,4) and so on.
const double kRoundWall = std::sqrt(2.0) + 2.0 + 2.0 + 2.0 + std::sqrt(2.0);

std::filesystem::path write_scenario(const std::filesystem::path& folder, const std::string& rows) {
  write_cells(folder);
  return write_text(folder / "wall.3dmap.3dscen", "version 1\nwall.3dmap\n" + rows);
}

}  // namespace

TEST_CASE("a scenario's tasks are read, planned at the optimum and summed up") {
  const auto folder = fresh_folder("plan_scenario");
  std::ostringstream rows;
  rows.precision(12);
  rows << "1 1 0 5 1 0 " << kRoundWall << " 2.2\n0 0 0 2 0 0 2 1\n";
  const auto file = write_scenario(folder, rows.str());
  const PlanTasks tasks = load_plan_tasks(file, {}, {});
  REQUIRE(tasks.tasks.size() == 2);
  CHECK(tasks.lattice);
  CHECK(tasks.tasks[0].from_m == Eigen::Vector3d(1.5, 1.5, 0.5));
  CHECK(tasks.tasks[0].to_m == Eigen::Vector3d(5.5, 1.5, 0.5));
  CHECK(tasks.tasks[0].detour == 2.2);
  const Outcome outcome = run({"plan", "--benchmark", file.string(), "--planner", "astar,astar-plain,theta", "--json"});
  REQUIRE(outcome.code == 0);
  const auto report = outcome.json();
  for (const char* key : {"tasks", "reached", "optimal_cost_matches", "mean_length_over_optimum", "median_ms", "p95_ms",
                          "max_ms", "mean_clearance_m", "mean_turn_deg"}) {
    CHECK(report.contains(key));
  }
  CHECK(report.at("planner") == "astar");
  REQUIRE(report.at("planners").size() == 3);
  for (const auto& planner : report.at("planners")) {
    CHECK(planner.at("tasks") == 2);
    CHECK(planner.at("reached") == 2);
    CHECK(planner.at("detour_tasks") == 1);
    const bool lattice = planner.at("planner") != "theta";
    CHECK(planner.at("optimal_cost_matches") == (lattice ? 2 : 1));
    const double ratio = planner.at("mean_length_over_optimum_detours").get<double>();
    if (lattice) CHECK(ratio == Approx(1.0));
    // Any-angle: around the two corners (3,4) and (4,4), passed closely.
    if (!lattice) CHECK(ratio * kRoundWall >= 2.0 * std::hypot(1.5, 2.5) + 1.0);
    if (!lattice) CHECK(ratio < 0.99);
  }
}

TEST_CASE("bad scenarios are named with their line") {
  const auto folder = fresh_folder("plan_bad_scenarios");
  const auto refuse = [&](const std::string& content, const std::string& text) {
    write_cells(folder);
    const auto file = write_text(folder / "bad.3dscen", content);
    require_refused({"plan", "--benchmark", file.string()}, text);
    require_refused({"plan", "--benchmark", file.string()}, "bad.3dscen");
  };
  refuse("", "bad.3dscen");
  refuse("version 2\nwall.3dmap\n", "version 1");
  refuse("version 1\n\n", "name the map");
  refuse("version 1\nnone.3dmap\n1 1 0 2 1 0 1 1\n", "none.3dmap");
  refuse("version 1\nwall.3dmap\n", "no task");
  refuse("version 1\nwall.3dmap\n1 1 0 2 1 0 1\n", ":3: a task needs eight numbers");
  refuse("version 1\nwall.3dmap\n1 1 0 2 1 0 1 1 9\n", ":3: more than eight");
  refuse("version 1\nwall.3dmap\n0 0 0 1 0 0 1 1\n1 1 0 x 1 0 1 1\n", ":4: ");
  refuse("version 1\nwall.3dmap\n1.5 1 0 2 1 0 1 1\n", "whole numbers");
  refuse("version 1\nwall.3dmap\n1 1 0 7 1 0 1 1\n", "outside the box");
  require_refused({"plan", "--benchmark", (folder / "no.3dscen").string()}, "no.3dscen");
  require_refused({"plan", "--benchmark", (folder / "wall.3dmap").string()}, ".3dscen or .yaml");
}

TEST_CASE("a YAML of tasks: every key, every complaint") {
  const auto folder = fresh_folder("plan_yaml");
  write_cells(folder);
  const std::string good =
      "robot: sphere:0.1\nmargin_m: 0.05\nclearance_weight: 2\nmode: slice\ncomfort_m: 0.3\ntasks:\n"
      "  - {name: round, map: wall.3dmap, from: [1.5, 1.5, 0.5], to: [5.5, 1.5, 0.5], optimum_m: 6.8}\n"
      "  - {map: wall.3dmap, from: [1.5, 1.5, 0.5], to: [3.5, 1.5, 0.5]}\n";
  const auto file = write_text(folder / "tasks.yaml", good);
  const PlanTasks tasks = load_plan_tasks(file, {}, {});
  CHECK(tasks.robot.radius_m == 0.1);
  CHECK(tasks.robot.margin_m == 0.05);
  CHECK(tasks.clearance_weight == 2.0);
  CHECK(tasks.slice);
  CHECK(tasks.comfort_m == 0.3);
  CHECK(tasks.maps.size() == 1);
  CHECK(tasks.tasks[1].name == "task 2");
  const Outcome outcome = run({"plan", "--benchmark", file.string(), "--planner", "theta", "--json"});
  CHECK(outcome.code == 0);
  CHECK(outcome.json().at("reached") == 1);  // the other goal is in the wall
  CHECK(outcome.json().at("rows").at(1).at("status") == "goal blocked");
  const auto moved = write_text(fresh_folder("plan_yaml_moved") / "tasks.yaml", good);
  require_refused({"plan", "--benchmark", moved.string()}, "--data");
  CHECK(run({"plan", "--benchmark", moved.string(), "--data", folder.string()}).code == 0);
  const auto refuse = [&](const std::string& content, const std::string& text) {
    require_refused({"plan", "--benchmark", write_text(folder / "bad.yaml", content).string()}, text);
  };
  refuse("tasks: [", "bad.yaml");
  refuse("tasks: 3\n", "list");
  refuse("tasks: []\n", "no task");
  refuse("speed: 3\ntasks: []\n", "bad.yaml:1: unknown key 'speed'");
  refuse("mode: sideways\ntasks: []\n", "slice or volume");
  refuse("robot: cube\ntasks: []\n", "'cube'");
  refuse("tasks:\n  - {map: wall.3dmap, from: [1, 2], to: [1, 2, 3]}\n", "bad.yaml:2: key 'from'");
  refuse("tasks:\n  - {map: wall.3dmap, from: [1, 2, .nan], to: [1, 2, 3]}\n", "key 'from'");
  refuse("tasks:\n  - {from: [1, 2, 0], to: [1, 2, 3]}\n", "'map'");
}

TEST_CASE("one plan: measured, drawn; its ends are checked by name") {
  const auto folder = fresh_folder("plan_one");
  const std::string room = testing::write_room(folder).string();
  const auto plan = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"plan", room};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const std::string out = (folder / "out").string();
  const Outcome outcome =
      run(plan({"--from", "-1,-1,1", "--to", "1,-1,1", "--planner", "astar,theta,apf", "--json", "--out", out}));
  REQUIRE(outcome.code == 0);
  const auto report = outcome.json();
  REQUIRE(report.at("planners").size() == 3);
  for (const auto& planner : report.at("planners")) {
    if (planner.at("planner") == "apf") {
      CHECK(planner.at("status") == "local minimum");
      CHECK(planner.at("length_m").is_null());
      continue;
    }
    CHECK(planner.at("reached") == true);
    // The taut way round the wall's end at (-0.1..0.1, 0.3), kept off by the robot's radius.
    CHECK(planner.at("length_m").get<double>() > 2.0 * std::hypot(0.9, 1.3));
    CHECK(planner.at("length_m").get<double>() < 4.9);
    CHECK(planner.at("clearance_m").get<double>() >= 0.199);
    CHECK(planner.at("clearance_m").get<double>() < 0.8);
    CHECK(planner.at("turn_deg").get<double>() > 1.0);
    CHECK(planner.at("path_m").front() == nlohmann::json::array({-1.0, -1.0, 1.0}));
  }
  for (const char* file : {"plan.json", "paths.csv", "astar.png", "theta.png"}) {
    CHECK(std::filesystem::file_size(folder / "out" / file) > 50);
  }
  CHECK(run(plan({"--from", "-1,-1,1", "--to", "1,-1,1", "--planner", "apf"})).code == 1);
  CHECK_THAT(run(plan({"--from", "-1,-1,1", "--to", "1,-1,1", "--planner", "apf"})).out, Contains("local minimum"));
  CHECK_THAT(run(plan({"--from", "-1,-0.7,1", "--to", "1,-0.7,1", "--robot", "sphere:0.6", "--planner", "theta"})).out,
             Contains("no path"));
  require_refused(plan({"--from", "0,0,1", "--to", "1,1,1"}), "--from 0,0,1: inside a wall");
  require_refused(plan({"--from", "1,1,1", "--to", "0,0,1"}), "--to 0,0,1: inside a wall");
  require_refused(plan({"--from", "1,1,1", "--to", "1,1,nan"}), "--to 1,1,nan");
  require_refused(plan({"--from", "1,1,1", "--to", "9,1,1"}), "--to 9,1,1: outside the map's box");
  CHECK(run(plan({"--from", "1,1,1", "--to", "9,1,4", "--box", "-3,-3,-1,10,3,5", "--quiet"})).code == 1);  // shut in
  CHECK(run(plan({"--from", "4,1,1", "--to", "9,1,4", "--box", "-3,-3,-1,10,3,5", "--quiet"})).code == 0);
  require_refused(plan({"--from", "1,1,1", "--to", "1,0,1", "--box", "1,1,1,0,2,2"}), "no volume");
  require_refused(plan({"--from", "1,1,1", "--to", "1,0,1", "--box", "1,1"}), "--box 1,1");
  require_refused(plan({"--from", "1.85,1,1", "--to", "1,1,1"}), "does not fit");
  require_refused(plan({"--from", "1,1", "--to", "1,1,1"}), "--from 1,1");
  require_refused(plan({"--from", "1,1,1"}), "--to");
  require_refused({"plan"}, "no map");
  require_refused(plan({"--from", "1,1,1", "--to", "1,0,1", "--planner", "magic"}), "theta");
  require_refused(plan({"--from", "1,1,1", "--to", "1,0,1", "--planner", "astar-plain"}), "astar-plain");
  require_refused(plan({"--from", "1,1,1", "--to", "1,0,1", "--robot", "ball"}), "'ball'");
  require_refused(plan({"--from", "1,1,1", "--to", "1,0,1", "--resolution", "0"}), "--resolution");
  require_refused(plan({"--benchmark", "a.yaml"}), "leave out");
  require_refused({"plan", (folder / "no.bt").string(), "--from", "1,1,1", "--to", "1,0,1"}, "no.bt");
}

TEST_CASE("every planner: a closed goal is no path, ends that cannot be are refused") {
  const auto folder = fresh_folder("plan_every_planner");
  const std::string room = testing::write_room(folder).string();
  const std::string box = "-3,-3,-1,6,3,4";
  const Outcome closed =
      run({"plan", room, "--from", "5,1,1", "--to", "1,1,1", "--box", box, "--all", "--deadline-ms", "150", "--json"});
  CHECK(closed.code == 1);
  const auto report = closed.json();
  REQUIRE(report.at("planners").size() == known_planners(false).size());
  for (const auto& planner : report.at("planners")) {
    INFO(planner.dump());
    CHECK(planner.at("status") == "no path");
    CHECK(planner.at("cpu_ms").get<double>() < 1.1 * 150.0 + 5.0);
  }
  for (const std::string& name : known_planners(false)) {
    const auto refused = [&](const char* from, const char* to, const char* text) {
      require_refused({"plan", room, "--from", from, "--to", to, "--planner", name}, text);
    };
    refused("0,0,1", "1,1,1", "--from 0,0,1: inside a wall");
    refused("1,1,1", "0,0,1", "--to 0,0,1: inside a wall");
    refused("1,1,nan", "1,1,1", "--from 1,1,nan");
    refused("1,1,1", "9,1,1", "--to 9,1,1: outside the map's box");
  }
}

TEST_CASE("options of the planners: attraction, experience, deadlines, fallback") {
  const auto folder = fresh_folder("plan_options");
  const std::string room = testing::write_room(folder).string();
  const auto plan = [&](const std::string& planners, const std::vector<std::string>& more) {
    std::vector<std::string> words{"plan",   room,     "--from",    "-1,-1,1", "--to",
                                   "1,-1,1", "--json", "--planner", planners};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  CHECK(run(plan("apf", {})).json().at("status") == "local minimum");
  CHECK(run(plan("apf", {"--attraction", "geodesic"})).json().at("status") == "reached");
  CHECK(run(plan("apf", {"--experience"})).json().at("status") == "reached");
  const auto helped = run(plan("apf,slice", {"--fallback", "auto"})).json().at("planners");
  CHECK(helped.at(0).at("status") == "reached");
  CHECK(helped.at(0).at("fell_back") == true);
  CHECK(helped.at(0).at("reason") == "apf: local minimum");
  CHECK(helped.at(1).at("fell_back") == false);
  CHECK(run(plan("astar@0.0001", {})).json().at("status") == "timed out");
  CHECK(run(plan("astar", {"--deadline-ms", "0.0001"})).json().at("status") == "timed out");
  CHECK(run(plan("bitstar@200", {"--deadline-ms", "5000"})).json().at("planner") == "bitstar@200");
  require_refused(plan("astar@soon", {}), "soon");
  require_refused(plan("astar@0", {}), "astar@0");
  require_refused(plan("magic@5", {}), "magic");
  require_refused(plan("astar", {"--deadline-ms", "-1"}), "--deadline-ms");
  require_refused(plan("apf", {"--attraction", "sideways"}), "--attraction");
  require_refused(plan("apf", {"--fallback", "magic"}), "magic");
}

TEST_CASE("random pairs of places on different storeys") {
  const auto folder = fresh_folder("plan_pairs");
  int vertices = 0;  // two storeys of 2 m and a slab with an opening
  std::string house = testing::obj_box({-0.2, -0.2, -0.2}, {4.2, 3.2, 0.0}, vertices);
  house += testing::obj_box({-0.2, -0.2, 4.3}, {4.2, 3.2, 4.5}, vertices);
  house += testing::obj_box({-0.2, -0.2, 0.0}, {0.0, 3.2, 4.3}, vertices);
  house += testing::obj_box({4.0, -0.2, 0.0}, {4.2, 3.2, 4.3}, vertices);
  house += testing::obj_box({0.0, -0.2, 0.0}, {4.0, 0.0, 4.3}, vertices);
  house += testing::obj_box({0.0, 3.0, 0.0}, {4.0, 3.2, 4.3}, vertices);
  house += testing::obj_box({0.0, 0.0, 2.0}, {3.0, 3.0, 2.3}, vertices);
  write_text(folder / "house.obj", house);
  testing::write_room(folder);
  const auto file_of = [&](const std::string& pairs) {
    return write_text(folder / "pairs.yaml", "robot: sphere:0.2\nclearance_weight: 0\npairs: " + pairs + "\n");
  };
  const auto tasks_of = [&](const std::string& pairs) { return load_plan_tasks(file_of(pairs), {}, {}).tasks; };
  const auto tasks = tasks_of("{map: house.obj, count: 25, seed: 4, cross_storey: true}");
  REQUIRE(tasks.size() == 25);
  for (const PlanTask& task : tasks) {
    CHECK(std::min(task.from_m.z(), task.to_m.z()) < 2.3);
    CHECK(std::max(task.from_m.z(), task.to_m.z()) > 2.3);
  }
  const auto again = tasks_of("{map: house.obj, count: 25, seed: 4, cross_storey: true}");
  const auto other = tasks_of("{map: house.obj, count: 25, seed: 5, cross_storey: true}");
  CHECK((again[7].from_m == tasks[7].from_m && again[24].to_m == tasks[24].to_m));
  CHECK(other[7].from_m != tasks[7].from_m);
  const Outcome outcome =
      run({"plan", "--benchmark", file_of("{map: house.obj, count: 25, cross_storey: yes}").string(), "--planner",
           "volume,slice,apf", "--fallback", "astar", "--json"});
  REQUIRE(outcome.code == 0);
  const auto planners = outcome.json().at("planners");
  for (const auto& planner : planners) CHECK(planner.at("reached") == 25);
  CHECK(planners.at(0).at("fell_back") == 0);
  CHECK(planners.at(1).at("fell_back") == 0);
  CHECK(planners.at(1).at("length_over") == "volume");
  CHECK(planners.at(1).at("median_length_over") > 1.0);
  CHECK(planners.at(1).at("median_length_over") < 1.5);
  CHECK(planners.at(2).at("fell_back") > 0);
  CHECK(planners.at(2).at("fallback_reasons").contains("apf: local minimum"));
  const auto refuse = [&](const std::string& pairs, const std::string& text) {
    require_refused({"plan", "--benchmark", file_of(pairs).string()}, text);
  };
  refuse("{map: room.obj, count: 5, cross_storey: true}", "fewer than two storeys");
  refuse("{map: house.obj, count: 0}", "no task");
  refuse("{map: house.obj, count: many}", "many");
  refuse("{map: house.obj, count: 1000000}", "at most");
  refuse("{count: 5}", "'map'");
  refuse("{map: house.obj, colour: 5}", "colour");
}

TEST_CASE("known maps: solids of voxel files are kept exactly, meshes are filled") {
  const auto folder = fresh_folder("known_maps");
  const KnownMap cells = load_known_map(write_cells(folder), {});
  CHECK(cells.map().grid().size() == std::array<int, 3>{7, 5, 1});
  CHECK(cells.map().occupied_voxels() == 4);
  CHECK(cells.map().known_voxels() == 35);
  CHECK(cells.clearance_m({1.5, 1.5, 0.5}) == Approx(1.5));
  CHECK(cells.clearance_m({2.5, 4.5, 0.5}) == Approx(std::hypot(0.5, 0.5)));
  CHECK(cells.clearance_m({3.5, 1.5, 0.5}) == 0.0);
  KnownMapOptions finer;
  finer.resolution_m = 0.25;
  CHECK(load_known_map(folder / "wall.3dmap", finer).map().occupied_voxels() == 4 * 64);
  int vertices = 0;
  std::string boxes = testing::obj_box({0.05, 0.05, 0.05}, {1.15, 0.95, 0.85}, vertices);
  boxes += testing::obj_box({0.55, 0.35, 0.25}, {1.95, 0.75, 0.65}, vertices);
  const auto block = write_text(folder / "block.obj", boxes);
  const KnownMap filled = load_known_map(block, {});  // two solids, one partly inside the other
  for (const Eigen::Vector3d& inside_m : {Eigen::Vector3d(0.4, 0.5, 0.5), {0.9, 0.5, 0.5}, {1.6, 0.55, 0.45}}) {
    CHECK(filled.map().at(inside_m) == Occupancy::kOccupied);
  }
  CHECK(filled.map().at(Eigen::Vector3d(1.55, 0.15, 0.15)) == Occupancy::kFree);
}

TEST_CASE("turns are measured between steps") {
  const auto folder = fresh_folder("turns");
  KnownMapOptions fine;
  fine.resolution_m = 0.1;
  const KnownMap map = load_known_map(write_cells(folder), fine);
  const PathMeasures straight = measure_path(map, {{0.5, 0.5, 0.5}, {0.5, 1.0, 0.5}, {0.5, 2.3, 0.5}});
  CHECK(straight.length_m == Approx(1.8));
  CHECK(straight.turn_deg == Approx(0.0).margin(1e-3));
  // 0.96 m each way in steps of 0.12 m: one of the 15 changes of direction is a right angle.
  const PathMeasures corner = measure_path(map, {{0.5, 0.5, 0.5}, {1.46, 0.5, 0.5}, {1.46, 1.4601, 0.5}});
  CHECK(corner.turn_deg == Approx(90.0 / 15.0).epsilon(0.02));
  CHECK(std::isnan(measure_path(map, {}).length_m));
}

TEST_CASE("published lengths of voxel scenarios") {
  const std::filesystem::path data = std::filesystem::path(STAIRWELL_SOURCE_DIR) / "../shared/data/planning";
  for (const char* name : {"Simple.3dmap.3dscen", "Complex.3dmap.3dscen"}) {
    if (!std::filesystem::exists(data / name)) {
      WARN("skipped: " << (data / name).string() << " is not there");
      continue;
    }
    const Outcome outcome =
        run({"plan", "--benchmark", (data / name).string(), "--planner", "astar,theta", "--tasks", "60", "--json"});
    REQUIRE(outcome.code == 0);
    const auto report = outcome.json();
    CHECK(report.at("optimal_cost_matches") == 60);
    CHECK(report.at("planners").at(1).at("reached") == 60);
    CHECK(report.at("planners").at(1).at("mean_length_over_optimum") < 0.96);
  }
}

}  // namespace stairwell::apps
