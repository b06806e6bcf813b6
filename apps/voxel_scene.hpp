#pragma once

#include "core/occupancy.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <vector>

namespace stairwell::apps {

/// Dense copy of the part of a map that holds something solid, for drawing.
struct VoxelScene {
  double resolution_m = 0.1;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< lowest corner of voxel (0,0,0)
  std::array<int, 3> size{0, 0, 0};
  std::vector<Occupancy> cells;  ///< x runs fastest

  bool contains(int x, int y, int z) const {
    return x >= 0 && y >= 0 && z >= 0 && x < size[0] && y < size[1] && z < size[2];
  }
  std::size_t linear(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(x);
  }
  Occupancy at(int x, int y, int z) const { return contains(x, y, z) ? cells[linear(x, y, z)] : Occupancy::kUnknown; }
  bool empty() const { return cells.empty(); }
};

/// The bounding box of the occupied voxels and one voxel around it. A map without free voxels (a bare model) is taken
/// as open everywhere. Empty when nothing is occupied.
VoxelScene make_scene(const mapping::OccupancyMap& map);

/// One level of a building: voxel layers [lo, cut] are drawn; what lies above `cut` is cut away.
struct Storey {
  int lo = 0;
  int floor = 0;  ///< layer whose top is walked on
  int cut = 0;
  double floor_m = 0.0;    ///< height of the walking surface
  double ceiling_m = 0.0;  ///< where the next storey begins, or the top of the map
};

/// Storeys as perception::detect_storeys finds their floors; at least one for a scene that is not empty.
/// @param keep share of each storey's height that stays after cutting, in (0, 1].
std::vector<Storey> find_storeys(const VoxelScene& scene, double keep);

}  // namespace stairwell::apps
