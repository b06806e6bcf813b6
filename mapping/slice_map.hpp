/// Two-dimensional maps of a height band of the 3D map, as a planner for one storey layer uses them.
#pragma once

#include "mapping/occupancy_map.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::mapping {

/// Heights in the world frame. A voxel layer belongs to the band when its centre does.
struct HeightBand {
  double lo_m = 0.8;
  double hi_m = 1.2;
};

/// Columns of the band, x fastest: occupied if any voxel of the column's band is occupied; free if none is occupied
/// and at least one is free (unknown voxels above and below it do not count); else unknown.
class SliceMap {
 public:
  /// @throws InputError when no voxel layer of the map lies in the band.
  SliceMap(const OccupancyMap& map, const HeightBand& band);

  const std::array<int, 2>& size() const { return size_; }
  /// First and last voxel layer of the band.
  int lowest_layer() const { return lowest_; }
  int highest_layer() const { return highest_; }

  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < size_[0] && y < size_[1]; }
  /// kUnknown outside.
  Occupancy at(int x, int y) const { return contains(x, y) ? cells_[index(x, y)] : Occupancy::kUnknown; }

  /// Fills the inflation layer: every cell whose centre is nearer than `radius_m` to an occupied cell's square.
  /// The occupancy layer stays as it is.
  void inflate(double radius_m);
  /// Within the inflation radius of an occupied cell, or occupied itself.
  bool inflated(int x, int y) const { return contains(x, y) && inflated_[index(x, y)] != 0; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_[0]) + static_cast<std::size_t>(x);
  }

  double resolution_m_ = 0.0;
  std::array<int, 2> size_{0, 0};
  int lowest_ = 0;
  int highest_ = -1;
  std::vector<Occupancy> cells_;
  std::vector<std::uint8_t> inflated_;
};

/// Recovery: makes occupied voxels in `region` unknown again unless they are at least `keep_probability` likely, so
/// that stale obstacles (something that moved on, a single stray return) are looked at afresh. @return voxels cleared
std::size_t clear_stale(OccupancyMap& map, const Aabb& region, double keep_probability);

}  // namespace stairwell::mapping
