/// What the repulsive layer of the potential is made of, and what changed about it.
#pragma once

#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace stairwell::mapping {

/// The obstacle cells of a lattice, one bit each, and those that came and went in the last update.
class ObstacleLattice {
 public:
  /// Cells of one word of a row that changed: bit i is cell (x + i, y, z).
  struct Change {
    std::uint32_t word = 0;
    std::uint64_t added = 0;
    std::uint64_t removed = 0;
  };
  /// More changed words than this in one update are not listed one by one.
  static constexpr std::size_t kMaxChanges = std::size_t{1} << 15;

  /// All cells free of obstacles. @throws InputError when the grid has more than 2^32 words of 64 cells.
  explicit ObstacleLattice(const GridSpec& grid);

  const GridSpec& grid() const { return grid_; }
  bool at(const VoxelIndex& v) const {
    return grid_.contains(v) && ((words_[word_of(v)] >> (static_cast<unsigned>(v.x) & 63U)) & 1U) != 0;
  }
  int words_per_row() const { return words_per_row_; }
  /// Bit i is cell (64 * word + i, y, z). @pre within the grid
  std::uint64_t word(int word, int y, int z) const { return words_[word_of({word * 64, y, z})]; }
  /// Cell of a change's bit 0.
  VoxelIndex first_cell(const Change& change) const;

  /// Begins an update: nothing has changed yet.
  void begin();
  /// @pre grid().contains(v), and the cell is different
  void flip(const VoxelIndex& v);
  /// Ends the update.
  void end();

  /// Counts updates.
  std::uint64_t revision() const { return revision_; }
  /// By row, then by x. Incomplete if `too_many_changes()`.
  std::span<const Change> changes() const { return changes_; }
  bool too_many_changes() const { return too_many_; }

 private:
  std::size_t word_of(const VoxelIndex& v) const {
    return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(grid_.size()[1]) + static_cast<std::size_t>(v.y)) *
               static_cast<std::size_t>(words_per_row_) +
           static_cast<std::size_t>(v.x) / 64;
  }

  GridSpec grid_;
  int words_per_row_ = 0;
  bool too_many_ = false;
  std::uint64_t revision_ = 0;
  std::vector<std::uint64_t> words_;
  std::vector<Change> changes_;
};

/// Follows the occupied voxels of a map at two resolutions: the map's own, and `coarse_factor` times coarser, where a
/// cell is an obstacle while at least one of its voxels is occupied. Shared by the potentials of all UAVs that use the
/// map. Unknown voxels are no obstacles.
class PotentialObstacles {
 public:
  /// @param coarse_truncation_m of the coarse cells' distances (for nearest-obstacle repulsion); 0: none are kept.
  /// @throws InputError for a factor below 1, or a truncation that a distance field refuses.
  PotentialObstacles(const GridSpec& map_grid, int coarse_factor, double coarse_truncation_m = 0.0);

  /// Looks at the blocks of the map that changed since the last update. Allocates nothing itself (a distance field of
  /// the coarse cells, if kept, does).
  /// @throws InputError for a map over another grid.
  void update(const OccupancyMap& map);

  const ObstacleLattice& fine() const { return fine_; }
  const ObstacleLattice& coarse() const { return coarse_; }
  int coarse_factor() const { return factor_; }
  /// To the coarse cells that are obstacles; null unless kept.
  const DistanceField* coarse_distances() const { return coarse_distances_.get(); }

  /// Blocks of the map in which the class of some voxel changed in the last update (fine cells). Incomplete if
  /// `too_many_blocks()`.
  std::span<const VoxelBox> changed_blocks() const { return blocks_; }
  bool too_many_blocks() const { return too_many_blocks_; }

 private:
  void read(const OccupancyMap& map, const VoxelBox& block);
  void count(const VoxelIndex& v, bool occupied);
  VoxelIndex coarse_cell(const VoxelIndex& v) const;

  int factor_;
  ObstacleLattice fine_;
  ObstacleLattice coarse_;
  std::vector<std::uint32_t> occupied_in_coarse_;
  std::unique_ptr<OccupancyMap> coarse_map_;  ///< what the coarse distance field reads
  std::unique_ptr<DistanceField> coarse_distances_;
  std::vector<VoxelBox> blocks_;
  bool too_many_blocks_ = false;
  std::uint64_t seen_revision_ = 0;  ///< of the map
};

}  // namespace stairwell::mapping
