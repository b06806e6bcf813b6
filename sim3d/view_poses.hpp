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

 private:
  friend class PosesAround;
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

/// Poses from which the sensor may see something of a block of voxels: the nearest ones in turn with ones from anywhere
/// in range, made as they are asked for.
class PosesAround {
 public:
  explicit PosesAround(const ViewPoses& from) : from_(from) {}

  /// Begins anew, for the block with this lowest corner.
  void move_to(const VoxelIndex& block_corner);
  /// Whether there is an i-th one. Those before it have been asked for.
  bool has(std::size_t i);
  /// @pre has(i)
  const Eigen::Vector3d& operator[](std::size_t i) const { return poses_m_[i]; }
  /// Puts the i-th one before the others, which keep their order. @pre has(i)
  void move_to_front(std::size_t i);

 private:
  void offer(const VoxelIndex& offset);

  const ViewPoses& from_;
  VoxelIndex middle_;     ///< cell
  std::size_t turn_ = 0;  ///< where in the shuffled list it starts
  std::size_t next_ = 0;  ///< in both lists
  std::vector<Eigen::Vector3d> poses_m_;
};

}  // namespace stairwell::sim3d
