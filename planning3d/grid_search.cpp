#include "planning3d/grid_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <queue>

namespace stairwell::planning3d {

namespace {

constexpr unsigned kFromShift = 27;
constexpr std::uint32_t kBucketWidth = MoveGraph::kCost[1] / 32;

constexpr std::array<std::uint32_t, 3> kMovesOfLength = [] {
  std::array<std::uint32_t, 3> moves{};
  for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
    const GridMove& move = kGridMoves[m];
    moves[static_cast<std::size_t>(move.x * move.x + move.y * move.y + move.z * move.z) - 1] |= 1U << m;
  }
  return moves;
}();

struct Order {
  std::uint32_t least, middle, most;
};
Order ordered_gaps(const VoxelIndex& a, const VoxelIndex& b) {
  const auto x = static_cast<std::uint32_t>(std::abs(a.x - b.x));
  const auto y = static_cast<std::uint32_t>(std::abs(a.y - b.y));
  const auto z = static_cast<std::uint32_t>(std::abs(a.z - b.z));
  const std::uint32_t least = std::min(std::min(x, y), z);
  const std::uint32_t most = std::max(std::max(x, y), z);
  return {least, x + y + z - least - most, most};
}

/// The exact distance where nothing is in the way, so consistent.
std::uint32_t open_distance(const VoxelIndex& a, const VoxelIndex& b) {
  const Order gap = ordered_gaps(a, b);
  const auto& cost = MoveGraph::kCost;
  return gap.most * cost[1] + gap.middle * (cost[2] - cost[1]) + gap.least * (cost[3] - cost[2]);
}

double open_length(const VoxelIndex& a, const VoxelIndex& b) {
  const Order gap = ordered_gaps(a, b);
  return gap.most - gap.middle + std::sqrt(2.0) * (gap.middle - gap.least) + std::sqrt(3.0) * gap.least;
}

bool ends_usable(const MoveGraph& graph, const VoxelIndex& start, const VoxelIndex& goal, PlanStatus& status) {
  if (!graph.free(start)) status = PlanStatus::kStartBlocked;
  if (graph.free(start) && !graph.free(goal)) status = PlanStatus::kGoalBlocked;
  return graph.free(start) && graph.free(goal);
}

}  // namespace

double length_of(const std::vector<VoxelIndex>& cells) {
  std::array<std::size_t, 4> counts{};
  for (std::size_t i = 0; i + 1 < cells.size(); ++i) {
    const VoxelIndex step = cells[i + 1] - cells[i];
    if (std::max({std::abs(step.x), std::abs(step.y), std::abs(step.z)}) != 1) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    ++counts[static_cast<std::size_t>(step.x * step.x + step.y * step.y + step.z * step.z)];
  }
  return static_cast<double>(counts[1]) + std::sqrt(2.0) * static_cast<double>(counts[2]) +
         std::sqrt(3.0) * static_cast<double>(counts[3]);
}

struct GridAstar::Query {
  VoxelIndex goal;
  std::uint32_t last;                                              ///< the goal's cell
  std::uint32_t base_f;                                            ///< the start's
  std::uint32_t best = std::numeric_limits<std::uint32_t>::max();  ///< cost of the best way to the goal so far
};

GridAstar::GridAstar(const MoveGraph& graph) : graph_(&graph), nodes_(graph.cell_count()) {}

void GridAstar::push(std::uint32_t cell, std::uint32_t f, const Query& query) {
  const std::size_t bucket = (f - query.base_f) / kBucketWidth;
  if (bucket >= buckets_.size()) buckets_.resize(bucket + 64);
  buckets_[bucket].push_back(cell);
}

/// A way to `cell` that is shorter than, or as short as, the one known.
inline void GridAstar::improve(std::uint32_t cell, std::uint32_t g, std::uint32_t f, std::size_t by,
                               const Query& query) {
  Node& node = nodes_[cell];
  const std::uint32_t allowed = graph_->successors(cell, by);
  if (node.stamp != stamp_ || g < node.g) {
    node = {stamp_, g, allowed, allowed | static_cast<std::uint32_t>(by) << kFromShift};
    push(cell, f, query);
    return;
  }
  // Another shortest way: what it allows beyond the first counts too (see MoveGraph).
  const std::uint32_t extra = allowed & ~node.granted;
  if (extra == 0) return;
  if (node.pending == 0) push(cell, f, query);
  node.pending |= extra;
  node.granted |= extra;
}

void GridAstar::expand(std::uint32_t cell, Query& query) {
  const std::uint32_t g = nodes_[cell].g;
  const VoxelIndex v = graph_->voxel_of(cell);
  const std::uint32_t pending = nodes_[cell].pending;
  nodes_[cell].pending = 0;
  const auto& offsets = graph_->offsets();
  // The longest moves last, so that they are followed first, as in the order by which successors are left out.
  for (const std::uint32_t of_length : kMovesOfLength) {
    for (std::uint32_t moves = pending & of_length; moves != 0; moves &= moves - 1) {
      const auto m = static_cast<std::size_t>(std::countr_zero(moves));
      const GridMove& move = kGridMoves[m];
      const auto next = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell) + offsets[m]);
      const std::uint32_t next_g =
          g + MoveGraph::kCost[static_cast<std::size_t>(move.x * move.x + move.y * move.y + move.z * move.z)];
      const Node& there = nodes_[next];
      if (there.stamp == stamp_ && next_g > there.g) continue;
      const std::uint32_t f = next_g + open_distance({v.x + move.x, v.y + move.y, v.z + move.z}, query.goal);
      if (f >= query.best) continue;
      improve(next, next_g, f, m, query);
      if (next == query.last) query.best = next_g;
    }
  }
}

void GridAstar::trace(std::uint32_t first, std::uint32_t last, GridPath& path) const {
  for (std::uint32_t cell = last;;) {
    path.cells.push_back(graph_->voxel_of(cell));
    if (cell == first) break;
    const std::size_t from = nodes_[cell].granted >> kFromShift;
    cell = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell) - graph_->offsets()[from]);
  }
  std::reverse(path.cells.begin(), path.cells.end());
  path.length = length_of(path.cells);
}

GridPath GridAstar::search(const VoxelIndex& start, const VoxelIndex& goal, std::size_t max_expansions) {
  GridPath path;
  if (!ends_usable(*graph_, start, goal, path.status)) return path;
  if (++stamp_ == 0) {
    nodes_ = {};
    nodes_ = LazyArray<Node>(graph_->cell_count());
    stamp_ = 1;
  }
  for (auto& bucket : buckets_) bucket.clear();
  const std::uint32_t first = graph_->cell_of(start);
  Query query{goal, graph_->cell_of(goal), open_distance(start, goal)};
  if (first == query.last) query.best = 0;
  improve(first, 0, query.base_f, MoveGraph::kStart, query);
  const auto worth_it = [&](std::size_t b) { return query.base_f + b * std::size_t{kBucketWidth} < query.best; };
  for (std::size_t b = 0; b < buckets_.size() && worth_it(b); ++b) {
    while (!buckets_[b].empty()) {
      const std::uint32_t cell = buckets_[b].back();
      buckets_[b].pop_back();
      const Node& node = nodes_[cell];
      if (node.pending == 0) continue;
      if (node.g >= query.best || node.g + open_distance(graph_->voxel_of(cell), goal) >= query.best) continue;
      if (path.expansions++ >= max_expansions) {
        path.status = PlanStatus::kTimedOut;
        return path;
      }
      expand(cell, query);
    }
  }
  if (query.best == std::numeric_limits<std::uint32_t>::max()) return path;
  path.status = PlanStatus::kReached;
  trace(first, query.last, path);
  return path;
}

PlainGridAstar::PlainGridAstar(const MoveGraph& graph) : graph_(&graph), nodes_(graph.cell_count(), Node{}) {}

bool PlainGridAstar::swept_free(const VoxelIndex& from, const GridMove& move) const {
  for (int z = std::min(0, move.z); z <= std::max(0, move.z); ++z) {
    for (int y = std::min(0, move.y); y <= std::max(0, move.y); ++y) {
      for (int x = std::min(0, move.x); x <= std::max(0, move.x); ++x) {
        if (!graph_->free({from.x + x, from.y + y, from.z + z})) return false;
      }
    }
  }
  return true;
}

GridPath PlainGridAstar::search(const VoxelIndex& start, const VoxelIndex& goal) {
  GridPath path;
  if (!ends_usable(*graph_, start, goal, path.status)) return path;
  ++stamp_;
  struct Open {
    double f, g;
    std::uint32_t cell;
    bool operator<(const Open& other) const { return f > other.f || (f == other.f && g < other.g); }
  };
  std::priority_queue<Open> open;
  const std::uint32_t first = graph_->cell_of(start);
  const std::uint32_t last = graph_->cell_of(goal);
  nodes_[first] = {0.0, stamp_, static_cast<std::uint8_t>(MoveGraph::kStart), false};
  open.push({open_length(start, goal), 0.0, first});
  while (!open.empty()) {
    const Open best = open.top();
    open.pop();
    Node& node = nodes_[best.cell];
    if (node.closed) continue;
    node.closed = true;
    if (best.cell == last) break;
    ++path.expansions;
    const VoxelIndex v = graph_->voxel_of(best.cell);
    for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
      const GridMove& move = kGridMoves[m];
      if (!swept_free(v, move)) continue;
      const VoxelIndex to{v.x + move.x, v.y + move.y, v.z + move.z};
      const std::uint32_t next = graph_->cell_of(to);
      const double g = node.g + std::sqrt(static_cast<double>(move.x * move.x + move.y * move.y + move.z * move.z));
      Node& there = nodes_[next];
      if (there.stamp == stamp_ && (there.closed || g >= there.g)) continue;
      there = {g, stamp_, static_cast<std::uint8_t>(m), false};
      open.push({g + open_length(to, goal), g, next});
    }
  }
  if (nodes_[last].stamp != stamp_ || !nodes_[last].closed) return path;
  path.status = PlanStatus::kReached;
  for (std::uint32_t cell = last; cell != first;
       cell = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell) - graph_->offsets()[nodes_[cell].from])) {
    path.cells.push_back(graph_->voxel_of(cell));
  }
  path.cells.push_back(start);
  std::reverse(path.cells.begin(), path.cells.end());
  path.length = length_of(path.cells);
  return path;
}

}  // namespace stairwell::planning3d
