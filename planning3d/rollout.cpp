#include "planning3d/rollout.hpp"

#include "core/units.hpp"
#include "planning3d/grid_moves.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr double kProgress_m = 0.05;  // nearer by so much is progress

/// Steps aside from a wanted direction, and whether they fit.
struct StepFinder {
  const SegmentCheck& check;
  bool plane;
  Eigen::Vector3d from_m, last, wanted;
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();

  bool fits(const Eigen::Vector3d& direction, double step_m) {
    to_m = from_m + step_m * direction;
    return check.sweep_free(from_m, to_m);
  }
  /// Among the directions so far off, the fitting one that turns least.
  bool fits_around(double off_rad, double step_m) {
    constexpr int kAround = 8;
    const Eigen::Vector3d side = std::abs(wanted.z()) < 0.9 ? Eigen::Vector3d(-wanted.y(), wanted.x(), 0.0).normalized()
                                                            : Eigen::Vector3d::UnitX();
    const Eigen::Vector3d up = wanted.cross(side);
    double best = -2.0;
    Eigen::Vector3d best_m = from_m;
    for (int i = 0; i < kAround; i += plane ? kAround / 2 : 1) {
      const double around = 2.0 * kPi * i / kAround;
      const Eigen::Vector3d tilted = std::cos(around) * side + std::sin(around) * up;
      const Eigen::Vector3d direction = std::cos(off_rad) * wanted + std::sin(off_rad) * tilted;
      if (last.dot(direction) <= best || !fits(direction, step_m)) continue;
      best = last.dot(direction);
      best_m = to_m;
    }
    to_m = best_m;
    return best > -2.0;
  }
  /// The centre of a voxel around in which the robot fits, the one that is best in direction.
  bool fits_centre() {
    constexpr double kLeastProgress = 0.1;  // cosine
    const GridSpec& grid = check.space().grid();
    const VoxelIndex middle = grid.index_of(from_m);
    double best = kLeastProgress;
    Eigen::Vector3d best_m = from_m;
    for (const GridMove& move : kGridMoves) {
      const VoxelIndex v{middle.x + move.x, middle.y + move.y, middle.z + move.z};
      if ((plane && move.z != 0) || !check.voxel_free(v)) continue;
      Eigen::Vector3d towards = grid.center_of(v) - from_m;
      if (plane) towards.z() = 0.0;
      const double length_m = towards.norm();
      if (length_m < 1e-6 || towards.dot(wanted) <= best * length_m || !fits(towards / length_m, length_m)) continue;
      best = towards.dot(wanted) / length_m;
      best_m = to_m;
    }
    to_m = best_m;
    return best > kLeastProgress;
  }
};

}  // namespace

bool fitting_step(const SegmentCheck& check, const RolloutConfig& config, bool plane, const Eigen::Vector3d& from_m,
                  const Eigen::Vector3d& last, const Eigen::Vector3d& wanted, Eigen::Vector3d& to_m) {
  constexpr double kRing_deg = 20.0, kFarthest_deg = 80.0;
  StepFinder finder{check, plane, from_m, last, wanted.normalized()};
  const Eigen::Vector3d sum = finder.wanted + config.keep * last;
  const Eigen::Vector3d mixed = sum.norm() > 1e-3 ? Eigen::Vector3d(sum.normalized()) : finder.wanted;
  const auto found = [&] {
    double widest_deg = config.slide ? 2.0 * kRing_deg : 0.0;
    for (double step_m = config.step_m; step_m >= config.least_step_m; step_m *= 0.5, widest_deg += kRing_deg) {
      if (finder.fits(mixed, step_m) || finder.fits(finder.wanted, step_m)) return true;
      for (double off_deg = kRing_deg; config.slide && off_deg <= std::min(widest_deg, kFarthest_deg);
           off_deg += kRing_deg) {
        if (finder.fits_around(rad_from_deg(off_deg), step_m)) return true;
      }
    }
    return config.slide && finder.fits_centre();
  }();
  to_m = finder.to_m;
  return found;
}

const char* to_string(RolloutEnd end) {
  switch (end) {
    case RolloutEnd::kReached:
      return "reached";
    case RolloutEnd::kCollision:
      return "collision";
    case RolloutEnd::kNoProgress:
      return "no progress";
    case RolloutEnd::kTooLong:
      return "too long";
    case RolloutEnd::kNoWay:
      return "no way";
  }
  return "?";
}

Rollout::Rollout(const SegmentCheck& check, AgentView& view, const ArrivalField& field, const RolloutConfig& config,
                 const Eigen::Vector3d& start_m)
    : check_(&check), view_(&view), field_(&field), config_(config), path_m_{start_m} {
  const double left_m = static_cast<double>(field.value_m(start_m));
  least_left_m_ = std::numeric_limits<double>::infinity();
  longest_m_ = config.detour * left_m + 2.0;
  std::vector<Eigen::Vector3d> way;
  field.descend(start_m, 0.1, way);
  if (way.empty()) finish(RolloutEnd::kNoWay);
}

bool Rollout::finish(RolloutEnd end) {
  ended_ = true;
  end_ = end;
  return false;
}

bool Rollout::look(Observation& seen) {
  if (ended_) return false;
  const Eigen::Vector3d& at_m = path_m_.back();
  const Eigen::Vector3d& goal_m = field_->goal_m();
  if ((goal_m - at_m).norm() <= config_.goal_reach_m && check_->sweep_free(at_m, goal_m)) {
    if (at_m != goal_m || path_m_.size() == 1) path_m_.push_back(goal_m);
    return finish(RolloutEnd::kReached);
  }
  view_->look(at_m, seen);
  if (view_->way_left_m() < least_left_m_ - kProgress_m) {
    least_left_m_ = view_->way_left_m();
    since_least_m_ = 0.0;
  }
  if (since_least_m_ > config_.patience_m) return finish(RolloutEnd::kNoProgress);
  if (!(flown_m_ <= longest_m_)) return finish(RolloutEnd::kTooLong);
  return true;
}

void Rollout::move(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d from_m = path_m_.back();
  Eigen::Vector3d to_m;
  if (!fitting_step(*check_, config_, view_->input().plane, from_m, last_, direction, to_m)) {
    finish(RolloutEnd::kCollision);
    return;
  }
  path_m_.push_back(to_m);
  const double gone_m = (to_m - from_m).norm();
  last_ = (to_m - from_m) / gone_m;
  flown_m_ += gone_m;
  since_least_m_ += gone_m;
}

}  // namespace stairwell::planning3d
