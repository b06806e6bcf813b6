#pragma once

#include "core/aabb.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>

namespace stairwell {

/// Cell of a GridSpec, counted from its lowest corner.
struct VoxelIndex {
  int x = 0;
  int y = 0;
  int z = 0;

  friend bool operator==(const VoxelIndex&, const VoxelIndex&) = default;
  friend VoxelIndex operator+(const VoxelIndex& a, const VoxelIndex& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend VoxelIndex operator-(const VoxelIndex& a, const VoxelIndex& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};

/// A finite lattice of cubic voxels whose faces lie on integer multiples of the resolution, so that its voxels
/// are exactly OctoMap's: voxel `v` is the OctoMap key `first_cell + v + 32768` per axis.
class GridSpec {
 public:
  GridSpec() = default;

  /// The smallest lattice that covers `box`. A face within 1e-6 voxels of a lattice plane counts as on it.
  /// @throws InputError for an empty, non-finite or over-large box (key space 2^16 per axis) or resolution <= 0.
  GridSpec(const Aabb& box, double resolution_m);

  double resolution_m() const { return resolution_m_; }
  const std::array<int, 3>& size() const { return size_; }
  /// Signed lattice coordinate of voxel (0,0,0): its lowest corner is `first_cell * resolution`.
  const std::array<int, 3>& first_cell() const { return first_cell_; }
  std::size_t voxel_count() const {
    return static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
  }
  double voxel_volume_m3() const { return resolution_m_ * resolution_m_ * resolution_m_; }
  Aabb box() const;

  bool contains(const VoxelIndex& v) const {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < size_[0] && v.y < size_[1] && v.z < size_[2];
  }
  bool contains(const Eigen::Vector3d& point_m) const { return contains(index_of(point_m)); }

  /// Voxel that holds the point (lower faces inclusive); may lie outside the grid.
  VoxelIndex index_of(const Eigen::Vector3d& point_m) const {
    return {lattice(point_m.x()) - first_cell_[0], lattice(point_m.y()) - first_cell_[1],
            lattice(point_m.z()) - first_cell_[2]};
  }
  Eigen::Vector3d center_of(const VoxelIndex& v) const {
    return {(first_cell_[0] + v.x + 0.5) * resolution_m_, (first_cell_[1] + v.y + 0.5) * resolution_m_,
            (first_cell_[2] + v.z + 0.5) * resolution_m_};
  }

  /// x runs fastest. @pre contains(v)
  std::size_t linear(const VoxelIndex& v) const {
    return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(v.y)) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(v.x);
  }
  VoxelIndex voxel(std::size_t linear_index) const;

  friend bool operator==(const GridSpec&, const GridSpec&) = default;

 private:
  /// floor(coordinate * per_m_) without the library call.
  int lattice(double coordinate_m) const {
    const double scaled = coordinate_m * per_m_;
    const int truncated = static_cast<int>(scaled);
    return truncated - (scaled < truncated ? 1 : 0);
  }

  double resolution_m_ = 0.0;
  double per_m_ = 0.0;  ///< 1/resolution as OctoMap computes it, so that both put a point into the same voxel
  std::array<int, 3> first_cell_{0, 0, 0};
  std::array<int, 3> size_{0, 0, 0};
};

}  // namespace stairwell
