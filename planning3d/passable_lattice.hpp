#pragma once

#include "planning3d/free_space.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// Cells `cell_voxels` voxels wide over a grid, with a border of one cell on every side.
struct LatticeFrame {
  GridSpec grid;
  int cell_voxels = 1;
  std::array<int, 3> size{0, 0, 0};  ///< cells per axis, border included

  std::size_t cell_count() const {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  }
  std::size_t cell_of(const VoxelIndex& v) const {
    const auto x = static_cast<std::size_t>(v.x / cell_voxels + 1);
    const auto y = static_cast<std::size_t>(v.y / cell_voxels + 1);
    const auto z = static_cast<std::size_t>(v.z / cell_voxels + 1);
    return (z * static_cast<std::size_t>(size[1]) + y) * static_cast<std::size_t>(size[0]) + x;
  }
  Eigen::Vector3d center_of(std::size_t cell) const;
  friend bool operator==(const LatticeFrame&, const LatticeFrame&) = default;
};

/// Which cells of a coarser lattice hold a traversable voxel, brought up to date from what changed. Cells are `stride`
/// voxels wide and have a border of one impassable cell on every side.
class PassableLattice {
 public:
  /// @param stride voxels per cell edge; 0 chooses about 0.2 m, and up to 0.4 m where the grid is so large that such
  /// cells would be more than one and a half million.
  explicit PassableLattice(int stride = 0) : stride_(stride) {}

  /// Looks only where distances changed since the last call, if that was for the same field, rule and robot.
  void update(const FreeSpace& space, const MotionRule& rule);

  const LatticeFrame& frame() const { return frame_; }

  static constexpr std::uint8_t kPassable = 1;
  static constexpr std::uint8_t kLevel = 2;  ///< slice rule: horizontal moves are allowed
  const std::vector<std::uint8_t>& flags() const { return flags_; }

 private:
  /// What the flags were made for.
  struct Basis {
    std::uint64_t field_id = 0;
    int least = 0;  ///< squared cells
    VoxelIndex lo, hi;
    MotionRule::Kind kind = MotionRule::Kind::kVolume;
    std::vector<double> layers_m;
    friend bool operator==(const Basis&, const Basis&) = default;
  };
  void resize(const GridSpec& grid);
  void mark(const FreeSpace& space, const mapping::VoxelBox& box);

  int stride_;
  LatticeFrame frame_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint8_t> level_;  ///< by z of a voxel
  Basis basis_;
  std::uint64_t revision_ = 0;  ///< of the field
};

}  // namespace stairwell::planning3d
