#include "planning3d/path_follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::planning3d {

namespace {

constexpr double kAhead_m = 1.0;
constexpr double kWindow_m = 1.5;  // of the path around the progress so far
constexpr double kStep_m = 0.05;
constexpr double kBrakeShare = 0.4;  // of the acceleration, planned with towards the end

bool straight_free(const FreeSpace& space, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const int pieces = std::max(1, static_cast<int>(std::ceil((to_m - from_m).norm() / kStep_m)));
  for (int i = 1; i <= pieces; ++i) {
    const Eigen::Vector3d at_m = from_m + static_cast<double>(i) / pieces * (to_m - from_m);
    if (!space.sphere_free(at_m, space.robot().radius_m)) return false;
  }
  return true;
}

}  // namespace

PathFollower::PathFollower(std::vector<Eigen::Vector3d> path_m, const MotionLimits& limits, double cruise_mps)
    : path_m_(std::move(path_m)), limits_(limits), cruise_mps_(cruise_mps) {
  arc_m_.push_back(0.0);
  for (std::size_t i = 1; i < path_m_.size(); ++i) {
    arc_m_.push_back(arc_m_.back() + (path_m_[i] - path_m_[i - 1]).norm());
  }
}

Eigen::Vector3d PathFollower::point_at(double arc_m) const {
  const auto next = std::upper_bound(arc_m_.begin(), arc_m_.end(), std::max(0.0, arc_m));
  if (next == arc_m_.end()) return path_m_.back();
  const auto i = static_cast<std::size_t>(next - arc_m_.begin());
  const double u = (std::max(0.0, arc_m) - arc_m_[i - 1]) / (arc_m_[i] - arc_m_[i - 1]);
  return path_m_[i - 1] + u * (path_m_[i] - path_m_[i - 1]);
}

void PathFollower::seek(const Eigen::Vector3d& position_m) { update_between(position_m, 0.0, length_m()); }

void PathFollower::update(const Eigen::Vector3d& position_m) {
  update_between(position_m, std::max(0.0, progress_m_ - kWindow_m), std::min(length_m(), progress_m_ + kWindow_m));
}

void PathFollower::update_between(const Eigen::Vector3d& position_m, double from_m, double to_m) {
  double best_m = std::numeric_limits<double>::infinity();
  for (double arc_m = from_m;; arc_m += kStep_m) {
    const double distance_m = (point_at(std::min(arc_m, to_m)) - position_m).norm();
    if (distance_m < best_m) {
      best_m = distance_m;
      progress_m_ = std::min(arc_m, to_m);
    }
    if (arc_m >= to_m) break;
  }
}

std::optional<Eigen::Vector3d> PathFollower::wish_mps(const FreeSpace& space, const Eigen::Vector3d& position_m,
                                                      double stop_arc_m) const {
  const double stop_m = std::clamp(stop_arc_m, 0.0, length_m());
  for (double reach_m = kAhead_m; reach_m > 0.1 * kAhead_m; reach_m *= 0.5) {
    const double arc_m =
        stop_m >= progress_m_ ? std::min(stop_m, progress_m_ + reach_m) : std::max(stop_m, progress_m_ - reach_m);
    const Eigen::Vector3d to_m = point_at(arc_m) - position_m;
    if (!straight_free(space, position_m, position_m + to_m)) continue;
    const double left_m = to_m.norm() + std::abs(stop_m - arc_m);
    if (left_m < 1e-6) return Eigen::Vector3d::Zero();
    const double braking_mps = std::sqrt(2.0 * kBrakeShare * limits_.acceleration_mps2 * left_m);
    const double speed_mps = std::min({cruise_mps_, braking_mps, 2.0 * left_m});
    return Eigen::Vector3d(to_m.normalized() * speed_mps);
  }
  return std::nullopt;
}

}  // namespace stairwell::planning3d
