/// The two potential models of one UAV (thesis chapter 7): coarse over the whole box, fine around the UAV.
#pragma once

#include "mapping/potential_layers.hpp"

namespace stairwell::mapping {

/// Shape of the potential and size of its two lattices.
struct PotentialModelConfig {
  PotentialConfig potential;
  RepulsionForm form = RepulsionForm::kSummed;
  int coarse_factor = 4;  ///< a coarse cell is so many voxels wide
  /// Of the fine window. Rounded up to an odd number of voxels, so that one of them is the UAV's.
  Eigen::Vector3d window_m{7.5, 7.5, 3.0};

  std::vector<std::string> problems() const;
};

/// Obstacles come from a PotentialObstacles that the UAVs of a fleet share; goal and mobile obstacles are this UAV's.
///   obstacles.update(map);                    // once for all UAVs
///   potential.update(map, obstacles, step);   // once for each
class PotentialModel {
 public:
  /// @throws InputError for an unusable config.
  PotentialModel(const GridSpec& map_grid, const PotentialModelConfig& config = {});

  /// Alg. 4.1 on both models.
  /// @param distances to the map's occupied voxels, updated from the map; for kNearest only.
  /// @throws InputError for obstacles of another grid or coarse factor, and for kNearest without distances (those to
  /// the coarse cells are kept by the PotentialObstacles).
  void update(const OccupancyMap& map, const PotentialObstacles& obstacles, const PotentialStep& step,
              const DistanceField* distances = nullptr);

  /// To both models, with the next update. May allocate.
  void add_experience(const PotentialBump& bump);
  void clear_experience();

  const PotentialLayers& fine() const { return fine_; }
  const PotentialLayers& coarse() const { return coarse_; }

 private:
  PotentialLayers fine_;
  PotentialLayers coarse_;
};

/// The PotentialObstacles that fits a config.
PotentialObstacles make_potential_obstacles(const GridSpec& map_grid, const PotentialModelConfig& config = {});

}  // namespace stairwell::mapping
