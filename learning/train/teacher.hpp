/// The teacher of the path agents: it knows the whole way.
#pragma once

#include "planning3d/arrival_field.hpp"

#include <limits>
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
    double spare_m = 0.05;  ///< kept from obstacles where that is possible: students are not exact
    double blind_m = 0.3;   ///< where no place on the way can be flown to: to the one so far on, and rollouts slide
  };
  explicit Teacher(const Config& config);

  /// @param check must outlive the next calls of direction()
  /// @param start_m  only the way from there is needed; by default from everywhere
  void begin(const planning3d::FreeSpace& space, const planning3d::SegmentCheck& check, const Eigen::Vector3d& goal_m,
             const Eigen::Vector3d& start_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  /// Unit vector in the world's frame; false where there is no way.
  bool direction(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction);

 private:
  bool points_to(const Eigen::Vector3d& at_m, const Eigen::Vector3d& to_m, double spare_m,
                 Eigen::Vector3d& direction) const;

  Config config_;
  planning3d::ArrivalField field_;
  const planning3d::SegmentCheck* check_ = nullptr;
  std::vector<Eigen::Vector3d> way_m_;
};

}  // namespace stairwell::train
