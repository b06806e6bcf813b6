#include "learning/train/teacher.hpp"

#include <limits>

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
                    const Eigen::Vector3d& goal_m) {
  check_ = &check;
  field_.compute(space, check, goal_m, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
}

bool Teacher::direction(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction) {
  field_.descend(at_m, config_.ahead_m, way_m_);
  if (way_m_.size() < 2) return false;
  std::size_t last = way_m_.size() - 1;
  while (last > 1 && !check_->segment_free(at_m, way_m_[last])) --last;
  direction = way_m_[last] - at_m;
  if (config_.plane) direction.z() = 0.0;
  if (direction.norm() < 1e-9) return false;
  direction.normalize();
  return true;
}

}  // namespace stairwell::train
