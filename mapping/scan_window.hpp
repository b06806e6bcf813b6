#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace stairwell::mapping {

class OccupancyMap;
struct BlockMask;
struct BlockUpdate;
struct WindowView;

/// OctoMap's key of the coordinate 0.
inline constexpr int kKeyOrigin = 32768;

/// An OctoMap key with room for steps beyond the key space.
struct LatticeKey {
  int x = 0;
  int y = 0;
  int z = 0;
  friend auto operator<=>(const LatticeKey&, const LatticeKey&) = default;
};

/// Both ends included.
struct LatticeBox {
  LatticeKey lo;
  LatticeKey hi;

  void extend(const LatticeKey& key);
};

/// The part of a map that one scan can reach, one byte a voxel: what the scan says about it. Bytes are zero
/// between scans.
class ScanWindow {
 public:
  static constexpr std::uint8_t kMiss = 1;
  static constexpr std::uint8_t kHit = 2;

  /// Lays the window over `reach`, one voxel wider on each side, clipped to the map's grid and to `limit`.
  /// @return false if nothing is left of it.
  bool open(const OccupancyMap& map, const LatticeBox& reach, const LatticeBox* limit = nullptr);

  bool covers(const LatticeKey& key) const {
    return static_cast<unsigned>(key.x - lo_.x) < size_[0] && static_cast<unsigned>(key.y - lo_.y) < size_[1] &&
           static_cast<unsigned>(key.z - lo_.z) < size_[2];
  }
  /// Valid for keys that the window covers and for a rim of one voxel around it.
  std::ptrdiff_t index_of(const LatticeKey& key) const {
    return (key.z - first_.z) * stride_z_ + (key.y - first_.y) * stride_y_ + (key.x - first_.x);
  }
  std::ptrdiff_t stride_y() const { return stride_y_; }
  std::ptrdiff_t stride_z() const { return stride_z_; }
  /// Of the covered voxels.
  int longest_side() const;
  WindowView view(const LatticeKey& origin_key);
  std::uint8_t* cells() { return cells_.data(); }
  /// A cell that belongs to no voxel.
  std::ptrdiff_t spare_cell() const { return static_cast<std::ptrdiff_t>(cells_.size()) - 1; }

  /// @pre covers(key), or within the rim
  void mark_miss(const LatticeKey& key) {
    if (covers(key)) {
      cells_[static_cast<std::size_t>(index_of(key))] = kMiss;
    }
  }
  /// Ignored outside the window. To be called after all misses: hits win.
  void mark_hit(const LatticeKey& key) {
    if (covers(key)) {
      cells_[static_cast<std::size_t>(index_of(key))] = kHit;
    }
  }

  /// Adds what the windows (at least one, all opened alike) say together about the `part`th of `parts` to `updates`, in
  /// the order of blocks, and clears it.
  static void take(std::span<ScanWindow* const> windows, const OccupancyMap& map, int part, int parts,
                   std::vector<BlockUpdate>& updates);

 private:
  bool take_block(std::ptrdiff_t corner, BlockMask& mask);

  LatticeKey lo_;  ///< covered voxels
  std::array<unsigned, 3> size_{};
  LatticeKey first_;                  ///< key of cells_[0]
  std::array<int, 3> first_block_{};  ///< in the map's block table
  std::array<int, 3> blocks_{};
  std::ptrdiff_t stride_y_ = 0;
  std::ptrdiff_t stride_z_ = 0;
  std::vector<std::uint8_t> cells_;
};

}  // namespace stairwell::mapping
