#include "mapping/occupancy_map.hpp"

#include "core/errors.hpp"
#include "mapping/occupancy_map_impl.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace stairwell::mapping {

namespace {

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

OccupancyMap OccupancyMap::clone() const {
  OccupancyMap copy(grid_, impl_->params);
  Impl& to = *copy.impl_;
  to.table = impl_->table;
  to.newest = impl_->newest;
  to.revision = impl_->revision;
  to.known = impl_->known;
  to.occupied = impl_->occupied;
  to.seen = impl_->seen;
  to.rebuild_tree = true;
  to.blocks.reserve(impl_->blocks.size());
  for (const std::unique_ptr<Block>& block : impl_->blocks) to.blocks.push_back(std::make_unique<Block>(block->copy()));
  copy.seen_ = to.seen.data();
  return copy;
}

const OccupancyParams& OccupancyMap::params() const { return impl_->params; }

float OccupancyMap::log_odds(const VoxelIndex& v) const {
  Impl::Slot slot{};
  const Block* block = impl_->grid.contains(v) ? impl_->find(v, slot) : nullptr;
  return block == nullptr ? kUnknownLogOdds : block->log_odds(slot.cell());
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
  const float before = impl_->blocks[index]->log_odds(slot.cell());
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

OccupancyMap::BlockLogOdds OccupancyMap::block_log_odds(const VoxelIndex& at) const {
  const std::uint32_t index = impl_->table[impl_->entry_of(at)];
  if (index == kNone) return {nullptr, kUnknownLogOdds};
  const Block& block = *impl_->blocks[index];
  return {block.values != nullptr ? block.values->data() : nullptr, block.uniform};
}

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
  std::size_t values = 0;
  for (const std::unique_ptr<Block>& block : impl_->blocks) values += block->values != nullptr ? 1 : 0;
  return impl_->table.capacity() * sizeof(std::uint32_t) + impl_->seen.capacity() +
         impl_->blocks.size() * (sizeof(Block) + sizeof(void*)) + values * sizeof(Block::Values) +
         impl_->mirror.memory_bytes();
}

const octomap::OcTree& OccupancyMap::octree() const {
  impl_->bring_tree_up_to_date();
  return impl_->mirror.tree();
}

}  // namespace stairwell::mapping
