#pragma once

#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace stairwell::mapping {

/// U = U_attr + U_rep + U_exp + U_mobile, each with a gain of its own.
struct PotentialConfig {
  double k_attr = 1.0;  ///< per metre to the goal
  double k_rep = 1.0;
  double sigma_m = 0.3;  ///< width of the repulsive kernel
  double reach_m = 1.0;  ///< d0: no repulsion from this distance on
  double k_exp = 0.0;    ///< raises known space, so that unknown space attracts
  double k_mobile = 1.0;
  double sigma_mobile_m = 0.5;
  double reach_mobile_m = 2.0;

  std::vector<std::string> problems() const;
};

/// The artificial potential field over a map. Layers are computed where they are asked for, from the distance field
/// and the map, which must outlive the volume: they are always current.
///   U_attr = k_attr |x - x_goal|                                           (cone)
///   U_rep  = k_rep / (sigma sqrt(2 pi)) exp(-(d / sigma)^2 / 2), d < d0    (d to the nearest obstacle voxel centre)
///   U_exp  = k_exp in known voxels, 0 in unknown ones
///   U_mobile = sum of the same kernel around each mobile obstacle
class PotentialVolume {
 public:
  /// @throws InputError for unusable parameters, another grid, or a field that is truncated below `reach_m`.
  PotentialVolume(const OccupancyMap& map, const DistanceField& field, const PotentialConfig& config = {});

  const GridSpec& grid() const { return field_->grid(); }
  const PotentialConfig& config() const { return config_; }

  void set_goal(const Eigen::Vector3d& goal_m) { goal_m_ = goal_m; }
  void set_mobile(std::vector<Eigen::Vector3d> positions_m) { mobile_m_ = std::move(positions_m); }

  double attractive(const Eigen::Vector3d& point_m) const;
  double mobile(const Eigen::Vector3d& point_m) const;
  double repulsive(const VoxelIndex& v) const;
  double exploration(const VoxelIndex& v) const;

  /// Sum of all layers: U_attr and U_mobile exact, the voxel layers trilinear between voxel centres (beyond the
  /// outermost centres: as at the nearest of them).
  double value(const Eigen::Vector3d& point_m) const;
  /// Derivative of `value`.
  Eigen::Vector3d gradient(const Eigen::Vector3d& point_m) const;

 private:
  struct Cell;
  Cell cell_at(const Eigen::Vector3d& point_m) const;

  const OccupancyMap* map_;
  const DistanceField* field_;
  PotentialConfig config_;
  Eigen::Vector3d goal_m_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> mobile_m_;
  std::vector<float> repulsion_of_squared_cells_;
};

}  // namespace stairwell::mapping
