#pragma once

#include "core/grid_spec.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace stairwell::mapping {

/// One value for each voxel of a box where most values are T{}: blocks of 8x8x8 that hold anything else have memory.
template <typename T>
class SparseGrid {
 public:
  SparseGrid() = default;
  /// @param size voxels per axis
  explicit SparseGrid(const std::array<int, 3>& size) {
    std::size_t count = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      blocks_[axis] = static_cast<std::size_t>((size[axis] + 7) / 8);
      count *= blocks_[axis];
    }
    table_.assign(count, kNone);
  }

  SparseGrid(const SparseGrid& other) : blocks_(other.blocks_), table_(other.table_), spare_(other.spare_) {
    for (const auto& block : other.store_) store_.push_back(std::make_unique<Block>(*block));
  }
  SparseGrid(SparseGrid&&) noexcept = default;
  SparseGrid& operator=(SparseGrid other) noexcept {
    blocks_ = other.blocks_;
    table_.swap(other.table_);
    store_.swap(other.store_);
    spare_.swap(other.spare_);
    return *this;
  }
  ~SparseGrid() = default;

  /// @pre v lies in [0, size)
  T get(const VoxelIndex& v) const {
    const std::uint32_t block = table_[entry_of(v)];
    return block == kNone ? T{} : store_[block]->values[cell_of(v)];
  }
  void set(const VoxelIndex& v, T value) {
    std::uint32_t& block = table_[entry_of(v)];
    if (block == kNone) {
      if (value == T{}) return;
      block = take();
    }
    Block& there = *store_[block];
    T& stored = there.values[cell_of(v)];
    there.used += (value == T{} ? 0U : 1U);
    there.used -= (stored == T{} ? 0U : 1U);
    stored = value;
    if (there.used == 0) {  // all T{} again: as good as new for the next that needs one
      spare_.push_back(block);
      block = kNone;
    }
  }
  std::size_t memory_bytes() const { return table_.size() * sizeof(std::uint32_t) + store_.size() * sizeof(Block); }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Block {
    std::array<T, 512> values{};
    std::uint32_t used = 0;
  };

  std::size_t entry_of(const VoxelIndex& v) const {
    return (static_cast<std::size_t>(v.z >> 3) * blocks_[1] + static_cast<std::size_t>(v.y >> 3)) * blocks_[0] +
           static_cast<std::size_t>(v.x >> 3);
  }
  static std::size_t cell_of(const VoxelIndex& v) {
    return static_cast<std::size_t>((v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7));
  }
  std::uint32_t take() {
    if (!spare_.empty()) {
      const std::uint32_t block = spare_.back();
      spare_.pop_back();
      return block;
    }
    store_.push_back(std::make_unique<Block>());
    return static_cast<std::uint32_t>(store_.size() - 1);
  }

  std::array<std::size_t, 3> blocks_{0, 0, 0};
  std::vector<std::uint32_t> table_;
  std::vector<std::unique_ptr<Block>> store_;
  std::vector<std::uint32_t> spare_;
};

}  // namespace stairwell::mapping
