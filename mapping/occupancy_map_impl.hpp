/// The inside of OccupancyMap, for its own .cpp files.
#pragma once

#include "core/errors.hpp"
#include "mapping/lane_walk.hpp"
#include "mapping/occupancy_block.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/octree_mirror.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace stairwell::mapping {

inline constexpr int kKeyOffset = 32768;
inline constexpr std::size_t kMaxBlocks = std::size_t{1} << 27;

/// octomap::logodds, rounding included.
inline float log_odds_of(double probability) { return static_cast<float>(std::log(probability / (1.0 - probability))); }

struct OccupancyMap::Impl {
  /// Where a voxel lives: entry of the block table, word and bit in the block's masks.
  struct Slot {
    std::size_t entry;
    std::size_t word;
    unsigned bit;

    std::size_t cell() const { return word * 64 + bit; }
    std::uint64_t mask() const { return std::uint64_t{1} << bit; }
  };

  GridSpec grid;
  OccupancyParams params;
  UpdateRule rule;
  std::array<int, 3> offset{};
  std::array<int, 3> blocks_per_axis{};
  std::vector<std::uint32_t> table;  ///< index into `blocks`, kNone where nothing was touched
  std::vector<std::unique_ptr<Block>> blocks;
  std::uint32_t newest = kNone;
  std::uint64_t revision = 0;
  std::size_t known = 0;
  std::size_t occupied = 0;
  std::vector<std::uint8_t> seen;  ///< see OccupancyMap::seen_
  std::vector<std::uint32_t> dirty;
  std::vector<std::vector<std::uint32_t>> touched;  ///< scratch
  std::vector<std::vector<BlockEffect>> effects;    ///< scratch
  bool rebuild_tree = false;
  bool detecting = false;
  OctreeMirror mirror;

  Impl(const GridSpec& grid_in, const OccupancyParams& params_in)
      : grid(grid_in), params(params_in), mirror(grid_in.resolution_m(), params_in) {
    rule = {log_odds_of(params.p_hit), log_odds_of(params.p_miss), log_odds_of(params.clamp_min),
            log_odds_of(params.clamp_max), log_odds_of(params.p_occupied)};
    std::size_t count = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      offset[axis] = (grid.first_cell()[axis] + kKeyOffset) % kBlock;
      blocks_per_axis[axis] = (offset[axis] + grid.size()[axis] + kBlock - 1) / kBlock;
      count *= static_cast<std::size_t>(blocks_per_axis[axis]);
    }
    if (count > kMaxBlocks) {
      throw InputError("the map's box has too many voxels (" + std::to_string(grid.voxel_count()) +
                       "): use a smaller box or a coarser resolution");
    }
    table.assign(count, kNone);
    seen.assign(grid.voxel_count() + kReadableBehind, kBlockedBit);
    static_assert(static_cast<int>(Occupancy::kUnknown) == 0);
  }

  std::size_t entry_of(const VoxelIndex& block) const {
    return (static_cast<std::size_t>(block.z) * static_cast<std::size_t>(blocks_per_axis[1]) +
            static_cast<std::size_t>(block.y)) *
               static_cast<std::size_t>(blocks_per_axis[0]) +
           static_cast<std::size_t>(block.x);
  }
  VoxelIndex block_of(const VoxelIndex& v) const {
    return {(v.x + offset[0]) >> 3, (v.y + offset[1]) >> 3, (v.z + offset[2]) >> 3};
  }
  Slot slot_of(const VoxelIndex& v) const {
    const unsigned x = static_cast<unsigned>(v.x + offset[0]) & 7U;
    const unsigned y = static_cast<unsigned>(v.y + offset[1]) & 7U;
    const unsigned z = static_cast<unsigned>(v.z + offset[2]) & 7U;
    return {entry_of(block_of(v)), z, 8 * y + x};
  }
  const Block* find(const VoxelIndex& v, Slot& slot) const {
    slot = slot_of(v);
    const std::uint32_t index = table[slot.entry];
    return index == kNone ? nullptr : blocks[index].get();
  }

  std::uint32_t touch(const VoxelIndex& block) {
    std::uint32_t& index = table[entry_of(block)];
    if (index == kNone) {
      index = static_cast<std::uint32_t>(blocks.size());
      blocks.push_back(std::make_unique<Block>());
      blocks.back()->at = block;
    }
    return index;
  }

  /// Bits of a block's word that lie within the grid.
  std::uint64_t inside(const VoxelIndex& block, int z_in_block) const {
    const int z = block.z * kBlock - offset[2] + z_in_block;
    if (z < 0 || z >= grid.size()[2]) {
      return 0;
    }
    std::uint64_t bits = 0;
    const std::uint64_t row = row_inside(block.x * kBlock - offset[0], grid.size()[0]);
    const std::uint64_t rows = row_inside(block.y * kBlock - offset[1], grid.size()[1]);
    for (unsigned y = 0; y < 8; ++y) {
      bits |= ((rows >> y) & 1U) != 0 ? row << (8 * y) : 0;
    }
    return bits;
  }
  bool inside_whole(const VoxelIndex& block) const {
    const std::array<int, 3> at{block.x, block.y, block.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int first = at[axis] * kBlock - offset[axis];
      if (first < 0 || first + kBlock > grid.size()[axis]) return false;
    }
    return true;
  }
  static std::uint64_t row_inside(int first, int size) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) {
      bits |= (first + i >= 0 && first + i < size) ? std::uint64_t{1} << i : 0;
    }
    return bits;
  }

  void mark_dirty(std::uint32_t index) {
    if (!blocks[index]->dirty) {
      blocks[index]->dirty = true;
      dirty.push_back(index);
    }
  }

  /// Moves the block to the end of the list of changed blocks.
  void mark_changed(std::uint32_t index) {
    Block& block = *blocks[index];
    block.revision = ++revision;
    if (newest == index) {
      return;
    }
    if (block.listed) {
      blocks[block.newer]->older = block.older;
      if (block.older != kNone) {
        blocks[block.older]->newer = block.newer;
      }
    }
    block.older = newest;
    block.newer = kNone;
    if (newest != kNone) {
      blocks[newest]->newer = index;
    }
    newest = index;
    block.listed = true;
  }

  Occupancy class_of(float value) const {
    return std::isnan(value) ? Occupancy::kUnknown
                             : (value >= rule.threshold ? Occupancy::kOccupied : Occupancy::kFree);
  }

  /// Index in the grid of the block's first voxel, which may lie outside.
  std::ptrdiff_t first_linear(const Block& block) const {
    return (static_cast<std::ptrdiff_t>(block.at.z * kBlock - offset[2]) * grid.size()[1] + block.at.y * kBlock -
            offset[1]) *
               grid.size()[0] +
           block.at.x * kBlock - offset[0];
  }
  /// @pre the cell lies inside the grid
  std::size_t linear(std::ptrdiff_t first, std::size_t cell) const {
    const auto row =
        static_cast<std::ptrdiff_t>(cell >> 6) * grid.size()[1] + static_cast<std::ptrdiff_t>(cell >> 3 & 7);
    return static_cast<std::size_t>(first + row * grid.size()[0] + static_cast<std::ptrdiff_t>(cell & 7));
  }

  /// Stores a voxel's value; true if its class changed.
  bool store(std::uint32_t index, std::size_t cell, float value) {
    Block& block = *blocks[index];
    const float before = block.log_odds(cell);
    const Occupancy class_before = class_of(before);
    const Occupancy class_after = class_of(value);
    block.open()[cell] = value;
    if (class_before == class_after) {
      return false;
    }
    const std::size_t word = cell >> 6;
    const std::uint64_t bit = std::uint64_t{1} << (cell & 63);
    known += (class_after != Occupancy::kUnknown ? 1U : 0U);
    known -= (class_before != Occupancy::kUnknown ? 1U : 0U);
    occupied += (class_after == Occupancy::kOccupied ? 1U : 0U);
    occupied -= (class_before == Occupancy::kOccupied ? 1U : 0U);
    block.known[word] = class_after == Occupancy::kUnknown ? block.known[word] & ~bit : block.known[word] | bit;
    std::uint8_t& summary = seen[linear(first_linear(block), cell)];
    const bool stop = class_after == Occupancy::kOccupied || (summary & kHitBit) != 0 ||
                      (class_after == Occupancy::kUnknown && (block.assumed[word] & bit) == 0);
    summary = static_cast<std::uint8_t>((summary & kHitBit) | static_cast<std::uint8_t>(class_after) |
                                        (stop ? kBlockedBit : 0));
    if (detecting && class_after != Occupancy::kUnknown) {
      const bool created = class_before == Occupancy::kUnknown;
      note_changes(block, word, created ? bit : 0, created ? 0 : bit);
    }
    mark_changed(index);
    return true;
  }

  /// octomap::OccupancyOcTreeBase: a voxel that changes back is not changed; one that was created stays so.
  static void note_changes(Block& block, std::size_t word, std::uint64_t created, std::uint64_t toggled) {
    if ((created | toggled) == 0) return;
    if (block.changes == nullptr) block.changes = std::make_unique<BlockChanges>();
    block.changes->created[word] |= created;
    block.changes->toggled[word] ^= toggled;
  }

  void note_hits(std::uint32_t index, std::size_t word, std::uint64_t bits) {
    if (note_hits_in(*blocks[index], word, bits)) mark_changed(index);
  }

  /// True if any is new.
  bool note_hits_in(Block& block, std::size_t word, std::uint64_t bits) {
    const std::uint64_t fresh = bits & ~block.hit[word];
    if (fresh == 0) return false;
    block.hit[word] |= bits;
    const std::ptrdiff_t first = first_linear(block);
    for (std::uint64_t left = fresh; left != 0; left &= left - 1) {
      seen[linear(first, word * 64 + static_cast<std::size_t>(std::countr_zero(left)))] |= kHitBit | kBlockedBit;
    }
    return true;
  }

  static bool only_misses(const BlockMask& mask) {
    return std::all_of(mask.hit.begin(), mask.hit.end(), [](std::uint64_t word) { return word == 0; });
  }

  /// Touches nothing but this block and its voxels' bytes in `seen`.
  BlockEffect update_block(Block& block, const BlockMask& mask, const ScanKernels& kernels) {
    BlockEffect effect;
    if (block.values == nullptr && block.uniform <= rule.lowest && only_misses(mask)) {  // stays as it is
      for (const std::uint64_t word : mask.miss) effect.updated += static_cast<std::size_t>(std::popcount(word));
      return effect;
    }
    const bool whole = inside_whole(block.at);
    Block::Values& values = block.open();
    const std::ptrdiff_t first = first_linear(block);
    for (std::size_t word = 0; word < 8; ++word) {
      if ((mask.hit[word] | mask.miss[word]) == 0) continue;
      const std::uint64_t inside_bits = whole ? ~std::uint64_t{0} : inside(block.at, static_cast<int>(word));
      const std::uint64_t hits = mask.hit[word] & inside_bits;
      const std::uint64_t misses = mask.miss[word] & ~mask.hit[word] & inside_bits;
      const WordEffect now = kernels.update(values.data() + word * 64, misses, hits, rule);
      const std::uint64_t changed = now.unknown_before | (now.occupied_before ^ now.occupied_after);
      effect.updated += static_cast<std::size_t>(std::popcount(hits | misses));
      effect.changed += static_cast<std::size_t>(std::popcount(changed));
      effect.made_known += static_cast<std::size_t>(std::popcount(now.unknown_before));
      effect.made_occupied += std::popcount(now.occupied_after) - std::popcount(now.occupied_before);
      effect.stored = effect.stored || now.stored != 0;
      block.known[word] |= now.unknown_before;
      for (std::uint64_t left = changed; left != 0; left &= left - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(left));
        const bool is_occupied = (now.occupied_after >> bit & 1U) != 0;
        std::uint8_t& summary = seen[linear(first, word * 64 + bit)];
        const auto keep = static_cast<std::uint8_t>(summary & kHitBit);
        const Occupancy now_is = is_occupied ? Occupancy::kOccupied : Occupancy::kFree;
        summary = static_cast<std::uint8_t>(keep | static_cast<std::uint8_t>(now_is) |
                                            (is_occupied || keep != 0 ? kBlockedBit : 0));
      }
      if (detecting) note_changes(block, word, now.unknown_before, changed & ~now.unknown_before);
      const bool fresh_hit = note_hits_in(block, word, hits);
      effect.marked = effect.marked || changed != 0 || fresh_hit;
    }
    if (effect.stored && values.front() == rule.lowest) block.close_if_all_are(rule.lowest);
    return effect;
  }

  void book(std::uint32_t index, const BlockEffect& effect) {
    known += effect.made_known;
    occupied = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(occupied) + effect.made_occupied);
    if (effect.stored) mark_dirty(index);
    if (effect.marked) mark_changed(index);
  }

  void bring_tree_up_to_date() {
    if (rebuild_tree) {
      mirror.clear();
      for (std::uint32_t index = 0; index < blocks.size(); ++index) {
        mark_dirty(index);
      }
      rebuild_tree = false;
    }
    Block::Values same;
    for (const std::uint32_t index : dirty) {
      Block& block = *blocks[index];
      std::array<int, 3> first_key{block.at.x * kBlock, block.at.y * kBlock, block.at.z * kBlock};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        first_key[axis] += grid.first_cell()[axis] + kKeyOffset - offset[axis];
      }
      if (block.values == nullptr) same.fill(block.uniform);
      mirror.write_block(first_key, (block.values != nullptr ? *block.values : same).data());
      block.dirty = false;
    }
    dirty.clear();
  }
};

}  // namespace stairwell::mapping
