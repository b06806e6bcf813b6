#include "learning/train/teacher.hpp"

#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
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
  space_ = space;
  check_ = &check;
  field_.compute(space, check, goal_m, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
}

bool Teacher::direction(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction) {
  const Eigen::Vector3d& goal_m = field_.goal_m();
  if ((goal_m - at_m).norm() <= config_.search_m && !check_->segment_free(at_m, goal_m)) {
    return search_around(at_m, direction);  // there the field is the plain distance
  }
  field_.descend(at_m, config_.ahead_m, way_m_);
  for (std::size_t last = way_m_.size(); last-- > 1;) {
    if (points_to(at_m, way_m_[last], direction)) return true;
  }
  return search_around(at_m, direction);
}

/// True if a straight flight to `to_m`, and a whole step if that is farther, is free.
bool Teacher::points_to(const Eigen::Vector3d& at_m, const Eigen::Vector3d& to_m, Eigen::Vector3d& direction) const {
  direction = to_m - at_m;
  if (config_.plane) direction.z() = 0.0;
  const double length_m = direction.norm();
  if (length_m < 1e-6) return false;
  direction /= length_m;
  return check_->segment_free(at_m, at_m + std::max(length_m, config_.step_m) * direction);
}

/// Where the field's cells promise what the voxels do not keep: voxel by voxel through what is really free, to the
/// place around from which the least is left.
bool Teacher::search_around(const Eigen::Vector3d& at_m, Eigen::Vector3d& direction) {
  const GridSpec& grid = space_->grid();
  const int reach = static_cast<int>(std::lround(config_.search_m / grid.resolution_m()));
  const int deep = config_.plane ? 0 : reach;
  const int edge = 2 * reach + 1;
  const VoxelIndex middle = grid.index_of(at_m);
  const auto local = [&](const VoxelIndex& v) {
    const VoxelIndex d = v - middle;
    return static_cast<std::size_t>(((d.z + deep) * edge + d.y + reach) * edge + d.x + reach);
  };
  came_from_.assign(static_cast<std::size_t>((2 * deep + 1) * edge * edge), -1);
  queue_.assign(1, {middle, 0.0F});
  came_from_[local(middle)] = 0;
  std::size_t best = 0;
  float least_m = planning3d::ArrivalField::kFar;
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const Reached here = queue_[i];
    const float left_m = field_.value_m(grid.center_of(here.voxel)) + here.gone_m;
    if (left_m < least_m) {
      least_m = left_m;
      best = i;
    }
    for (const planning3d::GridMove& move : planning3d::kGridMoves) {
      const VoxelIndex v = here.voxel + VoxelIndex{move.x, move.y, move.z};
      const VoxelIndex d = v - middle;
      if (std::abs(d.x) > reach || std::abs(d.y) > reach || std::abs(d.z) > deep) continue;
      if (came_from_[local(v)] >= 0 || !check_->segment_free(grid.center_of(here.voxel), grid.center_of(v))) continue;
      came_from_[local(v)] = static_cast<int>(i);
      queue_.push_back({v, here.gone_m + move.length * static_cast<float>(grid.resolution_m())});
    }
  }
  if (least_m == planning3d::ArrivalField::kFar) return false;
  for (; best != 0; best = static_cast<std::size_t>(came_from_[local(queue_[best].voxel)])) {
    Eigen::Vector3d to_m = grid.center_of(queue_[best].voxel);
    if (config_.plane) to_m.z() = at_m.z();
    if (points_to(at_m, to_m, direction)) return true;
  }
  direction = grid.center_of(middle) - at_m;
  if (config_.plane) direction.z() = 0.0;
  if (direction.norm() < 1e-6) return false;
  direction.normalize();
  return true;
}

}  // namespace stairwell::train
