/// Generated worlds, as voxels, for training and evaluation.
#pragma once

#include "core/rng.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/occupancy_words.hpp"
#include "planning3d/free_space.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace stairwell::train {

/// What is solid, a byte per voxel (x fastest).
struct VoxelScene {
  GridSpec grid;
  std::vector<std::uint8_t> solid;

  VoxelScene(const Aabb& box, double resolution_m);
  /// Fills or empties the voxels whose centres lie in the box.
  void fill(const Aabb& box, bool is_solid);
  double solid_fraction() const;
};

/// Square ground with obstacles as high as the scene, as the thesis's maps (SPEC A13): thin walls, blocks, discs.
struct SliceWorldConfig {
  double size_m = 10.0;
  double height_m = 2.0;
  double resolution_m = 0.1;
  double least_obstacles = 0.05, most_obstacles = 0.34;  ///< fraction of the ground, border included
};
VoxelScene make_slice_scene(const SliceWorldConfig& config, Rng& rng);

/// Storeys one above the other, joined by holes in the slabs; rooms with doors and windows, pillars, clutter.
struct StoreyWorldConfig {
  int least_storeys = 1, most_storeys = 3;
  double least_size_m = 7.0, most_size_m = 12.0;
  double least_height_m = 2.4, most_height_m = 3.2;
  double resolution_m = 0.1;
};
VoxelScene make_storey_scene(const StoreyWorldConfig& config, Rng& rng);

/// What planners see of a scene.
class TrainingWorld {
 public:
  /// All of it is known. `seen` (a byte per voxel) leaves the rest unknown.
  TrainingWorld(const VoxelScene& scene, const Robot& robot, const std::vector<std::uint8_t>* seen = nullptr);

  planning3d::FreeSpace space() const { return {map_, blocked_, robot_, map_.grid().box(), &words_}; }
  const mapping::OccupancyMap& map() const { return map_; }
  const Robot& robot() const { return robot_; }

 private:
  Robot robot_;
  mapping::OccupancyMap map_;
  mapping::DistanceField blocked_;
  mapping::OccupancyWords words_;
};

/// Which voxels a sensor that looks everywhere (elevations to 50 degrees) sees up to `range_m` from these places.
std::vector<std::uint8_t> seen_from(const VoxelScene& scene, const std::vector<Eigen::Vector3d>& places_m,
                                    double range_m);

/// A place where the robot fits, at `height_m` if given; none after many tries.
std::optional<Eigen::Vector3d> random_place(const planning3d::FreeSpace& space, std::optional<double> height_m,
                                            Rng& rng);

}  // namespace stairwell::train
