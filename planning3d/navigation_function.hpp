#pragma once

#include "planning3d/planner.hpp"
#include "planning3d/search_memory.hpp"
#include "planning3d/segment_check.hpp"

#include <functional>
#include <limits>
#include <optional>
#include <vector>

namespace stairwell::planning3d {

/// Geodesic (wavefront) distance to a goal over the free space, as a potential without minima but the goal (Rimon and
/// Koditschek 1992 name such functions). Dijkstra from the goal over the voxels and moves of AstarPlanner (26; slice
/// rule: 8 in the layers and vertically anywhere), so that it is never more optimistic than that.
///
/// A hill (another potential, such as U_rep) may lie beside it. Then every climb of the hill on the way is paid for,
/// so that the sum of both falls along `next` by at least `per_metre` times the way: the sum has no minimum on the
/// voxels either. Memory is kept between calls.
class NavigationFunction {
 public:
  static constexpr double kUnreachable = std::numeric_limits<double>::infinity();
  using Hill = std::function<double(const VoxelIndex&)>;

  /// What it is spread for, beside the request's rule, keep-out spheres and limits.
  struct Source {
    VoxelIndex goal;
    std::optional<VoxelIndex> until;  ///< spread only until a little beyond this voxel; none: everywhere
    double per_metre = 1.0;           ///< potential
    Hill hill;                        ///< asked about once per voxel; may be empty
  };
  /// @return kReached (also without `until`), kNoPath when `until` is cut off, or kTimedOut
  PlanStatus compute(const FreeSpace& space, const PlanRequest& request, const SegmentCheck& check,
                     const Source& source);

  /// At a voxel's centre; kUnreachable where the wave did not come.
  double at(const VoxelIndex& v) const;
  /// Trilinear between the centres of those of the eight voxels around that are reachable (slice rule: of the four of
  /// its height). kUnreachable in a voxel that is not.
  double value(const Eigen::Vector3d& point_m) const;
  /// The neighbour through which the wave came; none at the goal and where it did not come.
  std::optional<VoxelIndex> next(const VoxelIndex& v) const;
  /// Whether the rule allows horizontal moves at this height.
  bool level(int z) const { return level_[static_cast<std::size_t>(z)] != 0; }
  std::size_t expansions() const { return expansions_; }

 private:
  struct Node {
    float cost;
    float hill;
    std::uint32_t stamp;  ///< of the computation that wrote the rest; 0 = none yet
    std::uint8_t move;    ///< from the neighbour `next` to here
    bool closed;
  };
  struct Wave;

  void expand(const Wave& wave, std::uint32_t cell);

  SearchMemory<Node> nodes_;
  std::vector<std::uint8_t> level_;
  bool slice_ = false;
  std::size_t expansions_ = 0;
};

}  // namespace stairwell::planning3d
