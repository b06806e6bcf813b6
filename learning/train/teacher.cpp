#include "learning/train/teacher.hpp"

#include <algorithm>

namespace stairwell::train {

namespace {

planning3d::ArrivalField::Config field_config(const Teacher::Config& config) {
  planning3d::ArrivalField::Config field;
  field.plane = config.plane;
  field.clearance_weight = config.clearance_weight;
  field.comfort_m = config.comfort_m;
  return field;
}

}  // namespace

Teacher::Teacher(const Config& config) : config_(config), field_(field_config(config)) {}

void Teacher::begin(const planning3d::FreeSpace& space, const planning3d::SegmentCheck& check,
                    const Eigen::Vector3d& goal_m, const Eigen::Vector3d& start_m) {
  check_ = &check;
  field_.compute(space, check, goal_m, start_m);
}

bool Teacher::direction(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction) {
  field_.descend(at_m, config_.ahead_m, way_m_);
  for (const double spare_m : {config_.spare_m, 0.4 * config_.spare_m, 0.0}) {
    for (std::size_t last = way_m_.size(); last-- > 1;) {
      if (points_to(at_m, way_m_[last], spare_m, direction)) return true;
    }
  }
  const auto far_enough = std::ranges::find_if(
      way_m_, [&](const Eigen::Vector3d& place_m) { return (place_m - at_m).norm() >= config_.blind_m; });
  if (way_m_.empty()) return false;
  points_to(at_m, far_enough != way_m_.end() ? *far_enough : way_m_.back(), 0.0, direction);
  return direction.norm() > 0.5;
}

/// True if a straight flight to `to_m`, and a whole step if that is farther, is free.
bool Teacher::points_to(const Eigen::Vector3d& at_m, const Eigen::Vector3d& to_m, double spare_m,
                        Eigen::Vector3d& direction) const {
  direction = to_m - at_m;
  if (config_.plane) direction.z() = 0.0;
  const double length_m = direction.norm();
  if (length_m < 1e-6) return false;
  direction /= length_m;
  return check_->sweep_free(at_m, at_m + std::max(length_m, config_.step_m) * direction, spare_m);
}

}  // namespace stairwell::train
