/// The teacher of the path agents: it knows the whole way.
#pragma once

#include "planning3d/arrival_field.hpp"

namespace stairwell::train {

/// Descends a field of arrival in which places near obstacles cost more: the shortest way that keeps its distance.
class Teacher {
 public:
  struct Config {
    bool plane = false;
    double clearance_weight = 3.0;
    double comfort_m = 0.6;
    double ahead_m = 0.7;  ///< the direction is that to the way's place so far on, or nearer if something is between
  };
  explicit Teacher(const Config& config);

  /// @param check must outlive the next calls of direction()
  void begin(const planning3d::FreeSpace& space, const planning3d::SegmentCheck& check, const Eigen::Vector3d& goal_m);
  /// Unit vector in the world's frame; false where there is no way.
  bool direction(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction);

 private:
  Config config_;
  planning3d::ArrivalField field_;
  const planning3d::SegmentCheck* check_ = nullptr;
  std::vector<Eigen::Vector3d> way_m_;
};

}  // namespace stairwell::train
