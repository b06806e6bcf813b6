#pragma once

#include "planning3d/plan_ends.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/search_memory.hpp"

#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// Lazy Theta* (Nash, Koenig and Tovey 2010) over traversable voxels: parents are any voxel in sight, sight is checked
/// (exactly, by voxel traversal with the robot's clearance) only when a voxel is expanded. Then the string is pulled:
/// corners that are not needed are left out, the others moved while that shortens the path. Costs, snapping of start
/// and goal, and the slice rule are those of AstarPlanner. Working memory is kept between calls.
class ThetaPlanner final : public Planner {
 public:
  /// Settings of the search.
  struct Config {
    double heuristic_weight = 1.0;
    double comfort_m = 0.5;
    bool pull_string = true;
  };
  ThetaPlanner() = default;
  explicit ThetaPlanner(const Config& config) : config_(config) {}

  std::string_view name() const override { return "theta"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;

 private:
  struct Node {
    float g;              ///< voxel lengths, weighted
    float near;           ///< extra cost along the straight line from the parent
    std::uint32_t stamp;  ///< of the search that wrote the rest; 0 = none yet
    std::uint32_t parent;
    bool checked;  ///< the parent is in sight and g is exact
    bool closed;
  };
  struct Search;

  void prepare(const FreeSpace& space, const PlanRequest& request);
  PlanStatus search(Search& search);
  void push(const Search& search, std::uint32_t cell, const VoxelIndex& v);
  bool check_parent(const Search& search, std::uint32_t cell, const VoxelIndex& v);
  void step_from_neighbour(const Search& search, std::uint32_t cell, const VoxelIndex& v);
  void expand(const Search& search, std::uint32_t cell, const VoxelIndex& v);
  std::vector<Eigen::Vector3d> trace(const Search& search) const;
  void pull(const Search& search, std::vector<Eigen::Vector3d>& path_m) const;
  bool drop_corners(const Search& search, std::vector<Eigen::Vector3d>& path_m) const;
  bool move_corner(const Search& search, std::vector<Eigen::Vector3d>& path_m, std::size_t corner, double step_m) const;
  float extra_along(const Search& search, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) const;
  double cost(const Search& search, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) const;

  Config config_{};
  SearchMemory<Node> nodes_;
  std::vector<float> nearness_;      ///< by squared distance in cells
  std::vector<std::uint8_t> level_;  ///< by z: horizontal moves allowed
};

}  // namespace stairwell::planning3d
