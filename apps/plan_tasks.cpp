#include "apps/plan_tasks.hpp"

#include "apps/option_values.hpp"
#include "apps/plan_pairs.hpp"
#include "core/errors.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

namespace stairwell::apps {

namespace {

/// Moving AI's agent is a point that may not touch: a sphere of any size up to half a cell makes the same moves between
/// centres (those whose swept box is free), and this one is in sight along the lines that touch free cells only.
constexpr double kPointRadius_m = 1e-3;
constexpr std::size_t kMostPairs = 100'000;

std::string content_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) throw InputError(file.string() + ": no such file");
  if (!std::filesystem::is_regular_file(file, error)) throw InputError(file.string() + ": is not a file");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw InputError(file.string() + ": cannot be read, or is empty");
  return text.str();
}

[[noreturn]] void fail_at(const std::filesystem::path& file, std::size_t line, const std::string& what) {
  throw InputError(file.string() + ":" + std::to_string(line) + ": " + what);
}

std::filesystem::path map_beside(const std::filesystem::path& file, const std::filesystem::path& data_folder,
                                 const std::string& map) {
  const std::filesystem::path folder = data_folder.empty() ? file.parent_path() : data_folder;
  const std::filesystem::path found = folder / map;  // an absolute map stays as it is
  if (!std::filesystem::exists(found)) {
    throw InputError(file.string() + ": its map " + found.string() + " does not exist (give its folder with --data)");
  }
  return found;
}

PlanTask scenario_row(const std::string& line, const std::filesystem::path& file, std::size_t number, double cell_m) {
  std::istringstream words(line);
  std::array<double, 8> values{};
  std::string word;
  std::size_t count = 0;
  while (words >> word) {
    if (count == values.size()) fail_at(file, number, "more than eight numbers");
    try {
      values[count++] = parse_number(word);
    } catch (const InputError& error) {
      fail_at(file, number, error.what());
    }
  }
  if (count != values.size()) fail_at(file, number, "a task needs eight numbers: start, goal, length, ratio");
  for (std::size_t i = 0; i < 6; ++i) {
    if (values[i] != std::floor(values[i]) || values[i] < 0.0) fail_at(file, number, "cells are whole numbers from 0");
  }
  PlanTask task;
  task.name = "line " + std::to_string(number);
  task.from_m = cell_m * (Eigen::Vector3d(values[0], values[1], values[2]).array() + 0.5);
  task.to_m = cell_m * (Eigen::Vector3d(values[3], values[4], values[5]).array() + 0.5);
  task.optimum_m = cell_m * values[6];
  task.detour = values[7];
  return task;
}

PlanTasks load_scenario(const std::filesystem::path& file, const std::filesystem::path& data_folder) {
  std::istringstream lines(content_of(file));
  std::string line;
  const auto next = [&lines, &line] {
    if (!std::getline(lines, line)) return false;
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.pop_back();
    return true;
  };
  if (!next() || line != "version 1") fail_at(file, 1, "not a .3dscen file: the first line must read 'version 1'");
  if (!next() || line.empty()) fail_at(file, 2, "the second line must name the map");
  PlanTasks tasks;
  tasks.maps.push_back(map_beside(file, data_folder, line));
  tasks.lattice = true;
  tasks.clearance_weight = 0.0;
  for (std::size_t number = 3; next(); ++number) {
    if (!line.empty()) tasks.tasks.push_back(scenario_row(line, file, number, 1.0));
  }
  return tasks;
}

/// A YAML map whose every key must be asked for.
class KeyedNode {
 public:
  KeyedNode(const std::filesystem::path& file, const YAML::Node& node, const std::vector<std::string_view>& known)
      : file_(file), node_(node) {
    if (!node.IsMap()) fail_at(file, line(node), "must be a map of key: value");
    for (const auto& entry : node) {
      const std::string key = entry.first.as<std::string>("");
      if (std::ranges::find(known, key) == known.end()) fail_at(file, line(entry.first), "unknown key '" + key + "'");
    }
  }
  static std::size_t line(const YAML::Node& node) { return static_cast<std::size_t>(node.Mark().line + 1); }

  std::string text(const std::string& key, const std::string& otherwise) const {
    const YAML::Node value = node_[key];
    if (!value) return otherwise;
    if (!value.IsScalar()) fail_at(file_, line(value), "key '" + key + "' must be one value");
    return value.Scalar();
  }
  double number(const std::string& key, double otherwise) const {
    const YAML::Node value = node_[key];
    if (!value) return otherwise;
    try {
      return parse_number(text(key, ""));
    } catch (const InputError& error) {
      fail_at(file_, line(value), "key '" + key + "': " + error.what());
    }
  }
  Eigen::Vector3d point(const std::string& key) const {
    const YAML::Node value = node_[key];
    if (!value || !value.IsSequence() || value.size() != 3) {
      fail_at(file_, line(value ? value : node_), "key '" + key + "' must be [x, y, z]");
    }
    Eigen::Vector3d at_m;
    for (std::size_t i = 0; i < 3; ++i) {
      try {
        at_m[static_cast<int>(i)] = parse_number(value[i].as<std::string>(""));
      } catch (const InputError& error) {
        fail_at(file_, line(value), "key '" + key + "': " + error.what());
      }
    }
    return at_m;
  }

 private:
  const std::filesystem::path& file_;
  YAML::Node node_;
};

void add_listed(PlanTasks& tasks, const std::filesystem::path& file, const std::filesystem::path& data_folder,
                const YAML::Node& list) {
  if (!list || !list.IsSequence()) throw InputError(file.string() + ": 'tasks' must be a list");
  for (const YAML::Node& entry : list) {
    const KeyedNode row(file, entry, {"name", "map", "from", "to", "optimum_m"});
    const std::string map = row.text("map", "");
    if (map.empty()) fail_at(file, KeyedNode::line(entry), "a task needs the key 'map'");
    const std::filesystem::path path = map_beside(file, data_folder, map);
    const auto known = std::ranges::find(tasks.maps, path);
    PlanTask task;
    task.map = static_cast<std::size_t>(known - tasks.maps.begin());
    if (known == tasks.maps.end()) tasks.maps.push_back(path);
    task.name = row.text("name", "task " + std::to_string(tasks.tasks.size() + 1));
    task.from_m = row.point("from");
    task.to_m = row.point("to");
    task.optimum_m = row.number("optimum_m", task.optimum_m);
    tasks.tasks.push_back(std::move(task));
  }
}

/// Beside `count`, `seed` and `cross_storey`: the map.
void add_pairs(PlanTasks& tasks, const std::filesystem::path& file, const std::filesystem::path& data_folder,
               const YAML::Node& node) {
  const KeyedNode row(file, node, {"map", "count", "seed", "cross_storey"});
  PairRules rules;
  const std::string map = row.text("map", "");
  if (map.empty()) fail_at(file, KeyedNode::line(node), "'pairs' needs the key 'map'");
  try {
    rules.count = parse_count(row.text("count", "100"));
    rules.seed = parse_count(row.text("seed", "1"));
    rules.cross_storey = parse_switch(row.text("cross_storey", "no"));
  } catch (const InputError& error) {
    fail_at(file, KeyedNode::line(node), error.what());
  }
  if (rules.count > kMostPairs) fail_at(file, KeyedNode::line(node), "at most 100000 pairs");
  tasks.maps.push_back(map_beside(file, data_folder, map));
  try {
    tasks.tasks = random_pairs(load_known_map(tasks.maps.front(), tasks.map_options), tasks.robot, rules);
  } catch (const InputError& error) {
    throw InputError(file.string() + ": " + error.what());
  }
}

PlanTasks load_yaml(const std::filesystem::path& file, const std::filesystem::path& data_folder,
                    const KnownMapOptions& options) {
  YAML::Node root;
  try {
    root = YAML::Load(content_of(file));
  } catch (const YAML::Exception& error) {
    fail_at(file, static_cast<std::size_t>(error.mark.line + 1), "not valid YAML: " + error.msg);
  }
  const KeyedNode top(file, root,
                      {"robot", "margin_m", "clearance_weight", "comfort_m", "resolution_m", "extrude_height_m", "mode",
                       "box", "tasks", "pairs"});
  PlanTasks tasks;
  tasks.map_options = options;
  tasks.map_options.resolution_m = top.number("resolution_m", options.resolution_m);
  tasks.map_options.world.extrude_height_m = top.number("extrude_height_m", options.world.extrude_height_m);
  const std::string box = top.text("box", "");
  if (!box.empty()) tasks.map_options.box = parse_box(file.string() + ": box", box);
  tasks.robot = parse_robot(top.text("robot", "sphere:0.2"));
  tasks.robot.margin_m = top.number("margin_m", 0.0);
  tasks.clearance_weight = top.number("clearance_weight", 1.0);
  tasks.comfort_m = top.number("comfort_m", tasks.comfort_m);
  const std::string mode = top.text("mode", "volume");
  if (mode != "slice" && mode != "volume") throw InputError(file.string() + ": mode must be slice or volume");
  tasks.slice = mode == "slice";
  if (root["pairs"]) {
    add_pairs(tasks, file, data_folder, root["pairs"]);
  } else {
    add_listed(tasks, file, data_folder, root["tasks"]);
  }
  return tasks;
}

}  // namespace

Robot parse_robot(std::string_view text) {
  const auto refuse = [text]() -> InputError {
    return InputError("robot '" + std::string(text) + "': give sphere:R or box:LxWxH in metres, as sphere:0.3");
  };
  Robot robot;
  std::vector<double> edges_m;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) throw refuse();
  const std::string_view kind = text.substr(0, colon);
  std::string numbers(text.substr(colon + 1));
  std::ranges::replace(numbers, 'x', ',');
  try {
    edges_m = parse_numbers(numbers);
  } catch (const InputError&) {
    throw refuse();
  }
  const bool sphere = kind == "sphere" && edges_m.size() == 1;
  const bool box = kind == "box" && edges_m.size() == 3;
  if ((!sphere && !box) || std::ranges::any_of(edges_m, [](double edge_m) { return !(edge_m > 0.0); })) throw refuse();
  robot.radius_m = sphere ? edges_m[0] : 0.5 * std::hypot(edges_m[0], edges_m[1], edges_m[2]);
  if (!robot.problems().empty()) throw InputError("robot '" + std::string(text) + "': " + robot.problems().front());
  return robot;
}

Eigen::Vector3d parse_point(const std::string& option, const std::string& text) {
  std::vector<double> values;
  try {
    values = parse_numbers(text);
  } catch (const InputError& error) {
    throw InputError(option + " " + text + ": " + error.what());
  }
  if (values.size() != 3) throw InputError(option + " " + text + ": give x,y,z in metres");
  return {values[0], values[1], values[2]};
}

Aabb parse_box(const std::string& option, const std::string& text) {
  std::vector<double> values;
  try {
    values = parse_numbers(text);
  } catch (const InputError& error) {
    throw InputError(option + " " + text + ": " + error.what());
  }
  if (values.size() != 6) throw InputError(option + " " + text + ": give x0,y0,z0,x1,y1,z1 in metres");
  const Aabb box{{values[0], values[1], values[2]}, {values[3], values[4], values[5]}};
  if (!(box.size_m().minCoeff() > 0.0)) throw InputError(option + " " + text + ": the box has no volume");
  return box;
}

PlanTasks load_plan_tasks(const std::filesystem::path& file, const std::filesystem::path& data_folder,
                          const KnownMapOptions& options) {
  const std::string extension = file.extension().string();
  PlanTasks tasks;
  if (extension == ".3dscen") {
    tasks = load_scenario(file, data_folder);
    tasks.robot.radius_m = kPointRadius_m;
    tasks.map_options = options;
    tasks.map_options.world.voxel_size_m = 1.0;
  } else if (extension == ".yaml" || extension == ".yml") {
    tasks = load_yaml(file, data_folder, options);
  } else {
    throw InputError(file.string() + ": a benchmark is a .3dscen or .yaml file");
  }
  if (tasks.tasks.empty()) throw InputError(file.string() + ": no task in it");
  tasks.file = file;
  tasks.name = file.stem().stem().string();
  return tasks;
}

}  // namespace stairwell::apps
