#pragma once

#include "planning3d/plan_ends.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/region_graph.hpp"
#include "planning3d/search_memory.hpp"

#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// A* over traversable voxels with 26 moves (slice rule: 8 at layer heights, vertical anywhere), followed by string
/// pulling. Costs metres times 1 + clearance_weight * nearness, where nearness falls from 1 at the least clearance
/// to 0 at `comfort_m` beyond it. In large grids (volume rule) a search that becomes long begins anew, led by the
/// lengths of ways that a RegionGraph knows: its path may be some tenths longer than the best. Start and goal up to 0.3
/// m off traversable space are led to the nearest of it. Working memory is kept between calls.
class AstarPlanner final : public Planner {
 public:
  /// Settings of the search.
  struct Config {
    double heuristic_weight = 1.0;  ///< above 1: costs up to this many times the least, fewer expansions
    double comfort_m = 0.5;
    bool pull_string = true;
    std::size_t led_after = 8'000;      ///< expansions after which a search is long, ...
    std::size_t led_from = 20'000'000;  ///< ... in grids of so many voxels and more
  };
  AstarPlanner() = default;
  explicit AstarPlanner(const Config& config) : config_(config) {}

  std::string_view name() const override { return "astar"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;

  /// Cost of the last path on the lattice, before string pulling (tests, benchmarks); NaN if there was none.
  double lattice_cost_m() const { return lattice_cost_m_; }

 private:
  struct Node {
    float g;
    std::uint32_t stamp;  ///< of the search that wrote the rest; 0 = none yet
    std::uint8_t from;
    bool closed;
  };
  struct Search;

  void prepare(const FreeSpace& space, const PlanRequest& request);
  PlanStatus search(Search& search);
  PlanStatus search_led(Search& search);
  std::vector<VoxelIndex> trace(const Search& search) const;
  std::vector<Eigen::Vector3d> pull(const Search& search, const std::vector<VoxelIndex>& cells) const;

  Config config_{};
  SearchMemory<Node> nodes_;
  PassableLattice lattice_;
  RegionGraph regions_;
  struct {
    std::uint32_t goal = RegionGraph::kNone;
    std::uint32_t start = RegionGraph::kNone;
    std::vector<float> lengths;  ///< between them, by part of the graph as it was last
  } led_;
  std::vector<float> nearness_;      ///< by squared distance in cells
  std::vector<std::uint8_t> level_;  ///< by z: horizontal moves allowed
  double lattice_cost_m_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace stairwell::planning3d
