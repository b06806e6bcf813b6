#pragma once

#include "planning3d/free_space.hpp"
#include "planning3d/passable_lattice.hpp"
#include "planning3d/region_graph.hpp"

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

  /// Recomputes from `source_m`. Cells farther than `limit_m` stay unreachable; work and memory are for those within.
  /// @param shared  a lattice of the same stride, for others as well; it is brought up to date. Null: one of its own
  void compute(const FreeSpace& space, const Eigen::Vector3d& source_m, const MotionRule& rule,
               double limit_m = std::numeric_limits<double>::infinity(), PassableLattice* shared = nullptr);

  /// From now on, until computed without a limit: beyond it about the length of the way from the present source, by
  /// the graph's steps, and never less than the limit. To be called again when the source is elsewhere or the graph has
  /// changed much. @param graph  of the same lattice, volume rule; it is referred to
  /// @param lengths  what a call for a source nearby has returned: not much off here either. Null: they are looked for
  /// @return the lengths from here or nearby; null where the source is closed in
  std::shared_ptr<const std::vector<float>> estimate_beyond(const RegionGraph& graph,
                                                            std::shared_ptr<const std::vector<float>> lengths = {});

  /// Edge of a cell. @pre computed
  double cell_m() const { return frame_.cell_voxels * frame_.grid.resolution_m(); }
  /// Metres along the shortest way; kUnreachable where there is none.
  float distance_m(const VoxelIndex& v) const;
  float distance_m(const Eigen::Vector3d& point_m) const;

  /// Cell centres along the shortest way, from the source to `point_m` (both included as given, also when one cell
  /// holds both); empty where there is none within the limit.
  std::vector<Eigen::Vector3d> path_to(const Eigen::Vector3d& point_m) const;

 private:
  struct Steps;
  /// The cells that may be reached, and a border of one impassable cell, as a part of the frame.
  struct Window {
    std::array<int, 3> lo{0, 0, 0};  ///< in cells of the frame
    std::array<int, 3> size{0, 0, 0};
    std::size_t row(int y, int z) const {  ///< its first cell; y and z in cells of the frame
      return (static_cast<std::size_t>(z - lo[2]) * static_cast<std::size_t>(size[1]) +
              static_cast<std::size_t>(y - lo[1])) *
             static_cast<std::size_t>(size[0]);
    }
    std::size_t cell_count() const { return row(lo[1], lo[2] + size[2]); }
  };
  static constexpr std::size_t kOutside = std::numeric_limits<std::size_t>::max();

  void open_window(const PassableLattice& lattice, double limit_cells, bool with_flags);
  /// kOutside where the window does not reach. @pre v is in the grid
  std::size_t cell_of(const VoxelIndex& v) const;
  std::size_t frame_cell(std::size_t cell) const;
  float beyond_m(const VoxelIndex& v) const;
  void spread_volume(float limit_cells);
  void spread_slice(float limit_cells);
  void lower(std::size_t cell, float cost, std::uint8_t direction);

  PassableLattice own_;
  LatticeFrame frame_;
  Window window_;
  Eigen::Vector3d source_m_ = Eigen::Vector3d::Zero();
  VoxelIndex source_;
  std::vector<float> cost_;              ///< in cell edges; negative = impassable
  std::vector<std::uint8_t> flags_;      ///< of the lattice, likewise in the window; slice rule only
  std::vector<std::uint8_t> direction_;  ///< move that led here (index into the moves; 26 = source)
  std::vector<std::uint32_t> buckets_[3];
  std::unique_ptr<Steps> steps_;
  const RegionGraph* graph_ = nullptr;
  std::shared_ptr<const std::vector<float>> lengths_;  ///< by part of the graph
  double limit_m_ = std::numeric_limits<double>::infinity();
};

}  // namespace stairwell::planning3d
