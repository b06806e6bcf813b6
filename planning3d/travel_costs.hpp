#pragma once

#include "planning3d/free_space.hpp"

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace stairwell::planning3d {

/// Geodesic distances from one position over the free space, on a lattice of cells `stride` voxels wide (a cell is
/// passable when any of its voxels is traversable, so the answer is optimistic by at most a cell). Dijkstra with
/// 26-neighbour moves (slice rule: 8 in the layers, 2 vertical).
class TravelCosts {
 public:
  static constexpr float kUnreachable = std::numeric_limits<float>::infinity();

  /// @param stride voxels per cell edge; 0 chooses about 0.2 m.
  explicit TravelCosts(int stride = 0);
  ~TravelCosts();
  TravelCosts(TravelCosts&&) noexcept;
  TravelCosts& operator=(TravelCosts&&) noexcept;

  /// Recomputes from `source_m`. Cells farther than `limit_m` stay unreachable.
  /// @param like  costs just computed in the same space under the same rule, from another source: what is passable is
  /// taken from there instead of being looked up again
  void compute(const FreeSpace& space, const Eigen::Vector3d& source_m, const MotionRule& rule,
               double limit_m = std::numeric_limits<double>::infinity(), const TravelCosts* like = nullptr);

  /// Metres along the shortest way; kUnreachable where there is none.
  float distance_m(const VoxelIndex& v) const;
  float distance_m(const Eigen::Vector3d& point_m) const;

  /// Cell centres along the shortest way, from the source to `point_m` (both included as given, also when one cell
  /// holds both); empty where there is none.
  std::vector<Eigen::Vector3d> path_to(const Eigen::Vector3d& point_m) const;

 private:
  struct Steps;

  void resize(const GridSpec& grid);
  void mark_passable(const FreeSpace& space, const MotionRule& rule);
  void spread_volume(float limit_cells);
  void spread_slice(float limit_cells);
  void lower(std::size_t cell, float cost, std::uint8_t direction);
  std::size_t cell_of(const VoxelIndex& v) const;
  Eigen::Vector3d center_of_cell(std::size_t cell) const;

  int stride_;
  int cell_voxels_ = 1;  ///< stride in use
  GridSpec grid_;
  int size_[3] = {0, 0, 0};  ///< cells, with a border of one impassable cell on every side
  Eigen::Vector3d source_m_ = Eigen::Vector3d::Zero();
  std::vector<float> passable_;          ///< cost_ before any source: impassable or not reached yet
  std::vector<float> cost_;              ///< in cell edges; negative = impassable
  std::vector<std::uint8_t> direction_;  ///< move that led here (index into the moves; 26 = source)
  std::vector<std::uint8_t> level_;      ///< slice rule: 1 where horizontal moves are allowed
  std::vector<std::uint32_t> buckets_[3];
  std::unique_ptr<Steps> steps_;
};

}  // namespace stairwell::planning3d
