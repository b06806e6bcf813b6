/// A map with everything that makes a potential of it, and the potential by plain search.
#pragma once

#include "core/rng.hpp"
#include "mapping/potential_model.hpp"
#include "scribble.hpp"

#include <cmath>
#include <limits>
#include <vector>

namespace stairwell::mapping::test {

inline constexpr PotentialLayer kAllLayers[] = {PotentialLayer::kTotal, PotentialLayer::kAttractive,
                                                PotentialLayer::kRepulsive, PotentialLayer::kExperience,
                                                PotentialLayer::kMobile};

inline Eigen::Vector3d no_point() { return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()); }

inline double gauss(double gain, double sigma_m, double reach_m, double distance_m) {
  const double ratio = distance_m / sigma_m;
  return distance_m < reach_m ? gain / (sigma_m * std::sqrt(2.0 * M_PI)) * std::exp(-0.5 * ratio * ratio) : 0.0;
}

/// The map, its obstacles and distances, and one UAV's potential.
struct PotentialScene {
  PotentialScene(const GridSpec& grid, const PotentialModelConfig& config_in)
      : config(config_in),
        map(grid),
        field(grid, config.potential.reach_m + grid.resolution_m(), Obstacles::kOccupied),
        obstacles(make_potential_obstacles(grid, config)),
        model(grid, config) {}

  void update() {
    field.update(map);
    obstacles.update(map);
    model.update(map, obstacles, {center_m, goal_m, mobile_m}, &field);
  }

  PotentialModelConfig config;
  OccupancyMap map;
  DistanceField field;
  PotentialObstacles obstacles;
  PotentialModel model;
  Eigen::Vector3d center_m = no_point();
  Eigen::Vector3d goal_m = no_point();
  std::vector<Eigen::Vector3d> mobile_m;
};

/// Visits every cell of a box.
template <typename Visit>
void for_each_cell(const VoxelBox& box, const Visit& visit) {
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = box.lo.y; y <= box.hi.y; ++y) {
      for (int x = box.lo.x; x <= box.hi.x; ++x) visit(VoxelIndex{x, y, z});
    }
  }
}

inline VoxelBox whole(const GridSpec& grid) {
  return {{0, 0, 0}, {grid.size()[0] - 1, grid.size()[1] - 1, grid.size()[2] - 1}};
}

}  // namespace stairwell::mapping::test
