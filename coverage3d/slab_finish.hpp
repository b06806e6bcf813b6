#pragma once

#include "coverage3d/frontier_finder.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

namespace stairwell::coverage3d {

/// The rule by which C2-Explorer's UAVs are done (frontier_finder.cpp and its launch files, fd1c76a): frontier voxels
/// of a horizontal slab (FrontierConfig::planar) that touch form a region; regions of more than 60 voxels are cut into
/// pieces within 3 m of their mean, and a piece is open while some pose 0.5 to 1 m beside its mean, at the same height,
/// is 0.2 m clear of obstacles, has known voxels around it and sees more than 10 of the piece's voxels, 5 deg below to
/// 50 deg above the horizontal. A voxel is seen when no voxel from itself to the pose is unknown or within 0.2 m, per
/// axis, of an occupied one (countVisibleCells, getInflateOccupancy): what hugs a known wall does not count, a
/// stretch of wall that nobody has hit does.
class SlabFinish {
 public:
  /// @param past_walls  stricter than published: only occupied and unknown voxels hide others, not their surroundings
  explicit SlabFinish(bool past_walls = false) : past_walls_(past_walls) {}

  /// @param finder planar, brought up to date with the map
  void update(const mapping::OccupancyMap& map, const FrontierFinder& finder);

  bool met() const { return open_pieces_ == 0; }
  std::size_t open_pieces() const { return open_pieces_; }
  /// Whether the finder's cluster has voxels in an open piece.
  bool counts(std::uint32_t cluster) const { return counted_.contains(cluster); }

 private:
  bool past_walls_;
  std::size_t open_pieces_ = 0;
  std::set<std::uint32_t> counted_;
};

/// What SlabFinish asks of a finder: planar, in the part of `task_box` between the two heights.
FrontierConfig slab_frontiers(const Aabb& task_box, double lo_m, double hi_m);

}  // namespace stairwell::coverage3d
