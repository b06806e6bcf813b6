#pragma once

#include "core/aabb.hpp"
#include "core/grid_spec.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/sparse_grid.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace stairwell::coverage3d {

struct FrontierConfig {
  Aabb box;                        ///< task box: frontiers and the unknown beyond them lie inside
  int min_free_neighbours = 3;     ///< of 26 (SPEC B4)
  int min_unknown_neighbours = 3;  ///< of 26 (SPEC B4)
  double split_size_m = 2.0;       ///< clusters are cut until no longer than this along their main axis
  double min_area_m2 = 0.08;       ///< smaller clusters are not worth a visit
  int min_cells = 5;               ///< and so are those of fewer voxels, on coarse maps
  double deep_m3 = 2.0;            ///< larger pockets behind a cluster are not measured to their end

  std::vector<std::string> problems() const;
};

struct FrontierCluster {
  std::uint32_t id = 0;  ///< never used again for other cells
  std::vector<VoxelIndex> cells;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Aabb bounds_m;
  double area_m2 = 0.0;  ///< one voxel face per cell
  /// Unknown volume behind it: what connects to its cells in lumps of unknown voxels, counted up to
  /// FrontierConfig::deep_m3. Small for what a few rays left out, whatever the cluster's area.
  double pocket_m3 = 0.0;
};

/// The definition, for one voxel: free and never hit, inside the box, at least one unknown 6-neighbour inside the box,
/// and enough free and unknown voxels among its 26 neighbours.
bool is_frontier(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                 const VoxelIndex& v);

/// Frontier voxels and their clusters, kept up to date from the blocks of the map that changed.
class FrontierFinder {
 public:
  /// @throws InputError when the config has problems or the box does not meet the grid.
  FrontierFinder(const GridSpec& grid, const FrontierConfig& config);

  /// @pre map.grid() is the grid given
  void update(const mapping::OccupancyMap& map);

  const FrontierConfig& config() const { return config_; }
  const mapping::VoxelBox& box() const { return box_; }
  bool contains(const VoxelIndex& v) const { return inside(v) && label_.get(offset(v)) != kNone; }
  std::size_t voxel_count() const { return voxel_count_; }
  /// All clusters by id, the ones too small for a visit too.
  const std::map<std::uint32_t, FrontierCluster>& clusters() const { return clusters_; }
  bool worth_a_visit(const FrontierCluster& cluster) const {
    return cluster.area_m2 >= config_.min_area_m2 - 1e-9 && static_cast<int>(cluster.cells.size()) >= config_.min_cells;
  }
  /// More is behind it than what a few rays left out.
  bool deep(const FrontierCluster& cluster) const { return cluster.pocket_m3 >= kDeep * config_.deep_m3; }
  const std::vector<mapping::VoxelBox>& changed_blocks() const { return changed_; }

 private:
  static constexpr std::uint32_t kNone = 0;
  static constexpr std::uint32_t kLoose = 1;  ///< frontier, not in a cluster
  static constexpr double kDeep = 0.75;       ///< of FrontierConfig::deep_m3

  bool inside(const VoxelIndex& v) const {
    return v.x >= box_.lo.x && v.y >= box_.lo.y && v.z >= box_.lo.z && v.x <= box_.hi.x && v.y <= box_.hi.y &&
           v.z <= box_.hi.z;
  }
  VoxelIndex offset(const VoxelIndex& v) const { return v - box_.lo; }
  void examine(const mapping::OccupancyMap& map, const mapping::VoxelBox& block);
  void switch_on(const VoxelIndex& v);
  void switch_off(const VoxelIndex& v);
  void dissolve(std::uint32_t id, std::vector<VoxelIndex>& loose);
  std::vector<VoxelIndex> grow(const VoxelIndex& seed, std::vector<VoxelIndex>& loose);
  void store_split(std::vector<VoxelIndex> cells);
  void store(std::vector<VoxelIndex> cells);
  double pocket_behind_m3(const mapping::OccupancyMap& map, const FrontierCluster& cluster) const;

  GridSpec grid_;
  FrontierConfig config_;
  mapping::VoxelBox box_;
  mapping::SparseGrid<std::uint32_t> label_;
  std::size_t voxel_count_ = 0;
  std::uint64_t revision_ = 0;
  std::uint32_t next_id_ = 2;
  std::map<std::uint32_t, FrontierCluster> clusters_;
  std::vector<mapping::VoxelBox> changed_;
  std::vector<VoxelIndex> switched_on_;
  std::vector<std::uint32_t> touched_;
  std::vector<std::uint32_t> stored_;  ///< clusters of this update
};

}  // namespace stairwell::coverage3d
