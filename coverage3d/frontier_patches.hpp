#pragma once

#include "coverage3d/frontier_voxels.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stairwell::coverage3d {

/// Frontier voxels that connect within one block of 8 x 8 x 8.
struct FrontierPatch {
  VoxelIndex block;
  BlockBits bits{};
  int voxels = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< mean voxel index
  mapping::VoxelBox bounds;
  std::uint32_t cluster = 0;  ///< for the owner
};

/// The frontier of a grid in patches, which are what its clusters are made of: they change only where their block does.
class FrontierPatches {
 public:
  FrontierPatches() = default;
  /// @param size  voxels per axis @param longest  voxels; patches are cut until they are no longer
  FrontierPatches(const std::array<int, 3>& size, int longest);

  /// What a replacement changed.
  struct Replaced {
    std::vector<std::uint32_t> added;     ///< patches; their cluster is 0
    std::vector<std::uint32_t> bereaved;  ///< clusters that lost a patch; some of them more than once
  };
  /// Makes `bits` the frontier of a block; patches that stay the same are kept.
  void replace(const VoxelIndex& block, const BlockBits& bits, Replaced& replaced);

  bool contains(const VoxelIndex& v) const;
  /// The cluster of the patch that holds the voxel; 0 = none.
  std::uint32_t cluster_at(const VoxelIndex& v) const;
  std::size_t voxel_count() const { return voxel_count_; }
  FrontierPatch& operator[](std::uint32_t patch) { return patches_[patch]; }
  const FrontierPatch& operator[](std::uint32_t patch) const { return patches_[patch]; }
  /// Appends the patches that touch this one over faces, edges or corners.
  void neighbours(std::uint32_t patch, std::vector<std::uint32_t>& found) const;

 private:
  struct Block {
    BlockBits bits{};
    std::vector<std::uint32_t> patches;
  };
  static constexpr std::uint32_t kNone = 0;  ///< `store_[0]` is an empty block

  std::size_t entry_of(const VoxelIndex& block) const {
    return (static_cast<std::size_t>(block.z) * static_cast<std::size_t>(blocks_[1]) +
            static_cast<std::size_t>(block.y)) *
               static_cast<std::size_t>(blocks_[0]) +
           static_cast<std::size_t>(block.x);
  }
  const Block& block_of(const VoxelIndex& v) const {
    return store_[table_[entry_of({v.x >> 3, v.y >> 3, v.z >> 3})]];
  }
  std::uint32_t add(const VoxelIndex& block, const BlockBits& bits);

  std::array<int, 3> blocks_{0, 0, 0};
  int longest_ = 8;
  std::vector<std::uint32_t> table_;
  std::vector<Block> store_{1};
  std::vector<std::uint32_t> spare_blocks_;
  std::vector<FrontierPatch> patches_;
  std::vector<std::uint32_t> spare_patches_;
  std::size_t voxel_count_ = 0;
};

}  // namespace stairwell::coverage3d
