#include "apps/starts.hpp"

#include "apps/option_values.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>

namespace stairwell::apps {

namespace {

constexpr double kStandingSlack_m = 0.05;  ///< a body standing on a floor is free after a lift of its radius and this
constexpr double kLiftStep_m = 0.01;
constexpr double kColumnStep_m = 0.05;
constexpr double kSpacing_m = 1.2;      ///< between starts that were chosen here
constexpr double kHoverHeight_m = 0.8;  ///< above the lowest free position
constexpr int kSpreadAttempts = 50;
constexpr int kRoomyDirections = 16;

std::string text_of(const Eigen::Vector3d& p) {
  return format_number(p.x()) + "," + format_number(p.y()) + "," + format_number(p.z());
}

CheckedStart check_one(const RunConfig& config, const sim3d::GroundTruth& truth, const Start& start) {
  const std::string name = "--start " + text_of(start.position_m);
  const double radius_m = config.fleet.robot.radius_m;
  if (!config.fleet.task_box.contains(start.position_m)) {
    throw InputError(name + ": lies outside the box: move it or enlarge --box");
  }
  if (truth.sphere_free(start.position_m, radius_m)) return {start, false, start.position_m};
  CheckedStart checked{start, true, start.position_m};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double lift_m = kLiftStep_m;
  while (lift_m <= radius_m + kStandingSlack_m && !truth.sphere_free(start.position_m + lift_m * up, radius_m)) {
    lift_m += kLiftStep_m;
  }
  if (lift_m > radius_m + kStandingSlack_m) {
    throw InputError(name + ": is inside a wall or nearer to one than the robot's radius of " +
                     format_number(radius_m) + " m: move it");
  }
  checked.airborne_m += lift_m * up;
  const double top_m = std::min(config.fleet.takeoff_height_m, config.fleet.task_box.max_m.z() - start.position_m.z());
  for (double height_m = lift_m; height_m < top_m; height_m += kColumnStep_m) {
    if (!truth.sphere_free(start.position_m + height_m * up, radius_m)) {
      throw InputError(name + ": something is in the way of the take-off " + format_number(height_m) +
                       " m above it: move it or lower takeoff_height_m");
    }
  }
  return checked;
}

/// Whether what is assumed of the space around a start (`start_bubble_m`) is true at its height: the robot can move
/// there in any level direction. A camera that has not looked that way yet relies on it.
bool roomy(const RunConfig& config, const sim3d::GroundTruth& truth, const Eigen::Vector3d& airborne_m) {
  const double radius_m = config.fleet.robot.radius_m;
  const double reach_m = std::max(0.0, config.fleet.start_bubble_m - radius_m);
  for (int i = 0; i < kRoomyDirections; ++i) {
    const double azimuth_rad = 2.0 * kPi * i / kRoomyDirections;
    const Eigen::Vector3d side(std::cos(azimuth_rad), std::sin(azimuth_rad), 0.0);
    if (!truth.sphere_free(airborne_m + reach_m * side, radius_m)) return false;
  }
  return true;
}

double spacing_m(const RunConfig& config) { return std::max(kSpacing_m, config.fleet.fellow_clearance_m); }

/// Robot-free positions on a coarse lattice and their largest connected part.
class FreeLattice {
 public:
  FreeLattice(const Aabb& box, double radius_m, const sim3d::GroundTruth& truth)
      : step_m_(std::max({0.25, 1.25 * radius_m, std::cbrt(box.volume_m3() / 400'000.0)})),
        radius_m_(radius_m),
        truth_(truth) {
    for (int axis = 0; axis < 3; ++axis) {
      // Half a step of freedom on either side keeps the outermost positions off the box's faces.
      const double usable_m = std::max(0.0, box.size_m()[axis] - 2.0 * radius_m);
      size_[axis] = static_cast<int>(std::floor(usable_m / step_m_)) + 1;
      origin_m_[axis] = box.center_m()[axis] - 0.5 * step_m_ * (size_[axis] - 1);
    }
    const auto nodes = [&](int axis) { return static_cast<std::size_t>(size_[axis]); };
    component_.assign(nodes(0) * nodes(1) * nodes(2), kUnvisited);
    for (int node = 0; node < count(); ++node) {
      if (!truth_.sphere_free(position_m(node), radius_m_)) component_[static_cast<std::size_t>(node)] = kBlocked;
    }
    label();
  }

  int count() const { return static_cast<int>(component_.size()); }
  Eigen::Vector3d position_m(int node) const {
    const int x = node % size_[0], y = node / size_[0] % size_[1], z = node / (size_[0] * size_[1]);
    return origin_m_ + step_m_ * Eigen::Vector3d(x, y, z);
  }
  int component(int node) const { return component_[static_cast<std::size_t>(node)]; }
  int largest_component() const { return largest_; }  ///< negative: nothing is free
  double step_m() const { return step_m_; }
  int column(int node) const { return node % (size_[0] * size_[1]); }

 private:
  static constexpr int kBlocked = -2;
  static constexpr int kUnvisited = -1;

  void label() {
    int next = 0;
    std::size_t most = 0;
    for (int node = 0; node < count(); ++node) {
      if (component(node) != kUnvisited) continue;
      const std::size_t filled = flood(node, next);
      if (filled > most) {
        most = filled;
        largest_ = next;
      }
      ++next;
    }
  }

  std::size_t flood(int seed, int label) {
    std::queue<int> open({seed});
    component_[static_cast<std::size_t>(seed)] = label;
    std::size_t filled = 0;
    const int strides[3] = {1, size_[0], size_[0] * size_[1]};
    while (!open.empty()) {
      const int node = open.front();
      open.pop();
      ++filled;
      const int at[3] = {node % size_[0], node / size_[0] % size_[1], node / (size_[0] * size_[1])};
      for (int axis = 0; axis < 3; ++axis) {
        for (const int move : {-1, 1}) {
          if (at[axis] + move < 0 || at[axis] + move >= size_[axis]) continue;
          const int neighbour = node + move * strides[axis];
          if (component(neighbour) != kUnvisited || !passable(node, neighbour)) continue;
          component_[static_cast<std::size_t>(neighbour)] = label;
          open.push(neighbour);
        }
      }
    }
    return filled;
  }

  bool passable(int a, int b) const { return truth_.sphere_free(0.5 * (position_m(a) + position_m(b)), radius_m_); }

  double step_m_;
  double radius_m_;
  const sim3d::GroundTruth& truth_;
  int size_[3] = {1, 1, 1};
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  std::vector<int> component_;
  int largest_ = -1;
};

/// One hovering position per column of the lowest storey.
std::vector<Eigen::Vector3d> lowest_storey(const FreeLattice& lattice, int component) {
  std::map<int, std::vector<Eigen::Vector3d>> columns;  // nodes come in order of height
  double lowest_m = std::numeric_limits<double>::infinity();
  for (int node = 0; node < lattice.count(); ++node) {
    if (lattice.component(node) != component) continue;
    columns[lattice.column(node)].push_back(lattice.position_m(node));
    lowest_m = std::min(lowest_m, lattice.position_m(node).z());
  }
  std::vector<Eigen::Vector3d> found;
  for (const auto& [column, nodes] : columns) {
    if (nodes.front().z() > lowest_m + 1.5 * lattice.step_m()) continue;
    Eigen::Vector3d chosen_m = nodes.front();
    for (const Eigen::Vector3d& node_m : nodes) {
      const bool contiguous = node_m.z() - chosen_m.z() < 1.5 * lattice.step_m();
      if (contiguous && node_m.z() <= nodes.front().z() + kHoverHeight_m) chosen_m = node_m;
    }
    found.push_back(chosen_m);
  }
  return found;
}

/// The lattice node of which connected part is nearest to a position; -1 when nothing is free.
int nearest_component(const FreeLattice& lattice, const Eigen::Vector3d& position_m) {
  int nearest = -1;
  double least_m = std::numeric_limits<double>::infinity();
  for (int node = 0; node < lattice.count(); ++node) {
    if (lattice.component(node) < 0) continue;
    const double distance_m = (lattice.position_m(node) - position_m).norm();
    if (distance_m < least_m) {
      least_m = distance_m;
      nearest = lattice.component(node);
    }
  }
  return nearest;
}

std::vector<Eigen::Vector3d> candidates(const FreeLattice& lattice, const std::vector<CheckedStart>& given,
                                        Eigen::Vector3d& center_m) {
  if (given.empty()) {
    std::vector<Eigen::Vector3d> found = lowest_storey(lattice, lattice.largest_component());
    center_m.setZero();
    for (const Eigen::Vector3d& position_m : found) center_m += position_m / static_cast<double>(found.size());
    return found;
  }
  center_m = given.front().airborne_m;
  const int component = nearest_component(lattice, center_m);
  std::vector<Eigen::Vector3d> found;
  for (int node = 0; node < lattice.count(); ++node) {
    if (lattice.component(node) == component) found.push_back(lattice.position_m(node));
  }
  return found;
}

bool apart(const std::vector<CheckedStart>& starts, const Eigen::Vector3d& position_m, double distance_m) {
  return std::ranges::none_of(starts, [&](const CheckedStart& other) {
    return (other.airborne_m - position_m).norm() < distance_m ||
           (other.start.position_m - position_m).norm() < distance_m;
  });
}

void add_starts(const RunConfig& config, const sim3d::GroundTruth& truth, std::vector<CheckedStart>& starts) {
  const FreeLattice lattice(config.fleet.task_box, config.fleet.robot.radius_m, truth);
  if (lattice.largest_component() < 0) {
    throw InputError("--box holds no free space for a robot of radius " + format_number(config.fleet.robot.radius_m) +
                     " m in " + config.world.string() + ": move or enlarge it");
  }
  Eigen::Vector3d center_m;
  std::vector<Eigen::Vector3d> positions_m = candidates(lattice, starts, center_m);
  const auto order = [&](const Eigen::Vector3d& p) {
    return std::tuple((p - center_m).squaredNorm(), p.z(), p.y(), p.x());
  };
  std::ranges::sort(positions_m, [&](const auto& a, const auto& b) { return order(a) < order(b); });
  for (const bool any : {false, true}) {  // where none is left with room around it, those without
    for (const Eigen::Vector3d& position_m : positions_m) {
      if (starts.size() == config.uavs) return;
      if (!apart(starts, position_m, spacing_m(config)) || !(any || roomy(config, truth, position_m))) continue;
      starts.push_back({{position_m, 0.0}, false, position_m});
    }
  }
  if (starts.size() < config.uavs) {
    throw InputError("--uavs " + std::to_string(config.uavs) + ": only " + std::to_string(starts.size()) +
                     " UAVs fit into the free space " + format_number(spacing_m(config)) +
                     " m apart: lower --uavs or enlarge --box");
  }
}

/// Whether the robot can move straight from one start to the other.
bool joined(const RunConfig& config, const sim3d::GroundTruth& truth, const CheckedStart& from,
            const CheckedStart& to) {
  const Eigen::Vector3d way_m = to.airborne_m - from.airborne_m;
  const int steps = static_cast<int>(std::ceil(way_m.norm() / kColumnStep_m));
  for (int i = 0; i <= steps; ++i) {
    if (!truth.sphere_free(from.airborne_m + i * way_m / std::max(1, steps), config.fleet.robot.radius_m)) return false;
  }
  return true;
}

/// Moves every start, one after the other.
void spread(const RunConfig& config, const sim3d::GroundTruth& truth, std::vector<CheckedStart>& starts) {
  Rng rng = make_rng(config.fleet.seed, "starts");
  for (std::size_t i = 0; i < starts.size(); ++i) {
    std::vector<CheckedStart> others = starts;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const bool was_roomy = roomy(config, truth, starts[i].airborne_m);
    for (int attempt = 0; attempt < kSpreadAttempts; ++attempt) {
      Start moved = starts[i].start;
      for (int axis = 0; axis < 2; ++axis)
        moved.position_m[axis] += rng.uniform(-config.start_spread_m, config.start_spread_m);
      if (!apart(others, moved.position_m, config.fleet.fellow_clearance_m)) continue;
      try {
        const CheckedStart checked = check_one(config, truth, moved);
        if (!joined(config, truth, starts[i], checked)) continue;
        if (was_roomy && !roomy(config, truth, checked.airborne_m)) continue;
        starts[i] = checked;
        break;
      } catch (const InputError&) {  // in a wall or outside the box
      }
    }
  }
}

}  // namespace

std::vector<CheckedStart> place_starts(const RunConfig& config, const sim3d::GroundTruth& truth) {
  std::vector<CheckedStart> starts;
  for (const Start& start : config.starts) {
    const CheckedStart checked = check_one(config, truth, start);
    for (const CheckedStart& other : starts) {
      const double distance_m = (other.start.position_m - start.position_m).norm();
      if (distance_m < config.fleet.fellow_clearance_m) {
        throw InputError("--start " + text_of(start.position_m) + ": is " + format_number(distance_m) +
                         " m from another start, nearer than fellow_clearance_m of " +
                         format_number(config.fleet.fellow_clearance_m) + " m: move it");
      }
    }
    starts.push_back(checked);
  }
  if (starts.size() < config.uavs) add_starts(config, truth, starts);
  if (config.start_spread_m > 0.0) spread(config, truth, starts);
  return starts;
}

}  // namespace stairwell::apps
