#pragma once

#include "core/grid_spec.hpp"
#include "mapping/occupancy_map.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace stairwell::mapping {

class WorkerPool;

enum class Obstacles { kOccupied, kBlocked };  ///< kBlocked: what OccupancyMap::blocked() says (unknown too)

/// Truncated squared Euclidean distance, in cells, from each voxel centre to the nearest obstacle voxel's centre;
/// exact up to the truncation. For kBlocked everything outside the grid counts as obstacle.
class DistanceField {
 public:
  /// @throws InputError unless the truncation is 1 to 127 cells.
  DistanceField(const GridSpec& grid, double truncation_m, Obstacles obstacles);

  /// Recomputes what may have changed since the last call. @pre map.grid() == the field's grid
  void update(const OccupancyMap& map);
  /// The same in two steps, so that other things can be brought up to date beside the first, which one thread does.
  void read_changes(const OccupancyMap& map);
  /// The field is the same with any number of threads. @param workers  may be null
  void recompute_changed(WorkerPool* workers);

  const GridSpec& grid() const { return grid_; }
  double truncation_m() const { return truncation_m_; }
  int truncation_cells() const { return truncation_cells_; }
  /// Counts up with every update that may have changed a distance.
  std::uint64_t revision() const { return revision_; }
  /// Another one for every field and every copy, in this process.
  std::uint64_t id() const { return id_.value; }
  /// Visits the boxes of blocks of 8 x 8 x 8 voxels that hold every voxel whose distance changed after `revision`.
  void for_each_block_changed_since(std::uint64_t revision, const std::function<void(const VoxelBox&)>& visit) const;

  /// Squared cells, capped at truncation_cells()^2; 0 outside the grid for kBlocked.
  std::uint16_t squared_cells(const VoxelIndex& v) const {
    return grid_.contains(v) ? squared_[grid_.linear(v)] : outside_;
  }
  double distance_m(const VoxelIndex& v) const;
  const std::vector<std::uint16_t>& data() const { return squared_; }

 private:
  struct Range {
    int lo;
    int hi;  ///< included
    int count() const { return hi - lo + 1; }
  };
  /// Re-reads a block; true, and the box of the voxels that changed, if any did.
  bool read_obstacles(const OccupancyMap& map, const VoxelBox& box, VoxelBox& changed);
  /// What a thread works with.
  struct Scratch {
    std::vector<std::int16_t> along_x, along_xy, line;
  };
  void recompute_tiles(const VoxelBox& box, Scratch& scratch);
  void recompute(const VoxelBox& box, Scratch& scratch);
  std::size_t row_of(int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(grid_.size()[1]) + static_cast<std::size_t>(y)) *
           row_words_;
  }
  bool read_row(int first_x, int count, int y, int z, Scratch& scratch) const;
  void write_row(const Range& x, int y, int z, Scratch& scratch);

  struct Id {
    std::uint64_t value = next();
    Id() = default;
    Id(const Id&) {}
    Id& operator=(const Id&) {
      value = next();
      return *this;
    }
    static std::uint64_t next();
  };
  Id id_;
  GridSpec grid_;
  double truncation_m_ = 0.0;
  int truncation_cells_ = 0;
  Obstacles obstacles_ = Obstacles::kBlocked;
  std::uint16_t outside_ = 0;
  std::uint64_t revision_ = 0;
  bool fresh_ = true;
  std::uint64_t seen_revision_ = 0;  ///< of the map
  std::vector<std::uint16_t> squared_;
  std::array<int, 3> block_count_{0, 0, 0};
  std::vector<std::uint64_t> block_revision_;  ///< of the last change in each block
  std::vector<std::uint64_t> obstacle_;        ///< a bit per voxel, every row begins a word
  std::size_t row_words_ = 0;
  std::vector<VoxelBox> to_recompute_;
  std::vector<Scratch> scratch_;  ///< of each thread
};

/// Smallest squared centre-to-centre distance (cells) that guarantees that a sphere of `radius_m` around one voxel
/// centre touches no part of the other voxel, whatever the direction.
int min_squared_cells_for(double radius_m, double resolution_m);

}  // namespace stairwell::mapping
