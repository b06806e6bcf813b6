#pragma once

#include <array>
#include <cstddef>
#include <memory>

namespace octomap {
class OcTree;
}

namespace stairwell::mapping {

struct OccupancyParams;

/// Keeps an octomap::OcTree equal to a set of 8x8x8 voxel blocks. The tree is always in the form that OctoMap's
/// eager updates leave: equal siblings pruned, every inner node the maximum of its children.
class OctreeMirror {
 public:
  OctreeMirror(double resolution_m, const OccupancyParams& params);
  ~OctreeMirror();
  OctreeMirror(const OctreeMirror&) = delete;
  OctreeMirror& operator=(const OctreeMirror&) = delete;

  /// Writes one block into the tree.
  /// @param first_key OctoMap key of the block's lowest voxel, a multiple of 8 per axis.
  /// @param log_odds 512 values, x fastest, NaN = unknown. Voxels the tree knows must still be known.
  void write_block(const std::array<int, 3>& first_key, const float* log_odds);
  void clear();

  const octomap::OcTree& tree() const;
  std::size_t memory_bytes() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace stairwell::mapping
