#pragma once

#include "core/aabb.hpp"
#include "core/grid_spec.hpp"
#include "core/id_table.hpp"
#include "coverage3d/frontier_patches.hpp"
#include "coverage3d/frontier_voxels.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::coverage3d {

/// Frontier voxels that belong together.
struct FrontierCluster {
  std::uint32_t id = 0;  ///< never used again for other cells
  std::vector<VoxelIndex> cells;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Aabb bounds_m;
  double area_m2 = 0.0;  ///< one voxel face per cell
  /// Unknown volume behind it: what connects to its cells in lumps of unknown voxels, counted up to
  /// FrontierConfig::deep_m3. Small for what a few rays left out, whatever the cluster's area.
  double pocket_m3 = 0.0;
  std::vector<std::uint32_t> patches;  ///< of the finder, what its cells are made of
};

/// Frontier voxels and their clusters, kept up to date from the blocks of the map that changed.
class FrontierFinder {
 public:
  /// @throws InputError when the config has problems or the box does not meet the grid.
  FrontierFinder(const GridSpec& grid, const FrontierConfig& config);

  /// @param workers  may be null @pre map.grid() is the grid given
  void update(const mapping::OccupancyMap& map, mapping::WorkerPool* workers = nullptr);

  const FrontierConfig& config() const { return config_; }
  const mapping::VoxelBox& box() const { return box_; }
  bool contains(const VoxelIndex& v) const { return inside(v) && patches_.contains(v); }
  /// Id of the cluster that holds the voxel; 0 = none.
  std::uint32_t cluster_at(const VoxelIndex& v) const { return inside(v) ? patches_.cluster_at(v) : kLoose; }
  std::size_t voxel_count() const { return patches_.voxel_count(); }
  /// All clusters by id, the ones too small for a visit too.
  const IdTable<FrontierCluster>& clusters() const { return clusters_; }
  bool worth_a_visit(const FrontierCluster& cluster) const {
    return cluster.area_m2 >= config_.min_area_m2 - 1e-9 && static_cast<int>(cluster.cells.size()) >= config_.min_cells;
  }
  /// More is behind it than what a few rays left out.
  bool deep(const FrontierCluster& cluster) const { return cluster.pocket_m3 >= kDeep * config_.deep_m3; }
  const std::vector<mapping::VoxelBox>& changed_blocks() const { return changed_; }

 private:
  static constexpr std::uint32_t kLoose = 0;  ///< a patch in no cluster
  static constexpr double kDeep = 0.75;       ///< of FrontierConfig::deep_m3

  bool inside(const VoxelIndex& v) const { return holds(box_, v); }
  /// Brings the patches up to date. @returns those that are new and the others of their clusters: they are in none now
  std::vector<std::uint32_t> loosen(const mapping::OccupancyMap& map, mapping::WorkerPool* workers);
  void dissolve(std::uint32_t id, std::vector<std::uint32_t>& loose);
  std::vector<std::uint32_t> grow(std::uint32_t seed, std::vector<std::uint32_t>& loose);
  /// Looks for the neighbours of these patches, so that beside_ holds them.
  void find_beside(const std::vector<std::uint32_t>& patches, mapping::WorkerPool* workers);
  const std::vector<std::uint32_t>& beside(std::uint32_t patch);
  void store_split(std::vector<std::uint32_t> patches);
  void store(std::vector<std::uint32_t> patches);
  double pocket_behind_m3(const mapping::OccupancyMap& map, const FrontierCluster& cluster) const;

  GridSpec grid_;
  FrontierConfig config_;
  mapping::VoxelBox box_;
  FrontierPatches patches_;
  std::uint64_t revision_ = 0;
  std::uint32_t next_id_ = 1;
  IdTable<FrontierCluster> clusters_;
  std::vector<mapping::VoxelBox> changed_;
  std::vector<std::uint32_t> stored_;                                     ///< clusters of this update
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> beside_;  ///< of patches; during this update
};

}  // namespace stairwell::coverage3d
