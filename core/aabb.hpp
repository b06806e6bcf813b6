#pragma once

#include <Eigen/Core>

#include <limits>

namespace stairwell {

/// Axis-aligned box in the world frame, metres. Default-constructed boxes are empty and grow with `extend`.
struct Aabb {
  Eigen::Vector3d min_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d max_m = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());

  bool empty() const { return (min_m.array() > max_m.array()).any(); }
  bool contains(const Eigen::Vector3d& point_m) const {
    return (point_m.array() >= min_m.array()).all() && (point_m.array() <= max_m.array()).all();
  }
  void extend(const Eigen::Vector3d& point_m) {
    min_m = min_m.cwiseMin(point_m);
    max_m = max_m.cwiseMax(point_m);
  }
  void extend(const Aabb& other) {
    min_m = min_m.cwiseMin(other.min_m);
    max_m = max_m.cwiseMax(other.max_m);
  }
  Aabb inflated(double margin_m) const {
    return {min_m - Eigen::Vector3d::Constant(margin_m), max_m + Eigen::Vector3d::Constant(margin_m)};
  }
  Aabb intersection(const Aabb& other) const { return {min_m.cwiseMax(other.min_m), max_m.cwiseMin(other.max_m)}; }
  Eigen::Vector3d size_m() const { return max_m - min_m; }
  Eigen::Vector3d center_m() const { return 0.5 * (min_m + max_m); }
  double volume_m3() const { return empty() ? 0.0 : size_m().prod(); }
};

}  // namespace stairwell
