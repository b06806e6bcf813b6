#pragma once

#include "planning3d/free_space.hpp"
#include "planning3d/passable_lattice.hpp"

#include <array>
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

  /// @param stride voxels per cell edge; 0: see PassableLattice.
  explicit TravelCosts(int stride = 0);
  ~TravelCosts();
  TravelCosts(TravelCosts&&) noexcept;
  TravelCosts& operator=(TravelCosts&&) noexcept;

  /// Recomputes from `source_m`. Cells farther than `limit_m` stay unreachable.
  /// @param shared  a lattice of the same stride, for others as well; it is brought up to date. Null: one of its own
  void compute(const FreeSpace& space, const Eigen::Vector3d& source_m, const MotionRule& rule,
               double limit_m = std::numeric_limits<double>::infinity(), PassableLattice* shared = nullptr);

  /// Edge of a cell. @pre computed
  double cell_m() const { return frame_.cell_voxels * frame_.grid.resolution_m(); }
  /// Metres along the shortest way; kUnreachable where there is none.
  float distance_m(const VoxelIndex& v) const;
  float distance_m(const Eigen::Vector3d& point_m) const;

  /// Cell centres along the shortest way, from the source to `point_m` (both included as given, also when one cell
  /// holds both); empty where there is none.
  std::vector<Eigen::Vector3d> path_to(const Eigen::Vector3d& point_m) const;

 private:
  struct Steps;

  void resize(const PassableLattice& lattice);
  void spread_volume(float limit_cells);
  void spread_slice(const PassableLattice& lattice, float limit_cells);
  void lower(std::size_t cell, float cost, std::uint8_t direction);

  PassableLattice own_;
  LatticeFrame frame_;
  Eigen::Vector3d source_m_ = Eigen::Vector3d::Zero();
  std::vector<float> cost_;              ///< in cell edges; negative = impassable
  std::vector<std::uint8_t> direction_;  ///< move that led here (index into the moves; 26 = source)
  std::vector<std::uint32_t> buckets_[3];
  std::unique_ptr<Steps> steps_;
};

}  // namespace stairwell::planning3d
