#include "learning/train/widest_planner.hpp"

#include "planning3d/grid_moves.hpp"
#include "planning3d/segment_check.hpp"
#include "planning3d/shorten_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace stairwell::train {

using planning3d::GridMove;
using planning3d::PlanResult;
using planning3d::PlanStatus;

struct WidestPlanner::Search {
  const mapping::DistanceField& solid;
  const planning3d::SegmentCheck& check;
  bool plane;
  const GridSpec& grid = check.space().grid();

  /// Calls `visit(to, move)` for every move from a voxel that the robot can make.
  template <typename Visit>
  void for_each_move(const VoxelIndex& from, Visit&& visit) const {
    for (const GridMove& move : planning3d::kGridMoves) {
      const VoxelIndex to = from + VoxelIndex{move.x, move.y, move.z};
      if ((plane && move.z != 0) || !check.voxel_free(to)) continue;
      visit(to, move);
    }
  }

  /// Squared cells at the narrowest place of the widest way; -1 if there is none.
  int bottleneck(const VoxelIndex& start, const VoxelIndex& goal) const {
    const auto most = static_cast<std::size_t>(solid.truncation_cells() * solid.truncation_cells());
    std::vector<std::vector<VoxelIndex>> waiting(most + 1);  // by the narrowest place so far
    std::vector<bool> seen(grid.voxel_count(), false);
    seen[grid.linear(start)] = true;
    waiting[solid.squared_cells(start)].push_back(start);
    for (std::size_t width = most + 1; width-- > 0;) {
      while (!waiting[width].empty()) {
        const VoxelIndex at = waiting[width].back();
        waiting[width].pop_back();
        if (at == goal) return static_cast<int>(width);
        for_each_move(at, [&](const VoxelIndex& to, const GridMove&) {
          if (seen[grid.linear(to)]) return;
          seen[grid.linear(to)] = true;
          waiting[std::min<std::size_t>(width, solid.squared_cells(to))].push_back(to);
        });
      }
    }
    return -1;
  }

  /// The shortest way over voxels at least so wide, from the goal back to the start.
  std::vector<VoxelIndex> shortest(const VoxelIndex& start, const VoxelIndex& goal, int width) const {
    using Waiting = std::pair<float, std::size_t>;
    std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> queue;
    std::vector<float> length(grid.voxel_count(), std::numeric_limits<float>::infinity());
    std::vector<std::size_t> before(grid.voxel_count());
    length[grid.linear(start)] = 0.0F;
    for (queue.emplace(0.0F, grid.linear(start)); !queue.empty();) {
      const auto [gone, cell] = queue.top();
      queue.pop();
      if (cell == grid.linear(goal)) break;
      if (gone > length[cell]) continue;
      const VoxelIndex at = grid.voxel(cell);
      for_each_move(at, [&](const VoxelIndex& to, const GridMove& move) {
        const std::size_t next = grid.linear(to);
        const float there = gone + std::sqrt(static_cast<float>(move.x * move.x + move.y * move.y + move.z * move.z));
        if (solid.squared_cells(to) < width || there >= length[next]) return;
        if (!check.sweep_free(grid.center_of(at), grid.center_of(to))) return;
        length[next] = there;
        before[next] = cell;
        queue.emplace(there, next);
      });
    }
    std::vector<VoxelIndex> way;
    if (std::isinf(length[grid.linear(goal)])) return way;
    for (std::size_t cell = grid.linear(goal); cell != grid.linear(start); cell = before[cell]) {
      way.push_back(grid.voxel(cell));
    }
    return way;
  }
};

PlanResult WidestPlanner::plan(const planning3d::FreeSpace& space, const planning3d::PlanRequest& request) {
  PlanResult result;
  result.status = PlanStatus::kNoPath;
  const planning3d::SegmentCheck check(space, request.keep_out, request.start_m);
  const Search search{*solid_, check, plane_};
  const VoxelIndex start = space.grid().index_of(request.start_m), goal = space.grid().index_of(request.goal_m);
  if (!check.voxel_free(start) || !check.voxel_free(goal)) return result;
  const int width = search.bottleneck(start, goal);
  const std::vector<VoxelIndex> way = width < 0 ? std::vector<VoxelIndex>{} : search.shortest(start, goal, width);
  if (way.empty()) return result;
  result.path_m = {request.start_m};
  for (std::size_t i = way.size(); i-- > 1;) result.path_m.push_back(space.grid().center_of(way[i]));
  result.path_m.push_back(request.goal_m);
  result.length_m = planning3d::path_length_m(result.path_m);
  result.status = PlanStatus::kReached;
  return result;
}

}  // namespace stairwell::train
