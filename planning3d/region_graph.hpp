#pragma once

#include "planning3d/passable_lattice.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::planning3d {

/// A coarse picture of a passable lattice: blocks of 4 x 4 x 4 cells, in each of them the parts that hang together
/// (26 neighbours). Ways between parts are counted in steps from block to block. What can be reached by single moves of
/// cells can be reached here, and nothing else; lengths are off by some tenths, and by a block at each end.
class RegionGraph {
 public:
  static constexpr int kEdge = 4;               ///< cells per block edge
  static constexpr std::size_t kMostParts = 8;  ///< of one block: two cells of different parts do not touch
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  static constexpr float kUnreachable = std::numeric_limits<float>::infinity();

  /// Looks at all cells, works where some became passable or impassable. @param workers  may be null
  /// @return whether there were any
  bool update(const PassableLattice& lattice, mapping::WorkerPool* workers = nullptr);

  /// Number of the part that holds the voxel's cell; kNone where that is impassable. Parts of blocks that did not
  /// change keep their numbers. @pre updated; v is in the grid
  std::uint32_t part_of(const VoxelIndex& v) const;

  /// Lengths of the shortest ways from a part to all, by part number, in cell edges; kUnreachable where there is none.
  /// Parts that come with later updates may have numbers beyond them.
  /// @param until  a part that can be reached: looks only where ways to it that are little longer than the shortest
  ///               may lead. All other parts, reachable or not, get some length that is less than their own only
  ///               where it is more than that of `until`. Where `until` cannot be reached, or is kNone: as above
  void lengths_from(std::uint32_t part, std::vector<float>& lengths, std::uint32_t until = kNone) const;

 private:
  using Parts = std::array<std::uint64_t, kMostParts>;  ///< cells of each part, x fastest; unused ones are 0
  std::size_t block_of(int x, int y, int z) const;
  void read_layer(const PassableLattice& lattice, int layer, std::vector<std::uint64_t>& cells) const;
  static Parts split(std::uint64_t cells);
  /// Part i of a block. The first parts of all blocks come first: most blocks have no other, and lie close together.
  std::size_t number(std::size_t block, std::size_t i) const { return i * cells_.size() + block; }
  std::array<std::ptrdiff_t, 27> offsets() const;
  void link(std::size_t block, const std::array<std::ptrdiff_t, 27>& offsets);

  /// Of a part: a bit for each of the 27 blocks about its own, x fastest.
  struct Links {
    std::uint32_t any;   ///< where it touches a part
    std::uint32_t only;  ///< where it touches the only part; with its own block where it is the only one
  };

  LatticeFrame frame_;
  std::array<int, 3> blocks_{0, 0, 0};  ///< with a border of one empty block on every side
  std::vector<std::uint64_t> cells_;    ///< passable ones of each block
  std::vector<std::uint64_t> now_;      ///< the same while they are read
  std::vector<Parts> parts_;
  std::vector<std::uint8_t> counts_;    ///< parts of each block
  std::vector<Links> links_;            ///< of each part
  std::vector<std::uint8_t> outdated_;  ///< blocks whose parts' links are to be found again
};

}  // namespace stairwell::planning3d
