/// The teacher of the path agents: it knows the whole way.
#pragma once

#include "planning3d/arrival_field.hpp"

#include <optional>
#include <vector>

namespace stairwell::train {

/// Descends a field of arrival in which places near obstacles cost more: the shortest way that keeps its distance.
class Teacher {
 public:
  struct Config {
    bool plane = false;
    double clearance_weight = 6.0;
    double comfort_m = 0.6;
    double ahead_m = 0.45;  ///< the direction is that to the way's place so far on, or nearer if something is between
    double step_m = 0.12;   ///< and at least so far everything is free
    double search_m = 0.6;  ///< around, where nothing on the way is free to go to, and at the goal
  };
  explicit Teacher(const Config& config);

  /// @param check must outlive the next calls of direction()
  void begin(const planning3d::FreeSpace& space, const planning3d::SegmentCheck& check, const Eigen::Vector3d& goal_m);
  /// Unit vector in the world's frame; false where there is no way.
  bool direction(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction);

 private:
  struct Reached {
    VoxelIndex voxel;
    float gone_m;
  };
  bool points_to(const Eigen::Vector3d& at_m, const Eigen::Vector3d& to_m, Eigen::Vector3d& direction) const;
  bool search_around(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction);

  Config config_;
  planning3d::ArrivalField field_;
  std::optional<planning3d::FreeSpace> space_;
  const planning3d::SegmentCheck* check_ = nullptr;
  std::vector<int> came_from_;  ///< by voxel around: place in the queue; -1: not reached
  std::vector<Reached> queue_;
  std::vector<Eigen::Vector3d> way_m_;
};

}  // namespace stairwell::train
