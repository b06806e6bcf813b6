/// The artificial potential field of thesis chapter 4 as stored 3D layers that are kept up to date by increments
/// (Alg. 4.1). See docs/potential.md.
#pragma once

#include "mapping/potential_kernel.hpp"
#include "mapping/potential_obstacles.hpp"
#include "mapping/potential_volume.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace stairwell::mapping {

/// kSummed: the kernels of all obstacle cells in reach add up (the thesis). kNearest: the kernel of the nearest one.
/// Both give the same, to the last bit, where at most one obstacle cell is in reach.
enum class RepulsionForm : std::uint8_t { kSummed, kNearest };

enum class PotentialLayer : std::uint8_t { kTotal, kAttractive, kRepulsive, kExperience, kMobile };

/// gain / (sigma sqrt(2 pi)) exp(-(d / sigma)^2 / 2) for d < reach around a point (world frame).
struct PotentialBump {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double gain = 1.0;
  double sigma_m = 0.3;
  double reach_m = 1.0;
};

/// What one run of Alg. 4.1 is told, beside the map.
struct PotentialStep {
  /// Where the window is wanted (world frame): the UAV. Not finite: the window stays where it is.
  Eigen::Vector3d center_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  /// Not finite, or farther away than 1e6 m along an axis: no goal, U_attr is 0.
  Eigen::Vector3d goal_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  /// The other UAVs. Positions that are not finite are left out, as are those after the first 64.
  std::span<const Eigen::Vector3d> mobile_m;
};

/// U = U_attr + U_rep + U_exp + U_mobile at the cell centres of a window of a lattice:
///   U_attr   = k_attr |x - x_goal|                                                  (eq. 4.2)
///   U_rep    = kernels of the obstacle cells in reach, summed or the nearest one's  (eq. 3.3)
///   U_exp    = k_exp in known space, plus bumps that the caller adds and clears     (experience layer, 4.3)
///   U_mobile = sum of the kernels around the other UAVs
/// The window always lies within the lattice: one wanted beyond its border is shifted inwards, one larger than the
/// lattice shrinks to it. It is stored wrapped round, so that moving it recomputes the entering cells only. After any
/// history of updates every layer is bitwise what a freshly made one would be: U_rep counts whole multiples of
/// `repulsion_unit()`, the other layers are computed anew wherever they change, and the total is summed anew from the
/// layers wherever one of them changed. Nothing is allocated by `update`.
class PotentialLayers {
 public:
  /// @param window_cells wanted size of the window; cut to the lattice.
  /// @throws InputError for unusable parameters, a window without cells or a reach of more than 64 cells.
  PotentialLayers(const GridSpec& lattice, const std::array<int, 3>& window_cells, RepulsionForm form,
                  const PotentialConfig& config = {});

  const GridSpec& lattice() const { return lattice_; }
  const PotentialConfig& config() const { return config_; }
  RepulsionForm form() const { return form_; }
  /// Cells that are held, in lattice coordinates.
  VoxelBox window() const;
  const std::array<int, 3>& window_cells() const { return size_; }
  /// Largest rounding error of one obstacle's kernel: half of this. Potential.
  double repulsion_unit() const { return kernel_.unit(); }
  std::size_t memory_bytes() const;

  /// Takes effect with the next update. Bumps that are not finite or without reach are left out. May allocate.
  void add_experience(const PotentialBump& bump);
  void clear_experience();

  /// What `update` reads. All of it describes the same state of the map.
  struct Inputs {
    const ObstacleLattice& obstacles;          ///< of the layers' lattice
    const OccupancyMap& map;                   ///< tells known space (k_exp); may be finer than the lattice
    std::span<const VoxelBox> changed_blocks;  ///< of the map, since the obstacles' last update
    bool too_many_blocks = false;              ///< not all of them are listed
    const DistanceField* distances = nullptr;  ///< to the same obstacles; for kNearest only
  };

  /// Alg. 4.1. Work in proportion to what changed since the last update: the goal (every cell of U_attr), obstacle
  /// cells, mobile obstacles, bumps, cells that the window moved onto. An update of the obstacles that was missed in
  /// between means a rebuild.
  /// @throws InputError for obstacles of another lattice, and for kNearest without distances or with ones that cover
  /// another lattice, count unknown space as obstacle, or are truncated below `reach_m`.
  void update(const Inputs& inputs, const PotentialStep& step);

  /// @pre v lies within window()
  double at(PotentialLayer layer, const VoxelIndex& v) const;
  /// Trilinear between cell centres; beyond the window's outermost centres as at the nearest point between them.
  /// @pre point_m is not NaN
  double value(const Eigen::Vector3d& point_m, PotentialLayer layer = PotentialLayer::kTotal) const;

  /// The total and where it lies, for whoever samples many points. Cell v is stored at
  /// ((v.z mod nz) * ny + v.y mod ny) * nx + v.x mod nx.
  std::span<const float> total() const { return total_; }

 private:
  template <typename Visit>
  void for_each_segment(const VoxelBox& box, const Visit& visit) const;
  std::size_t storage(const VoxelIndex& v) const;
  double stored(PotentialLayer layer, std::size_t index) const;
  void require(const Inputs& inputs) const;

  struct Move {
    VoxelBox kept;                     ///< cells in the window before and after; may be empty
    std::array<VoxelBox, 3> entering;  ///< the others, some of them empty
  };
  Move move_window(const Eigen::Vector3d& center_m);
  void take_mobile(std::span<const Eigen::Vector3d> mobile_m);
  void update_kept(const Inputs& inputs, const VoxelBox& kept, bool goal_moved);
  void update_experience(const Inputs& inputs, const VoxelBox& kept);
  void fill(const Inputs& inputs, const VoxelBox& box);
  /// Notes cells whose total is to be summed anew.
  void touch(const VoxelBox& box);
  void touch(const PotentialBump& bump, const VoxelBox& within);
  void sum_touched();
  void sum_total(const VoxelBox& box);

  // Of these, each makes its layer anew in a box: what it writes to a cell does not depend on the box.
  void fill_repulsive(const Inputs& inputs, const VoxelBox& box);
  void fill_attractive(const VoxelBox& box);
  void fill_mobile(const VoxelBox& box);
  void fill_experience(const OccupancyMap& map, const VoxelBox& box);

  KernelTarget target(const VoxelBox& clip);
  void spread_changes(const ObstacleLattice& obstacles, const VoxelBox& kept);
  void spread_singles(bool removed, const KernelTarget& to);
  void touch_changes(const ObstacleLattice& obstacles, const VoxelBox& kept);
  void sum_slab(const ObstacleLattice& obstacles, const VoxelBox& box, std::size_t across);
  void read_nearest(const DistanceField& distances, const VoxelBox& box);
  void add_bump(const PotentialBump& bump, const VoxelBox& within, std::vector<float>& layer);
  VoxelBox reach_of(const PotentialBump& bump) const;
  template <typename Visit>
  void for_each_row_in_reach(const PotentialBump& bump, const VoxelBox& box, const Visit& visit) const;

  GridSpec lattice_;
  std::array<int, 3> size_;
  RepulsionForm form_;
  PotentialConfig config_;
  RepulsionKernel kernel_;
  KernelSpreader spreader_;

  VoxelIndex origin_;
  bool fresh_ = true;
  std::uint64_t seen_revision_ = 0;  ///< of the obstacles
  Eigen::Vector3d goal_m_;           ///< NaN: none
  std::vector<PotentialBump> mobile_, last_mobile_;
  std::vector<PotentialBump> experience_;
  std::vector<PotentialBump> cleared_;  ///< bumps that are still in the layer but no longer wanted
  std::size_t applied_ = 0;             ///< so many bumps of `experience_` are in the layer

  std::vector<std::int32_t> repulsive_;
  std::vector<float> attractive_, experience_layer_, mobile_layer_, total_;
  std::vector<CellRange> touched_;  ///< per row of the storage: cells (lattice x) whose total is to be summed anew
  std::array<std::vector<float>, 3> line_;            ///< scratch: one value per cell along each axis
  std::vector<std::int32_t> row_sums_, column_sums_;  ///< scratch: a slab
  std::vector<std::uint64_t> rows_, columns_;         ///< scratch: the obstacles in reach of it
  std::vector<VoxelIndex> singles_;                   ///< scratch: changed obstacles without neighbours along x
};

/// Both ends included; empty where lo > hi along some axis.
VoxelBox intersection(const VoxelBox& a, const VoxelBox& b);
bool is_empty(const VoxelBox& box);

}  // namespace stairwell::mapping
