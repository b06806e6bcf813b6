#include "planning3d/theta_planner.hpp"

#include "planning3d/connectivity.hpp"
#include "planning3d/cost_tables.hpp"
#include "planning3d/grid_moves.hpp"
#include "planning3d/shorten_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr std::size_t kClockEvery = 256;  // expansions between two looks at the clock
constexpr int kPullRounds = 16;
constexpr double kFinestStep = 0.2;  ///< of a voxel, by which corners are moved

float distance(const VoxelIndex& a, const VoxelIndex& b) {
  const auto x = static_cast<float>(a.x - b.x);
  const auto y = static_cast<float>(a.y - b.y);
  const auto z = static_cast<float>(a.z - b.z);
  return std::sqrt(x * x + y * y + z * z);
}

}  // namespace

struct ThetaPlanner::Search {
  const FreeSpace& space;
  const PlanRequest& request;
  const SegmentCheck& check;
  const PlanEnds& ends;
  bool slice;
  const std::vector<std::uint8_t>& level;
  HeightRange heights;
  float weight;         ///< of the heuristic
  bool costs_nearness;  ///< else costs are lengths
  std::size_t expansions = 0;

  /// By the motion rule alone.
  bool allowed(const VoxelIndex& a, const VoxelIndex& b) const { return !slice || stays_in_slice(level, a, b); }
  float near(const VoxelIndex& v, const std::vector<float>& nearness) const {
    return nearness[space.blocked_distance().squared_cells(v)];
  }
  /// A single move between neighbouring voxels, `from` being traversable.
  bool step_free(const VoxelIndex& from, const GridMove& move) const {
    const VoxelIndex to{from.x + move.x, from.y + move.y, from.z + move.z};
    if (!heights.contains(to.z) || !allowed(from, to) || !check.voxel_free(to)) return false;
    if (std::abs(move.x) + std::abs(move.y) + std::abs(move.z) == 1 || check.roomy(from)) return true;
    return check.fits(0.5 * (space.grid().center_of(from) + space.grid().center_of(to)));
  }
  bool sight(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) const {
    return allowed(space.grid().index_of(a_m), space.grid().index_of(b_m)) && check.segment_free(a_m, b_m);
  }
};

void ThetaPlanner::prepare(const FreeSpace& space, const PlanRequest& request) {
  nodes_.renew(space.grid());
  nearness_ = nearness_table(space, request.clearance_weight, config_.comfort_m);
  level_ = level_table(space.grid(), request.rule);
}

float ThetaPlanner::extra_along(const Search& search, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) const {
  if (!search.costs_nearness) return 0.0F;
  const double length = (b_m - a_m).norm() / search.space.grid().resolution_m();
  return static_cast<float>(length * mean_nearness(search.space, nearness_, a_m, b_m));
}

double ThetaPlanner::cost(const Search& search, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) const {
  return (b_m - a_m).norm() / nodes_.grid().resolution_m() + static_cast<double>(extra_along(search, a_m, b_m));
}

void ThetaPlanner::push(const Search& search, std::uint32_t cell, const VoxelIndex& v) {
  const float g = nodes_[cell].g;
  nodes_.push({g + search.weight * distance(v, search.ends.goal), g, cell});
}

/// SetVertex of the paper: the parent if it is in sight, else (or if that is cheaper) the best closed neighbour.
/// False when the cost has risen.
bool ThetaPlanner::check_parent(const Search& search, std::uint32_t cell, const VoxelIndex& v) {
  Node& node = nodes_[cell];
  if (node.checked) return true;
  node.checked = true;
  const float before = node.g;
  const Eigen::Vector3d here_m = nodes_.grid().center_of(v);
  const Eigen::Vector3d parent_m = nodes_.grid().center_of(nodes_.grid().voxel(node.parent));
  Node straight = node;
  straight.near = extra_along(search, parent_m, here_m);
  straight.g = nodes_[node.parent].g + static_cast<float>((here_m - parent_m).norm() / nodes_.grid().resolution_m()) +
               straight.near;
  if (!search.costs_nearness) {  // no way through a neighbour is shorter than the straight line
    if (!search.sight(parent_m, here_m)) step_from_neighbour(search, cell, v);
  } else {
    step_from_neighbour(search, cell, v);
    if (straight.g <= node.g && search.sight(parent_m, here_m)) node = straight;
  }
  return node.g <= before + 1e-3F;
}

/// Makes the closed neighbour with the cheapest way here the parent.
void ThetaPlanner::step_from_neighbour(const Search& search, std::uint32_t cell, const VoxelIndex& v) {
  Node& node = nodes_[cell];
  node.g = std::numeric_limits<float>::infinity();
  for (const GridMove& move : kGridMoves) {
    const VoxelIndex other{v.x + move.x, v.y + move.y, v.z + move.z};
    if (!nodes_.grid().contains(other)) continue;
    const auto place = static_cast<std::uint32_t>(nodes_.grid().linear(other));
    const Node& there = nodes_[place];
    if (!nodes_.seen(there) || !there.closed) continue;
    const float near = 0.5F * move.length * (search.near(v, nearness_) + search.near(other, nearness_));
    if (there.g + move.length + near >= node.g || !search.step_free(v, move)) continue;
    node.g = there.g + move.length + near;
    node.near = near;
    node.parent = place;
  }
}

void ThetaPlanner::expand(const Search& search, std::uint32_t cell, const VoxelIndex& v) {
  const Node node = nodes_[cell];
  const VoxelIndex parent = nodes_.grid().voxel(node.parent);
  const float parent_g = nodes_[node.parent].g;
  const float near = search.near(v, nearness_);
  for (const GridMove& move : kGridMoves) {
    const VoxelIndex to{v.x + move.x, v.y + move.y, v.z + move.z};
    if (!nodes_.grid().contains(to)) continue;
    const auto next = static_cast<std::uint32_t>(nodes_.grid().linear(to));
    Node& there = nodes_[next];
    if (nodes_.seen(there) && there.closed) continue;
    const float step_near = 0.5F * move.length * (near + search.near(to, nearness_));
    const bool straight = search.allowed(parent, to);
    const float extra = straight ? node.near + step_near : step_near;
    const float g = straight ? parent_g + distance(parent, to) + extra : node.g + move.length + extra;
    if ((nodes_.seen(there) && g >= there.g) || !search.step_free(v, move)) continue;
    there = {g, extra, nodes_.stamp(), straight ? node.parent : cell, !straight, false};
    push(search, next, to);
  }
}

PlanStatus ThetaPlanner::search(Search& search) {
  const auto first = static_cast<std::uint32_t>(nodes_.grid().linear(search.ends.start));
  const auto last = static_cast<std::uint32_t>(nodes_.grid().linear(search.ends.goal));
  nodes_[first] = {0.0F, 0.0F, nodes_.stamp(), first, true, false};
  push(search, first, search.ends.start);
  while (!nodes_.nothing_open()) {
    const OpenVoxel best = nodes_.pop_best();
    if (nodes_[best.cell].closed || best.g != nodes_[best.cell].g) continue;
    const VoxelIndex v = nodes_.grid().voxel(best.cell);
    if (!check_parent(search, best.cell, v)) {
      push(search, best.cell, v);
      continue;
    }
    nodes_[best.cell].closed = true;
    if (best.cell == last) return PlanStatus::kReached;
    const bool late = search.expansions % kClockEvery == 0 && search.request.late();
    if (late || search.expansions++ >= search.request.max_expansions) return PlanStatus::kTimedOut;
    expand(search, best.cell, v);
  }
  return PlanStatus::kNoPath;
}

std::vector<Eigen::Vector3d> ThetaPlanner::trace(const Search& search) const {
  const auto first = static_cast<std::uint32_t>(nodes_.grid().linear(search.ends.start));
  std::vector<Eigen::Vector3d> path_m;
  const auto add = [&path_m](const Eigen::Vector3d& at_m) {
    if (path_m.empty() || (path_m.back() - at_m).norm() > 1e-9) path_m.push_back(at_m);
  };
  add(search.ends.goal_m);
  for (auto cell = static_cast<std::uint32_t>(nodes_.grid().linear(search.ends.goal));; cell = nodes_[cell].parent) {
    add(nodes_.grid().center_of(nodes_.grid().voxel(cell)));
    if (cell == first) break;
  }
  add(search.request.start_m);
  std::reverse(path_m.begin(), path_m.end());
  return path_m;
}

bool ThetaPlanner::drop_corners(const Search& search, std::vector<Eigen::Vector3d>& path_m) const {
  bool changed = false;
  for (std::size_t k = 1; k + 1 < path_m.size();) {
    const double now = cost(search, path_m[k - 1], path_m[k]) + cost(search, path_m[k], path_m[k + 1]);
    if (cost(search, path_m[k - 1], path_m[k + 1]) <= 1.002 * now + 1e-6 &&
        search.sight(path_m[k - 1], path_m[k + 1])) {
      path_m.erase(path_m.begin() + static_cast<std::ptrdiff_t>(k));
      changed = true;
    } else {
      ++k;
    }
  }
  return changed;
}

/// To the best of the 26 places a step away, if that is cheaper.
bool ThetaPlanner::move_corner(const Search& search, std::vector<Eigen::Vector3d>& path_m, std::size_t corner,
                               double step_m) const {
  const Eigen::Vector3d before_m = path_m[corner - 1];
  const Eigen::Vector3d here_m = path_m[corner];
  const Eigen::Vector3d after_m = path_m[corner + 1];
  double best = cost(search, before_m, here_m) + cost(search, here_m, after_m) - 1e-4;
  bool moved = false;
  for (const GridMove& move : kGridMoves) {
    if (search.slice && move.z != 0) continue;
    const Eigen::Vector3d at_m = here_m + step_m * Eigen::Vector3d(move.x, move.y, move.z);
    if (!search.space.flight_box().contains(at_m) || !search.check.voxel_free(nodes_.grid().index_of(at_m))) continue;
    const double total = cost(search, before_m, at_m) + cost(search, at_m, after_m);
    if (total >= best || !search.sight(before_m, at_m) || !search.sight(at_m, after_m)) continue;
    best = total;
    path_m[corner] = at_m;
    moved = true;
  }
  return moved;
}

void ThetaPlanner::pull(const Search& search, std::vector<Eigen::Vector3d>& path_m) const {
  if (!config_.pull_string) return;
  double step_m = nodes_.grid().resolution_m();
  for (int round = 0; round < kPullRounds; ++round) {
    bool changed = drop_corners(search, path_m);
    for (std::size_t corner = 1; corner + 1 < path_m.size(); ++corner) {
      if (search.request.late()) return;
      changed = move_corner(search, path_m, corner, step_m) || changed;
    }
    if (changed) continue;
    step_m *= 0.5;
    if (step_m < kFinestStep * nodes_.grid().resolution_m()) break;
  }
  drop_corners(search, path_m);
}

PlanResult ThetaPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  const GivingUp giving_up(space, request);
  const SegmentCheck check(space, request.keep_out, request.start_m);
  PlanEnds ends;
  result.status = find_ends(space, request, check, ends);
  if (result.status != PlanStatus::kReached) return result;
  prepare(space, request);
  Search search{space,
                request,
                check,
                ends,
                request.rule.kind == MotionRule::Kind::kSlice,
                level_,
                useful_heights(level_, ends.start.z, ends.goal.z),
                static_cast<float>(std::max(1.0, config_.heuristic_weight)),
                request.clearance_weight > 0.0};
  result.status = giving_up.status(this->search(search), ends.start, ends.goal);
  result.expansions = search.expansions;
  nodes_.count(search.expansions);
  if (result.status != PlanStatus::kReached) return result;
  result.path_m = trace(search);
  if (result.path_m.size() == 1) result.path_m.push_back(result.path_m.front());
  pull(search, result.path_m);
  result.length_m = path_length_m(result.path_m);
  return result;
}

}  // namespace stairwell::planning3d
