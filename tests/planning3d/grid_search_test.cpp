#include "planning3d/grid_search.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <queue>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

struct Cells {
  std::array<int, 3> size;
  std::vector<std::uint8_t> free;

  std::size_t place(const VoxelIndex& v) const {
    return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(v.y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(v.x);
  }
  bool is_free(const VoxelIndex& v) const {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < size[0] && v.y < size[1] && v.z < size[2] && free[place(v)] != 0;
  }
  /// Every cell of the box between the two is free.
  bool box_free(const VoxelIndex& a, const VoxelIndex& b) const {
    for (int z = std::min(a.z, b.z); z <= std::max(a.z, b.z); ++z) {
      for (int y = std::min(a.y, b.y); y <= std::max(a.y, b.y); ++y) {
        for (int x = std::min(a.x, b.x); x <= std::max(a.x, b.x); ++x) {
          if (!is_free({x, y, z})) return false;
        }
      }
    }
    return true;
  }
};

Cells random_cells(Rng& rng, const std::array<int, 3>& size, double blocked) {
  Cells cells{size, {}};
  cells.free.resize(static_cast<std::size_t>(size[0] * size[1] * size[2]));
  for (auto& cell : cells.free) cell = rng.uniform(0.0, 1.0) < blocked ? 0 : 1;
  return cells;
}

std::vector<double> dijkstra(const Cells& cells, const VoxelIndex& from) {
  std::vector<double> cost(cells.free.size(), INFINITY);
  struct Entry {
    double cost;
    VoxelIndex at;
    bool operator<(const Entry& other) const { return cost > other.cost; }
  };
  std::priority_queue<Entry> open;
  cost[cells.place(from)] = 0.0;
  open.push({0.0, from});
  while (!open.empty()) {
    const Entry best = open.top();
    open.pop();
    if (best.cost > cost[cells.place(best.at)]) continue;
    for (int move = 0; move < 27; ++move) {
      const VoxelIndex d{move % 3 - 1, move / 3 % 3 - 1, move / 9 - 1};
      if (move == 13 || !cells.box_free(best.at, best.at + d)) continue;
      const double c = best.cost + std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
      if (c >= cost[cells.place(best.at + d)]) continue;
      cost[cells.place(best.at + d)] = c;
      open.push({c, best.at + d});
    }
  }
  return cost;
}

std::string grid_path_problem(const Cells& cells, const GridPath& path, const VoxelIndex& from, const VoxelIndex& to) {
  if (path.cells.empty() || !(path.cells.front() == from) || !(path.cells.back() == to)) return "wrong ends";
  for (std::size_t i = 0; i + 1 < path.cells.size(); ++i) {
    if (!cells.box_free(path.cells[i], path.cells[i + 1])) return "cuts a corner at move " + std::to_string(i);
  }
  return length_of(path.cells) == path.length ? "" : "wrong length";
}

}  // namespace

TEST_CASE("the fast grid search finds Dijkstra's lengths, and so does the plain one", "[grid]") {
  Rng rng = make_rng(11, "grid-search");
  int reached = 0, cut_off = 0;
  for (int round = 0; round < 60; ++round) {
    const std::array<int, 3> size{rng.uniform_int(1, 24), rng.uniform_int(1, 24), rng.uniform_int(1, 14)};
    const Cells cells = random_cells(rng, size, 0.01 + 0.55 * rng.uniform(0.0, 1.0) * rng.uniform(0.0, 1.0));
    const MoveGraph graph(size, cells.free);
    GridAstar fast(graph);
    PlainGridAstar plain(graph);
    const auto anywhere = [&] {
      return VoxelIndex{rng.uniform_int(0, size[0] - 1), rng.uniform_int(0, size[1] - 1),
                        rng.uniform_int(0, size[2] - 1)};
    };
    const VoxelIndex start = anywhere();
    if (!cells.is_free(start)) continue;
    const std::vector<double> least = dijkstra(cells, start);
    for (int query = 0; query < 40; ++query) {
      const VoxelIndex goal = anywhere();
      const GridPath path = fast.search(start, goal);
      const GridPath reference = plain.search(start, goal);
      CHECK(path.status == reference.status);
      if (!cells.is_free(goal)) {
        CHECK(path.status == PlanStatus::kGoalBlocked);
      } else if (std::isinf(least[cells.place(goal)])) {
        CHECK(path.status == PlanStatus::kNoPath);
        CHECK(path.cells.empty());
        ++cut_off;
      } else {
        REQUIRE(path.status == PlanStatus::kReached);
        CHECK(path.length == Approx(least[cells.place(goal)]).margin(1e-6));
        CHECK(reference.length == Approx(least[cells.place(goal)]).margin(1e-6));
        CHECK(grid_path_problem(cells, path, start, goal) == "");
        CHECK(grid_path_problem(cells, reference, start, goal) == "");
        ++reached;
      }
    }
  }
  CHECK(reached > 500);
  CHECK(cut_off > 10);
}

TEST_CASE("moves are there when the box they sweep is free", "[grid]") {
  Rng rng = make_rng(12, "move-graph");
  const Cells cells = random_cells(rng, {9, 7, 8}, 0.25);
  const MoveGraph graph(cells.size, cells.free);
  std::size_t pruned = 0;
  for (int z = 0; z < 8; ++z) {
    for (int y = 0; y < 7; ++y) {
      for (int x = 0; x < 9; ++x) {
        const VoxelIndex v{x, y, z};
        CHECK(graph.voxel_of(graph.cell_of(v)) == v);
        REQUIRE(graph.free(v) == cells.is_free(v));
        const std::uint32_t moves = graph.moves(graph.cell_of(v));
        for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
          const VoxelIndex to{x + kGridMoves[m].x, y + kGridMoves[m].y, z + kGridMoves[m].z};
          CHECK((moves >> m & 1U) == (cells.box_free(v, to) ? 1U : 0U));
          const std::uint32_t after = graph.successors(graph.cell_of(v), m);
          CHECK((after & ~moves) == 0);
          pruned += after != moves ? 1 : 0;
        }
      }
    }
  }
  CHECK(pruned > 1000);
}

TEST_CASE("open space: one straight line of expansions; ends that cannot be used are named", "[grid]") {
  Cells cells{{30, 20, 10}, std::vector<std::uint8_t>(6000, 1)};
  cells.free[cells.place({5, 5, 5})] = 0;
  const MoveGraph graph(cells.size, cells.free);
  GridAstar search(graph);
  const GridPath path = search.search({29, 19, 9}, {0, 0, 0});
  CHECK(path.length == Approx(9 * std::sqrt(3.0) + 10 * std::sqrt(2.0) + 10));
  CHECK(path.expansions <= 40);
  CHECK(search.search({5, 5, 5}, {0, 0, 0}).status == PlanStatus::kStartBlocked);
  CHECK(search.search({0, 0, 0}, {30, 0, 0}).status == PlanStatus::kGoalBlocked);
  CHECK(search.search({0, 0, 0}, {29, 19, 9}, 5).status == PlanStatus::kTimedOut);
  const GridPath nowhere = search.search({1, 2, 3}, {1, 2, 3});
  CHECK(nowhere.status == PlanStatus::kReached);
  CHECK(nowhere.cells.size() == 1);
  CHECK(nowhere.length == 0.0);
  CHECK_THROWS_AS(MoveGraph({3, 3, 3}, std::vector<std::uint8_t>(26, 1)), InputError);
  CHECK_THROWS_AS(MoveGraph({0, 3, 3}, {}), InputError);
}
