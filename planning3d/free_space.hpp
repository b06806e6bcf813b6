#pragma once

#include "core/aabb.hpp"
#include "core/robot.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/occupancy_words.hpp"

#include <utility>
#include <vector>

namespace stairwell::planning3d {

/// In which directions a planner may move.
/// kVolume: anywhere. kSlice: horizontally only at the layers' heights, vertically anywhere (SPEC A16: layers are
/// changed through the openings that the map shows).
struct MotionRule {
  enum class Kind { kVolume, kSlice };
  Kind kind = Kind::kVolume;
  std::vector<double> layers_m;  ///< heights of the layers, kSlice only

  static MotionRule volume() { return {}; }
  static MotionRule slice(std::vector<double> layers_m) { return {Kind::kSlice, std::move(layers_m)}; }
};

/// A moving obstacle for planning: keep out of this sphere (a fellow UAV's present or final position).
struct KeepOut {
  Eigen::Vector3d center_m;
  double radius_m;
};

/// Read-only view of where the robot's centre may be: known-free (or assumed-free) space with clearance, inside the
/// flight box. Cheap to make; holds references.
class FreeSpace {
 public:
  /// @param blocked_words may be left out: answers are the same, those near obstacles take longer
  FreeSpace(const mapping::OccupancyMap& map, const mapping::DistanceField& blocked_distance, const Robot& robot,
            const Aabb& flight_box, const mapping::OccupancyWords* blocked_words = nullptr);

  const GridSpec& grid() const { return map_->grid(); }
  const mapping::OccupancyMap& map() const { return *map_; }
  const mapping::DistanceField& blocked_distance() const { return *distance_; }
  /// What a mapping::CollisionChecker needs beside the distance field; null if they were left out.
  const mapping::OccupancyWords* blocked_words() const { return words_; }
  const Robot& robot() const { return robot_; }
  const Aabb& flight_box() const { return flight_box_; }

  /// The robot centred in this voxel keeps its clearance from everything blocked.
  bool traversable(const VoxelIndex& v) const {
    return distance_->squared_cells(v) >= min_squared_cells_ && v.x >= lo_.x && v.y >= lo_.y && v.z >= lo_.z &&
           v.x <= hi_.x && v.y <= hi_.y && v.z <= hi_.z;
  }
  int min_squared_cells() const { return min_squared_cells_; }
  /// Voxels whose centre lies inside the flight box and the grid, both ends included; empty where lo > hi.
  const VoxelIndex& lo() const { return lo_; }
  const VoxelIndex& hi() const { return hi_; }

  /// Exact: a sphere of the robot's radius centred anywhere (not only at voxel centres) touches no blocked voxel.
  /// A sphere that only touches a face does not count. Does not look at the flight box.
  bool sphere_free(const Eigen::Vector3d& center_m, double radius_m) const;
  /// Exact: so does the sphere moved along the straight segment from one place to the other (a capsule).
  bool swept_sphere_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) const;
  /// The distance field alone says that the sphere is free (never wrongly; may say no for free spheres).
  bool surely_free(const Eigen::Vector3d& center_m, double radius_m) const;
  /// How much farther than needed the centre of the nearest blocked voxel is, about (linear between voxels' centres).
  double room_m(const Eigen::Vector3d& at_m) const;
  /// Nearest traversable voxel within `reach_m` of a point, by distance; false if there is none.
  bool nearest_traversable(const Eigen::Vector3d& point_m, double reach_m, VoxelIndex& found) const;

 private:
  bool capsule_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) const;

  const mapping::OccupancyMap* map_;
  const mapping::DistanceField* distance_;
  const mapping::OccupancyWords* words_;
  Robot robot_;
  Aabb flight_box_;
  int min_squared_cells_ = 1;
  VoxelIndex lo_, hi_;
};

}  // namespace stairwell::planning3d
