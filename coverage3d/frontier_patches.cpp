#include "coverage3d/frontier_patches.hpp"

#include <algorithm>

namespace stairwell::coverage3d {
namespace {

/// Rows of a block and one voxel around it: bit `x + 1` of row (y + 1, z + 1).
using Rows = std::array<std::array<std::uint32_t, 10>, 10>;

std::uint32_t row_of(const BlockBits& bits, int y, int z) {
  return static_cast<std::uint32_t>(bits[static_cast<std::size_t>(z)] >> (8 * y)) & 0xFFU;
}

/// @param v  of the grid, in the block that the bits are of
bool holds(const BlockBits& bits, const VoxelIndex& v) {
  return (bits[static_cast<std::size_t>(v.z & 7)] >> (8 * (v.y & 7) + (v.x & 7)) & 1U) != 0;
}

/// The set and all its neighbours, those in other blocks too.
Rows dilated_beyond(const BlockBits& bits) {
  std::array<std::array<std::uint32_t, 10>, 8> in_layer{};
  for (int z = 0; z < 8; ++z) {
    if (bits[static_cast<std::size_t>(z)] == 0) continue;
    for (int y = 0; y < 8; ++y) {
      const std::uint32_t row = row_of(bits, y, z);
      const std::uint32_t wide = row | row << 1 | row << 2;
      for (int j = y; j <= y + 2; ++j) in_layer[static_cast<std::size_t>(z)][static_cast<std::size_t>(j)] |= wide;
    }
  }
  Rows rows{};
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t k = z; k <= z + 2; ++k)
      for (std::size_t y = 0; y < 10; ++y) rows[k][y] |= in_layer[z][y];
  return rows;
}

/// Whether a set in the block that lies `step` away meets the rows.
bool meets(const Rows& rows, const VoxelIndex& step, const BlockBits& bits) {
  const auto range = [](int along) {
    return along < 0 ? std::pair{7, 7} : along > 0 ? std::pair{0, 0} : std::pair{0, 7};
  };
  const auto [z_first, z_last] = range(step.z);
  const auto [y_first, y_last] = range(step.y);
  for (int z = z_first; z <= z_last; ++z) {
    for (int y = y_first; y <= y_last; ++y) {
      const std::uint32_t there = rows[static_cast<std::size_t>(8 * step.z + z + 1)]
                                      [static_cast<std::size_t>(8 * step.y + y + 1)];
      const std::uint32_t shifted = step.x < 0 ? there << 7 : step.x > 0 ? there >> 9 : there >> 1;
      if ((shifted & row_of(bits, y, z)) != 0) return true;
    }
  }
  return false;
}

}  // namespace

FrontierPatches::FrontierPatches(const std::array<int, 3>& size, int longest) : longest_(longest) {
  std::size_t blocks = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    blocks_[axis] = (size[axis] + 7) / 8;
    blocks *= static_cast<std::size_t>(blocks_[axis]);
  }
  table_.assign(blocks, kNone);
}

std::uint32_t FrontierPatches::add(const VoxelIndex& block, const BlockBits& bits) {
  FrontierPatch patch;
  patch.block = block;
  patch.bits = bits;
  const VoxelIndex origin = origin_of(block);
  patch.bounds = {origin + VoxelIndex{8, 8, 8}, origin};
  for_each_voxel(bits, [&](const VoxelIndex& place) {
    const VoxelIndex v = origin + place;
    VoxelIndex& lo = patch.bounds.lo;
    VoxelIndex& hi = patch.bounds.hi;
    lo = {std::min(lo.x, v.x), std::min(lo.y, v.y), std::min(lo.z, v.z)};
    hi = {std::max(hi.x, v.x), std::max(hi.y, v.y), std::max(hi.z, v.z)};
    patch.center += Eigen::Vector3d(v.x, v.y, v.z);
    ++patch.voxels;
  });
  patch.center /= patch.voxels;
  if (spare_patches_.empty()) {
    patches_.push_back(patch);
    return static_cast<std::uint32_t>(patches_.size() - 1);
  }
  const std::uint32_t id = spare_patches_.back();
  spare_patches_.pop_back();
  patches_[id] = patch;
  return id;
}

void FrontierPatches::replace(const VoxelIndex& block, const BlockBits& bits, Replaced& replaced) {
  std::uint32_t& entry = table_[entry_of(block)];
  if (store_[entry].bits == bits) return;
  if (entry == kNone) {
    if (spare_blocks_.empty()) {
      spare_blocks_.push_back(static_cast<std::uint32_t>(store_.size()));
      store_.emplace_back();
    }
    entry = spare_blocks_.back();
    spare_blocks_.pop_back();
  }
  Block& there = store_[entry];
  voxel_count_ -= static_cast<std::size_t>(count(there.bits));
  voxel_count_ += static_cast<std::size_t>(count(bits));
  there.bits = bits;
  std::vector<BlockBits> parts = connected_parts(bits, longest_);
  std::vector<std::uint32_t> kept;
  for (const std::uint32_t id : there.patches) {
    const auto same = std::find(parts.begin(), parts.end(), patches_[id].bits);
    if (same != parts.end()) {
      parts.erase(same);
      kept.push_back(id);
      continue;
    }
    replaced.bereaved.push_back(patches_[id].cluster);
    patches_[id] = {};
    spare_patches_.push_back(id);
  }
  for (const BlockBits& part : parts) {
    kept.push_back(add(block, part));
    replaced.added.push_back(kept.back());
  }
  there.patches = std::move(kept);
  if (there.patches.empty()) {
    spare_blocks_.push_back(entry);
    entry = kNone;
  }
}

bool FrontierPatches::contains(const VoxelIndex& v) const { return holds(block_of(v).bits, v); }

std::uint32_t FrontierPatches::cluster_at(const VoxelIndex& v) const {
  for (const std::uint32_t patch : block_of(v).patches) {
    if (holds(patches_[patch].bits, v)) return patches_[patch].cluster;
  }
  return 0;
}

void FrontierPatches::neighbours(std::uint32_t patch, std::vector<std::uint32_t>& found) const {
  const FrontierPatch& from = patches_[patch];
  const Rows rows = dilated_beyond(from.bits);
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const VoxelIndex block = from.block + VoxelIndex{x, y, z};
        if (block.x < 0 || block.y < 0 || block.z < 0 || block.x >= blocks_[0] || block.y >= blocks_[1] ||
            block.z >= blocks_[2])
          continue;
        for (const std::uint32_t other : store_[table_[entry_of(block)]].patches) {
          if (other != patch && meets(rows, {x, y, z}, patches_[other].bits)) found.push_back(other);
        }
      }
    }
  }
}

}  // namespace stairwell::coverage3d
