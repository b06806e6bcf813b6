/// Solid voxels and the surface they show: the one road from every voxel input (OctoMap, clouds, images, .3dmap) to
/// triangles.
#pragma once

#include "sim3d/world.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stairwell::sim3d {

/// Cells of a lattice, as packed integer coordinates: cell (i,j,k) reaches from edge*(i,j,k) to edge*(i+1,j+1,k+1).
class SolidVoxels {
 public:
  static constexpr std::int64_t kMinCell = -(1 << 20) + 1;
  static constexpr std::int64_t kMaxCell = (1 << 20) - 2;
  /// More than this many cells are refused (memory).
#if defined(FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION)
  static constexpr std::size_t kMaxCount = 200'000;  ///< a fuzzer's time is short
#else
  static constexpr std::size_t kMaxCount = 64'000'000;
#endif

  void reserve(std::size_t count) { keys_.reserve(count); }
  static bool representable(std::int64_t cell) { return cell >= kMinCell && cell <= kMaxCell; }
  /// Adding a cell twice does no harm. @pre all three representable
  void add(std::int64_t x, std::int64_t y, std::int64_t z) { keys_.push_back(pack(x, y, z)); }
  std::size_t added() const { return keys_.size(); }
  /// Sorts and removes duplicates; called by exposed_faces too.
  void settle();

  /// Fills every cell that lies between two solid ones along an axis: the holes of a surface whose samples are a cell
  /// apart.
  void close_gaps();

  /// The faces between a solid cell and a cell that is not solid, outward winding, merged into rectangles.
  TriangleMesh exposed_faces(const Eigen::Vector3d& edge_m);

 private:
  static std::uint64_t pack(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kOffset = 1 << 20;
    return static_cast<std::uint64_t>(z + kOffset) << 42 | static_cast<std::uint64_t>(y + kOffset) << 21 |
           static_cast<std::uint64_t>(x + kOffset);
  }
  std::vector<std::uint64_t> keys_;
};

}  // namespace stairwell::sim3d
