/// The subtree of an OctoMap tree that a block of 8x8x8 voxels is.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace stairwell::mapping {

/// A node as its parent sees it.
struct TreeCell {
  float log_odds = std::numeric_limits<float>::quiet_NaN();  ///< NaN: there is no such node
  bool inner = false;                                        ///< has children

  bool exists() const { return !std::isnan(log_odds); }
};

/// Eight leaves of one value, which OctoMap prunes.
inline bool are_equal_leaves(const TreeCell* eight) {
  if (!eight->exists()) return false;
  for (std::size_t i = 0; i < 8; ++i) {
    if (eight[i].inner || !(eight[i].log_odds == eight->log_odds)) return false;
  }
  return true;
}

/// What OctoMap's eager updates make of eight children: equal leaves are pruned, inner nodes are the maximum.
inline TreeCell parent_of(const TreeCell* eight) {
  if (are_equal_leaves(eight)) return {eight->log_odds, false};
  TreeCell parent;
  float highest = std::numeric_limits<float>::lowest();  // octomap::OcTreeNode::getMaxChildLogOdds starts here
  for (std::size_t i = 0; i < 8; ++i) {
    parent.inner = parent.inner || eight[i].exists();
    if (eight[i].log_odds > highest) highest = eight[i].log_odds;
  }
  if (parent.inner) parent.log_odds = highest;
  return parent;
}

/// Level 0 is the voxels, level 3 the block. The children of node `i` are the nodes `8 * i` to `8 * i + 7` of the level
/// below, numbered as OctoMap numbers them.
class BlockPyramid {
 public:
  static constexpr unsigned kLevels = 3;  // 8 = 2^3 voxels a side

  /// @param log_odds 512 values, x fastest, NaN = unknown.
  explicit BlockPyramid(const float* log_odds) {
    for (std::size_t i = 0; i < 512; ++i) cells_[i].log_odds = log_odds[kLinearOfMorton[i]];
    for (unsigned level = 1; level <= kLevels; ++level) {
      for (std::size_t i = 0; i < count(level); ++i) at(level, i) = parent_of(children_of(level, i));
    }
  }

  static constexpr std::size_t count(unsigned level) { return std::size_t{512} >> (3 * level); }
  TreeCell& at(unsigned level, std::size_t i) { return cells_[kFirstOfLevel[level] + i]; }
  const TreeCell& at(unsigned level, std::size_t i) const { return cells_[kFirstOfLevel[level] + i]; }
  const TreeCell& top() const { return cells_.back(); }
  const TreeCell* children_of(unsigned level, std::size_t i) const { return &at(level - 1, 8 * i); }

 private:
  static constexpr std::array<std::size_t, 4> kFirstOfLevel{0, 512, 512 + 64, 512 + 64 + 8};

  /// The eight voxels of each 2x2x2 cell lie side by side (Morton order), as OctoMap numbers children.
  static constexpr std::array<std::uint16_t, 512> kLinearOfMorton = [] {
    std::array<std::uint16_t, 512> table{};
    for (unsigned morton = 0; morton < 512; ++morton) {
      unsigned x = 0, y = 0, z = 0;
      for (unsigned bit = 0; bit < 3; ++bit) {
        x |= ((morton >> (3 * bit)) & 1U) << bit;
        y |= ((morton >> (3 * bit + 1)) & 1U) << bit;
        z |= ((morton >> (3 * bit + 2)) & 1U) << bit;
      }
      table[morton] = static_cast<std::uint16_t>(z * 64 + y * 8 + x);
    }
    return table;
  }();

  std::array<TreeCell, 512 + 64 + 8 + 1> cells_;
};

}  // namespace stairwell::mapping
