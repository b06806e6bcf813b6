#pragma once

#include "planning3d/lazy_array.hpp"
#include "planning3d/move_graph.hpp"
#include "planning3d/planner.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace stairwell::planning3d {

/// A path on the lattice.
struct GridPath {
  PlanStatus status = PlanStatus::kNoPath;
  std::vector<VoxelIndex> cells;                             ///< start to goal; empty unless reached
  double length = std::numeric_limits<double>::quiet_NaN();  ///< in cells: moves of 1, sqrt(2) and sqrt(3)
  std::size_t expansions = 0;
};

/// Shortest paths by single moves of a MoveGraph: A* with the exact distance in open space as heuristic, the graph's
/// pruned successors, whole-numbered costs and a queue of narrow buckets (last in, first out, so that ties are
/// followed in depth). Exact. Keeps working memory between searches; holds a reference to the graph.
class GridAstar {
 public:
  explicit GridAstar(const MoveGraph& graph);
  GridPath search(const VoxelIndex& start, const VoxelIndex& goal, std::size_t max_expansions = kNoLimit);

  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

 private:
  struct Node {
    std::uint32_t stamp;    ///< of the search that wrote the rest; 0 = none yet
    std::uint32_t g;        ///< MoveGraph::kCost units
    std::uint32_t pending;  ///< moves to be made when next taken from the queue
    std::uint32_t granted;  ///< moves that some shortest way so far allows, and above them the move that led here
  };
  struct Query;

  void push(std::uint32_t cell, std::uint32_t f, const Query& query);
  void expand(std::uint32_t cell, Query& query);
  void improve(std::uint32_t cell, std::uint32_t g, std::uint32_t f, std::size_t by, const Query& query);
  void trace(std::uint32_t first, std::uint32_t last, GridPath& path) const;

  const MoveGraph* graph_;
  LazyArray<Node> nodes_;
  std::uint32_t stamp_ = 0;
  std::vector<std::vector<std::uint32_t>> buckets_;  ///< cells, by f above the start's
};

/// The same answers by A* as textbooks have it (binary heap, all moves tried one by one): the measure for GridAstar.
class PlainGridAstar {
 public:
  explicit PlainGridAstar(const MoveGraph& graph);
  GridPath search(const VoxelIndex& start, const VoxelIndex& goal);

 private:
  struct Node {
    double g;
    std::uint32_t stamp;
    std::uint8_t from;
    bool closed;
  };
  bool swept_free(const VoxelIndex& from, const GridMove& move) const;

  const MoveGraph* graph_;
  std::vector<Node> nodes_;
  std::uint32_t stamp_ = 0;
};

/// Sum of the moves between consecutive cells; NaN when two are no move apart.
double length_of(const std::vector<VoxelIndex>& cells);

}  // namespace stairwell::planning3d
