#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::apps {

/// A bit for each voxel of a grid, by linear index, so that short rows along x are read at once.
class VoxelBits {
 public:
  explicit VoxelBits(std::size_t voxels) : words_(voxels / 64 + 2, 0) {}

  bool operator[](std::size_t voxel) const { return (words_[voxel >> 6] >> (voxel & 63) & 1U) != 0; }
  void flip(std::size_t voxel) { words_[voxel >> 6] ^= std::uint64_t{1} << (voxel & 63); }
  /// Eight voxels from this one on, the first one lowest. Those behind the last one of the grid are 0.
  std::uint32_t eight_from(std::size_t voxel) const {
    const unsigned shift = voxel & 63;
    const std::uint64_t low = words_[voxel >> 6] >> shift;
    const std::uint64_t high = shift > 56 ? words_[(voxel >> 6) + 1] << (64 - shift) : 0;
    return static_cast<std::uint32_t>((low | high) & 0xFFU);
  }

 private:
  std::vector<std::uint64_t> words_;
};

}  // namespace stairwell::apps
