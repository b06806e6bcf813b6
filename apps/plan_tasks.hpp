/// What `stairwell plan --benchmark` reads: Moving AI voxel scenarios (.3dscen), YAML lists of tasks and random pairs.
#pragma once

#include "apps/known_map.hpp"
#include "core/robot.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

struct PlanTask {
  std::string name;
  std::size_t map = 0;  ///< place in PlanTasks::maps
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double optimum_m = std::numeric_limits<double>::quiet_NaN();  ///< known shortest length
  double detour = std::numeric_limits<double>::quiet_NaN();     ///< optimum over the length were nothing in the way
};

/// Random tasks: key `pairs` of a YAML benchmark.
struct PairRules {
  std::size_t count = 0;
  std::uint64_t seed = 1;
  bool cross_storey = false;  ///< start and goal on different storeys
};

struct PlanTasks {
  std::string name;
  std::filesystem::path file;  ///< empty for tasks from elsewhere
  std::vector<std::filesystem::path> maps;
  std::vector<PlanTask> tasks;
  KnownMapOptions map_options;
  Robot robot;
  double clearance_weight = 1.0;
  double comfort_m = std::numeric_limits<double>::quiet_NaN();  ///< the planners' own
  bool slice = false;    ///< horizontal moves only at the heights of start and goal
  bool lattice = false;  ///< Moving AI's rules: shortest by single moves from cell to cell, no corner cut
};

/// .3dscen, .yaml or .yml. Maps are looked for beside the file, or in `data_folder` unless that is empty.
/// For random pairs the map is loaded.
/// @throws InputError naming file and line.
PlanTasks load_plan_tasks(const std::filesystem::path& file, const std::filesystem::path& data_folder,
                          const KnownMapOptions& options);

/// `sphere:R` or `box:LxWxH` (its circumscribed sphere), metres. @throws InputError quoting the text.
Robot parse_robot(std::string_view text);
/// `x,y,z`, finite. @throws InputError naming the option and quoting the text.
Eigen::Vector3d parse_point(const std::string& option, const std::string& text);
/// `x0,y0,z0,x1,y1,z1` with some volume.
Aabb parse_box(const std::string& option, const std::string& text);

}  // namespace stairwell::apps
