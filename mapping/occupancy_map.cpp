#include "mapping/occupancy_map.hpp"

#include "core/errors.hpp"
#include "mapping/lane_walk.hpp"
#include "mapping/occupancy_block.hpp"
#include "mapping/octree_mirror.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace stairwell::mapping {

namespace {

constexpr int kKeyOffset = 32768;
constexpr std::size_t kMaxBlocks = std::size_t{1} << 27;

/// octomap::logodds, rounding included.
float log_odds_of(double probability) { return static_cast<float>(std::log(probability / (1.0 - probability))); }

void require_open_unit(std::vector<std::string>& problems, const char* name, double value) {
  if (!(value > 0.0 && value < 1.0)) {
    problems.push_back(std::string(name) + " must lie between 0 and 1, got " + std::to_string(value));
  }
}

}  // namespace

std::vector<std::string> OccupancyParams::problems() const {
  std::vector<std::string> found;
  require_open_unit(found, "p_hit", p_hit);
  require_open_unit(found, "p_miss", p_miss);
  require_open_unit(found, "clamp_min", clamp_min);
  require_open_unit(found, "clamp_max", clamp_max);
  require_open_unit(found, "p_occupied", p_occupied);
  if (p_hit < 0.5) {
    found.push_back("p_hit must be at least 0.5, got " + std::to_string(p_hit));
  }
  if (p_miss > 0.5) {
    found.push_back("p_miss must be at most 0.5, got " + std::to_string(p_miss));
  }
  if (!(clamp_min < clamp_max)) {
    found.push_back("clamp_min must be below clamp_max, got " + std::to_string(clamp_min) + " and " +
                    std::to_string(clamp_max));
  }
  return found;
}

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
    seen.assign(grid.voxel_count(), kBlockedBit);
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
    const float before = block.log_odds[cell];
    const Occupancy class_before = class_of(before);
    const Occupancy class_after = class_of(value);
    block.log_odds[cell] = value;
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

  /// Touches nothing but this block and its voxels' bytes in `seen`.
  BlockEffect update_block(Block& block, const BlockMask& mask, const ScanKernels& kernels) {
    BlockEffect effect;
    const bool whole = inside_whole(block.at);
    const std::ptrdiff_t first = first_linear(block);
    for (std::size_t word = 0; word < 8; ++word) {
      if ((mask.hit[word] | mask.miss[word]) == 0) continue;
      const std::uint64_t inside_bits = whole ? ~std::uint64_t{0} : inside(block.at, static_cast<int>(word));
      const std::uint64_t hits = mask.hit[word] & inside_bits;
      const std::uint64_t misses = mask.miss[word] & ~mask.hit[word] & inside_bits;
      const WordEffect now = kernels.update(block.log_odds.data() + word * 64, misses, hits, rule);
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
    for (const std::uint32_t index : dirty) {
      Block& block = *blocks[index];
      std::array<int, 3> first_key{block.at.x * kBlock, block.at.y * kBlock, block.at.z * kBlock};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        first_key[axis] += grid.first_cell()[axis] + kKeyOffset - offset[axis];
      }
      mirror.write_block(first_key, block.log_odds.data());
      block.dirty = false;
    }
    dirty.clear();
  }
};

OccupancyMap::OccupancyMap(const GridSpec& grid, const OccupancyParams& params) {
  if (grid.voxel_count() == 0) {
    throw InputError("the map's box is empty");
  }
  const std::vector<std::string> problems = params.problems();
  if (!problems.empty()) {
    std::string message = "unusable occupancy parameters: " + problems.front();
    for (std::size_t i = 1; i < problems.size(); ++i) {
      message += "; " + problems[i];
    }
    throw InputError(message);
  }
  impl_ = std::make_unique<Impl>(grid, params);
  grid_ = grid;
  seen_ = impl_->seen.data();
}
OccupancyMap::~OccupancyMap() = default;
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;

const OccupancyParams& OccupancyMap::params() const { return impl_->params; }

float OccupancyMap::log_odds(const VoxelIndex& v) const {
  Impl::Slot slot{};
  const Block* block = impl_->grid.contains(v) ? impl_->find(v, slot) : nullptr;
  return block == nullptr ? kUnknownLogOdds : block->log_odds[slot.cell()];
}

void OccupancyMap::update(const VoxelIndex& v, bool occupied) {
  if (!impl_->grid.contains(v)) {
    return;
  }
  const Impl::Slot slot = impl_->slot_of(v);
  BlockMask mask;
  (occupied ? mask.hit : mask.miss)[slot.word] = slot.mask();
  apply(impl_->block_of(v), mask);
}

void OccupancyMap::set_log_odds(const VoxelIndex& v, float log_odds) {
  if (!impl_->grid.contains(v)) {
    return;
  }
  const Impl::Slot slot = impl_->slot_of(v);
  const std::uint32_t index = impl_->touch(impl_->block_of(v));
  const float before = impl_->blocks[index]->log_odds[slot.cell()];
  const float after = log_odds;
  if (before == after || (std::isnan(before) && std::isnan(after))) {
    return;
  }
  if (std::isnan(after)) {
    impl_->rebuild_tree = true;
    impl_->blocks[index]->hit[slot.word] &= ~slot.mask();
    impl_->seen[impl_->grid.linear(v)] &= static_cast<std::uint8_t>(~kHitBit);
  }
  impl_->store(index, slot.cell(), after);
  impl_->mark_dirty(index);
  if (impl_->class_of(after) == Occupancy::kOccupied) impl_->note_hits(index, slot.word, slot.mask());
}

const std::array<int, 3>& OccupancyMap::block_offset() const { return impl_->offset; }
const std::array<int, 3>& OccupancyMap::block_count() const { return impl_->blocks_per_axis; }

OccupancyMap::ScanEffect OccupancyMap::apply(const VoxelIndex& block, const BlockMask& mask) {
  static const ScanKernels& kernels = lanes::kernels(Simd::kBest);
  const std::uint32_t index = impl_->touch(block);
  const BlockEffect effect = impl_->update_block(*impl_->blocks[index], mask, kernels);
  impl_->book(index, effect);
  return {effect.updated, effect.changed};
}

OccupancyMap::ScanEffect OccupancyMap::apply(std::span<const std::vector<BlockUpdate>> updates,
                                             const ScanKernels& kernels, WorkerPool& pool) {
  Impl& map = *impl_;
  std::vector<std::vector<std::uint32_t>>& touched = map.touched;
  std::vector<std::vector<BlockEffect>>& effects = map.effects;
  touched.resize(updates.size());
  effects.resize(updates.size());
  for (std::size_t list = 0; list < updates.size(); ++list) {
    touched[list].clear();
    for (const BlockUpdate& update : updates[list]) touched[list].push_back(map.touch(update.block));
    effects[list].resize(updates[list].size());
  }
  const auto update_list = [&](int thread) {
    for (auto list = static_cast<std::size_t>(thread); list < updates.size();
         list += static_cast<std::size_t>(pool.threads())) {
      for (std::size_t i = 0; i < updates[list].size(); ++i) {
        effects[list][i] = map.update_block(*map.blocks[touched[list][i]], updates[list][i].mask, kernels);
      }
    }
  };
  pool.run(update_list);
  BlockEffect sum;
  for (std::size_t list = 0; list < updates.size(); ++list) {
    for (std::size_t i = 0; i < effects[list].size(); ++i) {
      map.book(touched[list][i], effects[list][i]);
      sum.add(effects[list][i]);
    }
  }
  return {sum.updated, sum.changed};
}

void OccupancyMap::assume_free(const Eigen::Vector3d& center_m, double radius_m) {
  const Aabb reach = Aabb{center_m, center_m}.inflated(radius_m).intersection(impl_->grid.box());
  if (!center_m.allFinite() || !(radius_m >= 0.0) || reach.empty()) {
    return;
  }
  const VoxelIndex lo = impl_->grid.index_of(reach.min_m);
  const VoxelIndex hi = impl_->grid.index_of(reach.max_m);
  const auto& size = impl_->grid.size();
  for (int z = std::max(lo.z, 0); z <= std::min(hi.z, size[2] - 1); ++z) {
    for (int y = std::max(lo.y, 0); y <= std::min(hi.y, size[1] - 1); ++y) {
      for (int x = std::max(lo.x, 0); x <= std::min(hi.x, size[0] - 1); ++x) {
        const VoxelIndex v{x, y, z};
        if ((impl_->grid.center_of(v) - center_m).norm() > radius_m) {
          continue;
        }
        const Impl::Slot slot = impl_->slot_of(v);
        const std::uint32_t index = impl_->touch(impl_->block_of(v));
        Block& block = *impl_->blocks[index];
        if ((block.assumed[slot.word] & slot.mask()) != 0) {
          continue;
        }
        block.assumed[slot.word] |= slot.mask();
        if ((block.known[slot.word] & slot.mask()) == 0) {
          impl_->seen[impl_->grid.linear(v)] &= static_cast<std::uint8_t>(~kBlockedBit);
          impl_->mark_changed(index);
        }
      }
    }
  }
}

void OccupancyMap::mark_hit(const VoxelIndex& v) {
  if (at(v) == Occupancy::kUnknown) return;
  const Impl::Slot slot = impl_->slot_of(v);
  impl_->note_hits(impl_->touch(impl_->block_of(v)), slot.word, slot.mask());
}

void OccupancyMap::detect_changes(bool on) { impl_->detecting = on; }

void OccupancyMap::forget_changes() {
  for (const std::unique_ptr<Block>& block : impl_->blocks) block->changes.reset();
}

std::vector<OccupancyMap::Change> OccupancyMap::changes() const {
  std::vector<Change> found;
  for (const std::unique_ptr<Block>& block : impl_->blocks) {
    if (block->changes == nullptr) continue;
    const std::ptrdiff_t first = impl_->first_linear(*block);
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t created = block->changes->created[word];
      for (std::uint64_t left = created | block->changes->toggled[word]; left != 0; left &= left - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(left));
        found.push_back({grid_.voxel(impl_->linear(first, word * 64 + bit)), (created >> bit & 1U) != 0});
      }
    }
  }
  return found;
}

std::uint64_t OccupancyMap::revision() const { return impl_->revision; }

void OccupancyMap::for_each_block_changed_since(std::uint64_t revision,
                                                const std::function<void(const VoxelBox&)>& visit) const {
  const auto& size = impl_->grid.size();
  const auto& offset = impl_->offset;
  for (std::uint32_t index = impl_->newest; index != kNone; index = impl_->blocks[index]->older) {
    const Block& block = *impl_->blocks[index];
    if (block.revision <= revision) {
      break;
    }
    const VoxelIndex lo{block.at.x * kBlock - offset[0], block.at.y * kBlock - offset[1],
                        block.at.z * kBlock - offset[2]};
    visit({{std::max(lo.x, 0), std::max(lo.y, 0), std::max(lo.z, 0)},
           {std::min(lo.x + kBlock, size[0]) - 1, std::min(lo.y + kBlock, size[1]) - 1,
            std::min(lo.z + kBlock, size[2]) - 1}});
  }
}

std::size_t OccupancyMap::known_voxels() const { return impl_->known; }
std::size_t OccupancyMap::occupied_voxels() const { return impl_->occupied; }
double OccupancyMap::known_volume_m3() const {
  return static_cast<double>(impl_->known) * impl_->grid.voxel_volume_m3();
}
std::size_t OccupancyMap::memory_bytes() const {
  return impl_->table.capacity() * sizeof(std::uint32_t) + impl_->seen.capacity() +
         impl_->blocks.size() * (sizeof(Block) + sizeof(void*)) + impl_->mirror.memory_bytes();
}

const octomap::OcTree& OccupancyMap::octree() const {
  impl_->bring_tree_up_to_date();
  return impl_->mirror.tree();
}

}  // namespace stairwell::mapping
