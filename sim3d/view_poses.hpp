/// Where a sensor could stand to look at a voxel. Internal to GroundTruth::explorable.
#pragma once

#include "core/grid_spec.hpp"
#include "core/scan.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::sim3d {

/// Elevation limits as slopes, for a sensor that may take any yaw.
class ElevationWindow {
 public:
  explicit ElevationWindow(const SensorModel& model);
  /// @param slack_m the point may be this far off
  bool contains(const Eigen::Vector3d& offset_m, double slack_m = 0.0) const;

 private:
  bool fits(double up_m, double forward_m, double slack_m) const;

  double low_;
  double high_;
  double nearest_forward_;  ///< forward over horizontal distance, at the image's left and right edge
};

/// Reachable voxel centres, thinned to one for each cell of a coarser lattice.
class ViewPoses {
 public:
  /// Cells per edge of the blocks that `around` serves.
  static constexpr int kCellsPerBlock = 2;

  ViewPoses(const GridSpec& grid, const std::vector<std::uint8_t>& reachable, const SensorModel& model);

  /// Voxels per edge of a block.
  int block_edge() const { return kCellsPerBlock * stride_; }
  /// Up to `wanted` poses from which the sensor may see something of the block of voxels with this lowest corner:
  /// the nearest ones in turn with ones from anywhere in range.
  void around(const VoxelIndex& block_corner, std::size_t wanted, std::vector<Eigen::Vector3d>& poses_m) const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  void collect(const std::vector<std::uint8_t>& reachable);
  void list_offsets(const SensorModel& model);
  bool contains(const VoxelIndex& cell) const;
  std::size_t linear(const VoxelIndex& cell) const;

  GridSpec grid_;
  int stride_;
  std::array<int, 3> size_{};
  std::vector<std::uint32_t> poses_;  ///< linear voxel index per cell, or kNone
  std::vector<VoxelIndex> nearest_;   ///< offsets in cells, nearest first
  std::vector<VoxelIndex> shuffled_;
};

}  // namespace stairwell::sim3d
