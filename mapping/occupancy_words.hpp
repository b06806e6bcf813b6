#pragma once

#include "core/grid_spec.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::mapping {

/// Which voxels of a map are obstacles, one bit each: a 64-bit word holds 4x4x4 voxels, so that a query reads a
/// handful of words instead of hundreds of voxels. Words are aligned to OctoMap's keys, as the map's blocks are.
class OccupancyWords {
 public:
  static constexpr int kEdge = 4;  ///< voxels along each edge of a word

  /// As of a map in which nothing is known: no voxel is kOccupied, every voxel is kBlocked.
  OccupancyWords(const GridSpec& grid, Obstacles obstacles);

  /// Reads again the blocks that changed since the last call. Always of one and the same map.
  /// @throws InputError when the map has another grid.
  void update(const OccupancyMap& map);

  const GridSpec& grid() const { return grid_; }
  Obstacles obstacles() const { return obstacles_; }
  /// Counts up with every update that changed a bit.
  std::uint64_t revision() const { return revision_; }

  /// Whether the voxel is an obstacle; outside the grid as for DistanceField: yes for kBlocked, no for kOccupied.
  bool at(const VoxelIndex& v) const {
    if (!grid_.contains(v)) return obstacles_ == Obstacles::kBlocked;
    const unsigned x = static_cast<unsigned>(v.x + shift_[0]);
    const unsigned y = static_cast<unsigned>(v.y + shift_[1]);
    const unsigned z = static_cast<unsigned>(v.z + shift_[2]);
    return (words_[linear(x >> 2, y >> 2, z >> 2)] >> bit_of(x & 3, y & 3, z & 3) & 1) != 0;
  }

  /// 0 to 3 per axis: voxel v is voxel (v + shift) % 4 of word (v + shift) / 4.
  const std::array<int, 3>& shift() const { return shift_; }
  const std::array<int, 3>& word_count() const { return count_; }
  /// Bit `16 * z + 4 * y + x` is the voxel (x, y, z) of the word. Bits outside the grid are 0. Words along x follow
  /// one another. @pre inside word_count()
  const std::uint64_t* row(int y, int z) const {
    return words_.data() + linear(0, static_cast<unsigned>(y), static_cast<unsigned>(z));
  }
  std::size_t memory_bytes() const { return words_.size() * sizeof(std::uint64_t); }

 private:
  std::size_t linear(std::size_t x, std::size_t y, std::size_t z) const {
    return (z * static_cast<std::size_t>(count_[1]) + y) * static_cast<std::size_t>(count_[0]) + x;
  }
  static constexpr unsigned bit_of(unsigned x, unsigned y, unsigned z) { return 16 * z + 4 * y + x; }
  /// Sets or clears the voxels of a row along x, all in one block of the map.
  bool read_row(const OccupancyMap& map, int first_x, int last_x, int y, int z);

  GridSpec grid_;
  Obstacles obstacles_;
  std::array<int, 3> shift_{};
  std::array<int, 3> count_{};
  std::uint64_t revision_ = 0;
  std::uint64_t seen_revision_ = 0;  ///< of the map
  std::vector<std::uint64_t> words_;
};

}  // namespace stairwell::mapping
