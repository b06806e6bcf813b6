/// The blocks that an OccupancyMap consists of.
#pragma once

#include "core/grid_spec.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

namespace stairwell::mapping {

inline constexpr float kUnknownLogOdds = std::numeric_limits<float>::quiet_NaN();
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// A bit for each voxel of a block: bit `8 * y + x` of word `z`.
using BlockBits = std::array<std::uint64_t, 8>;

/// What happened to a block's voxels since changes were last forgotten.
struct BlockChanges {
  BlockBits created{};  ///< unknown before
  BlockBits toggled{};  ///< known before, and the other way round now
};

struct Block {
  using Values = std::array<float, 512>;

  std::unique_ptr<Values> values;   ///< log-odds, cell = 64 * z + 8 * y + x; none where all are the same
  float uniform = kUnknownLogOdds;  ///< what they all are then
  BlockBits known{};
  BlockBits assumed{};
  BlockBits hit{};
  std::uint64_t revision = 0;
  VoxelIndex at;                ///< block coordinates
  std::uint32_t newer = kNone;  ///< neighbours in the list of changed blocks, oldest change first
  std::uint32_t older = kNone;
  bool listed = false;
  bool dirty = false;
  std::unique_ptr<BlockChanges> changes;  ///< only while changes are detected

  float log_odds(std::size_t cell) const { return values != nullptr ? (*values)[cell] : uniform; }
  /// Without the changes detected, and not yet in any tree.
  Block copy() const {
    Block same;
    if (values != nullptr) same.values = std::make_unique<Values>(*values);
    same.uniform = uniform;
    same.known = known;
    same.assumed = assumed;
    same.hit = hit;
    same.revision = revision;
    same.at = at;
    same.newer = newer;
    same.older = older;
    same.listed = listed;
    return same;
  }
  /// To write to.
  Values& open() {
    if (values == nullptr) {
      values = std::make_unique<Values>();
      values->fill(uniform);
    }
    return *values;
  }
  /// Explored free space ends as blocks of one value: they need no memory, and no work while they stay so.
  void close_if_all_are(float value) {
    if (values == nullptr) return;
    for (const float one : *values) {
      if (one != value) return;
    }
    values.reset();
    uniform = value;
  }
};

/// What an update of a block leaves to be done when no other thread is at work.
struct BlockEffect {
  std::size_t updated = 0;
  std::size_t changed = 0;
  std::size_t made_known = 0;
  std::ptrdiff_t made_occupied = 0;
  bool stored = false;  ///< some value is different
  bool marked = false;  ///< some class, or ever-hit, is different

  void add(const BlockEffect& other) {
    updated += other.updated;
    changed += other.changed;
    made_known += other.made_known;
    made_occupied += other.made_occupied;
  }
};

}  // namespace stairwell::mapping
