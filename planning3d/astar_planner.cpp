#include "planning3d/astar_planner.hpp"

#include "planning3d/connectivity.hpp"
#include "planning3d/cost_tables.hpp"
#include "planning3d/grid_moves.hpp"
#include "planning3d/shorten_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr std::size_t kClockEvery = 1024;  // expansions between two looks at the clock
constexpr std::uint8_t kNoMove = kGridMoves.size();
constexpr float kLedWeight = 1.3F;  // nearness makes ways cost more than their length

}  // namespace

struct AstarPlanner::Search {
  const FreeSpace& space;
  const PlanRequest& request;
  const SegmentCheck& check;
  const PlanEnds& ends;
  bool slice;
  std::size_t most_expansions;
  std::size_t expansions = 0;
  const RegionGraph* regions = nullptr;         ///< null: not led
  const std::vector<float>* lengths = nullptr;  ///< from the goal, by part of `regions`, in cells
  float voxels = 0.0F;                          ///< of a cell, as they are weighed

  float estimate(const VoxelIndex& v) const {
    const float open = heuristic(v);
    if (regions == nullptr) return open;
    const std::uint32_t part = regions->part_of(v);
    const float length = part == RegionGraph::kNone ? RegionGraph::kUnreachable : (*lengths)[part];
    return length == RegionGraph::kUnreachable ? open : std::max(open, length * voxels);
  }

  /// Least number of voxel lengths to the goal by the allowed moves (consistent).
  float heuristic(const VoxelIndex& v) const {
    const auto dx = static_cast<float>(std::abs(v.x - ends.goal.x));
    const auto dy = static_cast<float>(std::abs(v.y - ends.goal.y));
    const auto dz = static_cast<float>(std::abs(v.z - ends.goal.z));
    if (slice) return std::max(dx, dy) + 0.41421354F * std::min(dx, dy) + dz;
    const float most = std::max({dx, dy, dz});
    const float least = std::min({dx, dy, dz});
    const float middle = dx + dy + dz - most - least;
    // Rounded down: 1, sqrt(2) - 1, sqrt(3) - sqrt(2).
    return most + 0.41421354F * middle + 0.31783719F * least;
  }
};

void AstarPlanner::prepare(const FreeSpace& space, const PlanRequest& request) {
  nodes_.renew(space.grid());
  nearness_ = nearness_table(space, request.clearance_weight, config_.comfort_m);
  level_ = level_table(space.grid(), request.rule);
}

PlanStatus AstarPlanner::search(Search& search) {
  const auto weight = static_cast<float>(std::max(1.0, config_.heuristic_weight));
  const GridSpec& grid = search.space.grid();
  const std::uint32_t stamp = nodes_.stamp();
  const auto& squared = search.space.blocked_distance().data();
  const auto first = static_cast<std::uint32_t>(grid.linear(search.ends.start));
  const auto last = static_cast<std::uint32_t>(grid.linear(search.ends.goal));
  std::array<std::ptrdiff_t, kGridMoves.size()> offsets{};
  for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
    offsets[m] = kGridMoves[m].x +
                 grid.size()[0] * (kGridMoves[m].y + static_cast<std::ptrdiff_t>(grid.size()[1]) * kGridMoves[m].z);
  }
  const HeightRange heights = useful_heights(level_, search.ends.start.z, search.ends.goal.z);
  nodes_[first] = {0.0F, stamp, kNoMove, false};
  nodes_.push({weight * search.estimate(search.ends.start), 0.0F, first});
  while (!nodes_.nothing_open()) {
    const OpenVoxel best = nodes_.pop_best();
    Node& node = nodes_[best.cell];
    if (node.closed || best.g > node.g) continue;
    node.closed = true;
    if (best.cell == last) return PlanStatus::kReached;
    const bool late = search.expansions % kClockEvery == 0 && search.request.late();
    if (late || search.expansions++ >= search.most_expansions) return PlanStatus::kTimedOut;
    const VoxelIndex v = grid.voxel(best.cell);
    const bool level = level_[static_cast<std::size_t>(v.z)] != 0;
    const float near = nearness_[squared[best.cell]];
    const bool roomy = search.check.roomy(v);
    for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
      const GridMove& move = kGridMoves[m];
      if (search.slice && (move.z == 0 ? !level : move.x != 0 || move.y != 0)) continue;
      const VoxelIndex to{v.x + move.x, v.y + move.y, v.z + move.z};
      if (!heights.contains(to.z) || !grid.contains(to)) continue;
      const auto next = static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(best.cell) + offsets[m]);
      Node& there = nodes_[next];
      const float g = node.g + move.length * (1.0F + 0.5F * (near + nearness_[squared[next]]));
      if (there.stamp == stamp && (there.closed || g >= there.g)) continue;
      if (!search.check.voxel_free(to)) continue;
      // Two places that fit do not make the diagonal between them fit where it is tight.
      if (move.length > 1.0F && !roomy && !search.check.roomy(to) &&
          !search.check.fits(0.5 * (grid.center_of(v) + grid.center_of(to)))) {
        continue;
      }
      there = {g, stamp, static_cast<std::uint8_t>(m), false};
      nodes_.push({g + weight * search.estimate(to), g, next});
    }
  }
  return PlanStatus::kNoPath;
}

/// Once more, from the beginning and by what is left of the request's expansions.
PlanStatus AstarPlanner::search_led(Search& search) {
  lattice_.update(search.space, search.request.rule);
  if (regions_.update(lattice_)) led_.goal = RegionGraph::kNone;  // its lengths are those of before
  const std::uint32_t goal = regions_.part_of(search.ends.goal);
  if (goal == RegionGraph::kNone) return PlanStatus::kTimedOut;
  const std::uint32_t start = regions_.part_of(search.ends.start);
  // Mostly for the same request once more, round fellows.
  if (goal != led_.goal || start != led_.start) regions_.lengths_from(goal, led_.lengths, start);
  led_.goal = goal;
  led_.start = start;
  if (start != RegionGraph::kNone && led_.lengths[start] == RegionGraph::kUnreachable) return PlanStatus::kNoPath;
  search.lengths = &led_.lengths;
  search.voxels = kLedWeight * static_cast<float>(lattice_.frame().cell_voxels);
  search.regions = &regions_;
  search.most_expansions = search.request.max_expansions;
  nodes_.renew(search.space.grid());
  return this->search(search);
}

std::vector<VoxelIndex> AstarPlanner::trace(const Search& search) const {
  std::vector<VoxelIndex> cells{search.ends.goal};
  for (;;) {
    const std::uint8_t from = nodes_[search.space.grid().linear(cells.back())].from;
    if (from == kNoMove) break;
    const GridMove& move = kGridMoves[from];
    cells.push_back(cells.back() - VoxelIndex{move.x, move.y, move.z});
  }
  std::reverse(cells.begin(), cells.end());
  return cells;
}

std::vector<Eigen::Vector3d> AstarPlanner::pull(const Search& search, const std::vector<VoxelIndex>& cells) const {
  const GridSpec& grid = search.space.grid();
  const Eigen::Vector3d& end_m = search.ends.goal_m;
  std::vector<Eigen::Vector3d> points_m;
  std::vector<double> cost;  // from the start, in voxels
  const Eigen::Vector3d first_m = grid.center_of(cells.front());
  if ((first_m - search.request.start_m).norm() > 1e-9) {
    points_m.push_back(search.request.start_m);
    cost.push_back(-(first_m - search.request.start_m).norm() / grid.resolution_m());
  }
  for (const VoxelIndex& v : cells) {
    points_m.push_back(grid.center_of(v));
    cost.push_back(static_cast<double>(nodes_[grid.linear(v)].g));
  }
  if ((points_m.back() - end_m).norm() > 1e-9) {
    cost.push_back(cost.back() + (points_m.back() - end_m).norm() / grid.resolution_m());
    points_m.push_back(end_m);
  }
  if (!config_.pull_string) return points_m;

  const auto straight_cost = [&](const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
    return (b_m - a_m).norm() / grid.resolution_m() * (1.0 + mean_nearness(search.space, nearness_, a_m, b_m));
  };
  const auto allowed = [&](const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
    return !search.slice || stays_in_slice(level_, grid.index_of(a_m), grid.index_of(b_m));
  };
  const auto shortcut = [&](std::size_t i, std::size_t j) {
    return allowed(points_m[i], points_m[j]) && search.check.segment_free(points_m[i], points_m[j]) &&
           straight_cost(points_m[i], points_m[j]) <= 1.02 * (cost[j] - cost[i]) + 1e-6;
  };
  std::vector<std::size_t> kept{0};
  while (kept.back() + 1 < points_m.size()) {
    std::size_t reach = kept.back() + 1;
    std::size_t misses = 0;  // a little beyond the first miss: around round corners sight comes and goes
    for (std::size_t j = reach + 1; j < points_m.size() && misses < 4; ++j) {
      if (shortcut(kept.back(), j)) {
        reach = j;
        misses = 0;
      } else {
        ++misses;
      }
    }
    kept.push_back(reach);
  }
  for (std::size_t k = 1; k + 1 < kept.size();) {  // corners that the greedy pass left for nothing
    if (shortcut(kept[k - 1], kept[k + 1])) {
      kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(k));
    } else {
      ++k;
    }
  }
  std::vector<Eigen::Vector3d> path_m;
  path_m.reserve(kept.size());
  for (const std::size_t i : kept) path_m.push_back(points_m[i]);
  return path_m;
}

PlanResult AstarPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  lattice_cost_m_ = std::numeric_limits<double>::quiet_NaN();
  const GivingUp giving_up(space, request);
  const SegmentCheck check(space, request.keep_out, request.start_m);
  PlanEnds ends;
  result.status = find_ends(space, request, check, ends);
  if (result.status != PlanStatus::kReached) return result;
  prepare(space, request);
  const bool slice = request.rule.kind == MotionRule::Kind::kSlice;
  const bool may_be_led = !slice && space.grid().voxel_count() >= config_.led_from;
  const std::size_t first = may_be_led ? config_.led_after : request.max_expansions;
  Search search{space, request, check, ends, slice, std::min(first, request.max_expansions)};
  result.status = this->search(search);
  if (result.status == PlanStatus::kTimedOut && first < request.max_expansions && !request.late())
    result.status = search_led(search);
  // A look at all of a large grid would take longer than the search.
  if (!may_be_led) result.status = giving_up.status(result.status, ends.start, ends.goal);
  result.expansions = search.expansions;
  nodes_.count(search.expansions);
  if (result.status != PlanStatus::kReached) return result;
  lattice_cost_m_ = static_cast<double>(nodes_[space.grid().linear(ends.goal)].g) * space.grid().resolution_m();
  result.path_m = pull(search, trace(search));
  result.length_m = path_length_m(result.path_m);
  if (result.path_m.size() == 1) result.path_m.push_back(result.path_m.front());
  return result;
}

}  // namespace stairwell::planning3d
