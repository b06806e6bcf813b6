#pragma once

#include "planning3d/planner.hpp"
#include "planning3d/segment_check.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// The slice rule as a graph: layers, in which one moves horizontally, and openings, which are columns of voxels that
/// are traversable all the way from a layer to the next (stair voids, shafts, atria, or the room above one's head).
/// Start and goal beside the layers are reached straight up or down. Holds references.
class LayerGraph {
 public:
  LayerGraph(const FreeSpace& space, const SegmentCheck& check, const MotionRule& rule, const VoxelIndex& start,
             const VoxelIndex& goal);

  /// A part of a way: within a layer (from.z == to.z), or straight up or down through an opening.
  struct Leg {
    VoxelIndex from;
    VoxelIndex to;
    bool level() const { return from.z == to.z; }
  };
  /// The shortest way by moves between neighbouring voxels (geodesic), which decides through which openings to go.
  /// Layers other than the start's and the goal's count a little more, so that they are used only where that helps.
  /// kNoPath only when start and goal are not connected by layers and openings.
  struct Route {
    PlanStatus status = PlanStatus::kNoPath;
    std::vector<Leg> legs;  ///< alternately horizontal (maybe within one voxel) and vertical, horizontal at both ends
    std::size_t expansions = 0;
  };
  Route route(const PlanRequest& limits) const;

  /// Whether a column is free from one of the heights to another. @pre both within the grid
  bool open(const VoxelIndex& from, int to_z) const;

 private:
  struct Node;
  struct Search;
  struct Floor {
    int z;
    bool level;   ///< horizontal moves are allowed
    float price;  ///< of a voxel's length
  };
  void expand(Search& search, std::uint32_t node) const;
  std::vector<Leg> trace(const Search& search, std::uint32_t last) const;
  std::uint32_t node_of(std::size_t floor, int x, int y) const;
  VoxelIndex voxel_of(std::uint32_t node) const;
  std::size_t floor_of(int z) const;

  const FreeSpace& space_;
  const SegmentCheck& check_;
  VoxelIndex start_, goal_;
  std::vector<Floor> floors_;  ///< from below: layers, and the heights of start and goal
};

}  // namespace stairwell::planning3d
