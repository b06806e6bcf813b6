#pragma once

#include "core/grid_spec.hpp"
#include "core/occupancy.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace octomap {
class OcTree;
}

namespace stairwell::mapping {

/// OctoMap's sensor model. The defaults are octomap::OcTree's own.
struct OccupancyParams {
  double p_hit = 0.7;
  double p_miss = 0.4;
  double clamp_min = 0.1192;
  double clamp_max = 0.971;
  double p_occupied = 0.5;  ///< a voxel at or above this probability is occupied

  std::vector<std::string> problems() const;
};

/// Axis-aligned range of voxels, both ends included.
struct VoxelBox {
  VoxelIndex lo;
  VoxelIndex hi;
};

/// What one scan says about one 8x8x8 block: bit `8 * y + x` of word `z` is the voxel (x, y, z) of the block.
struct BlockMask {
  std::array<std::uint64_t, 8> miss{};
  std::array<std::uint64_t, 8> hit{};  ///< wins where both are set
};

/// A block and which of its voxels.
struct BlockUpdate {
  VoxelIndex block;
  BlockMask mask;
};

struct ScanKernels;
class WorkerPool;

/// Log-odds occupancy of a finite box of the world, with a real octomap::OcTree behind it when asked for.
///
/// The working copy is a table of 8x8x8 blocks (allocated when first touched) that answers look-ups in a few
/// nanoseconds; `octree()` brings the OcTree up to date with the blocks that changed since it was last asked for, and
/// keeps it (about 45 bytes a node); files are written without it.
/// The OcTree is the one OctoMap itself would hold for the same updates within the box.
class OccupancyMap {
 public:
  static constexpr int kBlock = 8;

  /// What a scan changed.
  struct ScanEffect {
    std::size_t updated = 0;  ///< voxels hit or missed
    std::size_t changed = 0;  ///< of these, voxels whose tri-state class changed
  };

  /// @throws InputError for an empty or over-large grid or unusable parameters.
  explicit OccupancyMap(const GridSpec& grid, const OccupancyParams& params = {});
  ~OccupancyMap();
  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;
  /// The same map once more, revisions included; changes detected so far stay behind.
  OccupancyMap clone() const;

  const GridSpec& grid() const { return grid_; }
  const OccupancyParams& params() const;

  /// kUnknown outside the grid.
  Occupancy at(const VoxelIndex& v) const {
    return grid_.contains(v) ? static_cast<Occupancy>(seen_[grid_.linear(v)] & kClassBits) : Occupancy::kUnknown;
  }
  /// @pre linear_index < grid().voxel_count()
  Occupancy at(std::size_t linear_index) const { return static_cast<Occupancy>(seen_[linear_index] & kClassBits); }
  Occupancy at(const Eigen::Vector3d& point_m) const { return at(grid_.index_of(point_m)); }
  /// Log-odds of a known voxel; NaN when unknown or outside.
  float log_odds(const VoxelIndex& v) const;

  /// OctoMap's updateNode(key, occupied) on one voxel: adds the hit or miss log-odds, clamped.
  /// Voxels outside the grid are ignored.
  void update(const VoxelIndex& v, bool occupied);
  /// Overwrites (map files, checkpoints), without clamping. NaN makes the voxel unknown again.
  void set_log_odds(const VoxelIndex& v, float log_odds);

  /// Blocks are aligned to OctoMap's keys, so that each is a subtree: voxel v lies in block
  /// (v + block_offset()) / 8 per axis.
  const std::array<int, 3>& block_offset() const;
  const std::array<int, 3>& block_count() const;
  /// The log-odds of a block's voxels, NaN = unknown (or outside the grid).
  struct BlockLogOdds {
    const float* each = nullptr;  ///< 512, x fastest; null where all are the same
    float all = 0.0F;             ///< what they all are then
  };
  /// Valid until the next call of a non-const member. @pre the block is within block_count()
  BlockLogOdds block_log_odds(const VoxelIndex& block) const;
  /// `update` on every voxel of the mask. @pre the block is within block_count(); bits outside the grid are ignored.
  ScanEffect apply(const VoxelIndex& block, const BlockMask& mask);
  /// The same for many blocks, none of them twice: one list per thread of the pool. The map is the same whatever the
  /// number of threads, as long as the lists are the same in a row.
  ScanEffect apply(std::span<const std::vector<BlockUpdate>> updates, const ScanKernels& kernels, WorkerPool& pool);

  /// Unknown space inside this sphere counts as free for `blocked` (the spot a UAV is started from); the map and
  /// its files stay as they are.
  void assume_free(const Eigen::Vector3d& center_m, double radius_m);
  /// True where a UAV must not be: occupied, ever hit (a surface is near, whatever the majority of rays says), outside
  /// the grid, or unknown and not assumed free.
  bool blocked(const VoxelIndex& v) const { return !grid_.contains(v) || (seen_[grid_.linear(v)] & kBlockedBit) != 0; }

  /// Whether a return ever fell into this voxel. It may be free all the same: where a surface cuts only a corner of a
  /// voxel, more rays pass through it than end in it.
  bool ever_hit(const VoxelIndex& v) const { return grid_.contains(v) && (seen_[grid_.linear(v)] & kHitBit) != 0; }
  /// @pre linear_index < grid().voxel_count()
  bool ever_hit(std::size_t linear_index) const { return (seen_[linear_index] & kHitBit) != 0; }

  /// What is known of each voxel, by linear index, for loops over very many of them: a byte of which `kClassBits` are
  /// the Occupancy and `kHitBit` says `ever_hit`. A few more bytes may be read behind the last one.
  const std::uint8_t* summaries() const { return seen_; }
  static constexpr std::uint8_t kClassBits = 3;
  static constexpr std::uint8_t kHitBit = 8;
  static constexpr std::size_t kReadableBehind = 3;

  /// Notes a return without changing the log-odds (checkpoints: map files do not tell). Unknown voxels are left alone.
  void mark_hit(const VoxelIndex& v);

  /// Counts up with every voxel whose tri-state (or assumed, or ever-hit) class changes.
  std::uint64_t revision() const;
  /// Visits the voxel box of every block in which some class changed after `revision`.
  void for_each_block_changed_since(std::uint64_t revision, const std::function<void(const VoxelBox&)>& visit) const;

  /// Change detection as octomap::OcTree::enableChangeDetection has it: off at first; while on, voxels that become
  /// known (`created`, for good) or whose occupied/free class is another one than when changes were last forgotten.
  struct Change {
    VoxelIndex voxel;
    bool created = false;
  };
  void detect_changes(bool on);
  void forget_changes();
  std::vector<Change> changes() const;  ///< in no special order

  std::size_t known_voxels() const;
  std::size_t occupied_voxels() const;
  double known_volume_m3() const;
  std::size_t memory_bytes() const;

  /// The OcTree brought up to date (pruned, inner nodes current). Valid until the next call of a non-const member.
  /// Not to be called from two threads at once.
  const octomap::OcTree& octree() const;

 private:
  // One byte per voxel beside the log-odds, so that the questions asked most often cost one load.
  static constexpr std::uint8_t kBlockedBit = 4;

  struct Impl;
  std::unique_ptr<Impl> impl_;
  GridSpec grid_;
  const std::uint8_t* seen_ = nullptr;  ///< owned by impl_
};

}  // namespace stairwell::mapping
