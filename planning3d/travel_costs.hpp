#pragma once

#include "planning3d/free_space.hpp"

#include <cstdint>
#include <limits>
#include <vector>

namespace stairwell::planning3d {

/// Geodesic distances from one position over the free space, on a lattice of cells `stride` voxels wide (a cell is
/// passable when any of its voxels is traversable, so the answer is optimistic by at most a cell). Dijkstra with
/// 26-neighbour moves (slice rule: 8 in the layers, 2 vertical).
class TravelCosts {
 public:
  static constexpr float kUnreachable = std::numeric_limits<float>::infinity();

  /// @param stride voxels per cell edge; 0 chooses about 0.2 m.
  explicit TravelCosts(int stride = 0) : stride_(stride) {}

  /// Recomputes from `source_m`. Cells farther than `limit_m` stay unreachable.
  void compute(const FreeSpace& space, const Eigen::Vector3d& source_m, const MotionRule& rule,
               double limit_m = std::numeric_limits<double>::infinity());

  /// Metres along the shortest way; kUnreachable where there is none.
  float distance_m(const VoxelIndex& v) const;
  float distance_m(const Eigen::Vector3d& point_m) const;

 private:
  int stride_;
  GridSpec grid_;
  int size_[3] = {0, 0, 0};
  std::vector<float> cost_m_;
};

}  // namespace stairwell::planning3d
