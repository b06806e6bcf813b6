/// OctoMap's ray walk (octomap::OcTreeBaseImpl::computeRayKeys), repeated operation for operation so that rounding
/// and ties come out the same. Must be compiled without contraction of multiply and add.
#pragma once

#include "mapping/scan_window.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace stairwell::mapping {

/// octomath::Vector3::norm: squares summed in float, root taken in double.
inline double octomap_norm(const Eigen::Vector3f& v) {
  const float squared = v.x() * v.x() + v.y() * v.y() + v.z() * v.z();
  return std::sqrt(static_cast<double>(squared));
}

/// OctoMap's conversions between coordinates and keys.
class RayLattice {
 public:
  explicit RayLattice(double resolution_m) : resolution_m_(resolution_m), per_m_(1.0 / resolution_m) {}

  double resolution_m() const { return resolution_m_; }

  /// False outside the key space.
  bool key_of(const Eigen::Vector3f& point_m, LatticeKey& key) const {
    return key_of(point_m.x(), key.x) && key_of(point_m.y(), key.y) && key_of(point_m.z(), key.z);
  }
  double center_of(int key) const { return (static_cast<double>(key - kKeyOrigin) + 0.5) * resolution_m_; }
  Eigen::Vector3f center_of(const LatticeKey& key) const {
    return {static_cast<float>(center_of(key.x)), static_cast<float>(center_of(key.y)),
            static_cast<float>(center_of(key.z))};
  }
  /// From `at_m`, in the voxel `key`, to the voxel's border in direction `step` (1, -1). OctoMap rounds the half voxel
  /// to float32, so that the border may lie 3e-8 of a voxel off, even behind `at_m`.
  double to_border_m(int key, int step, float at_m) const {
    double border_m = center_of(key);
    border_m += static_cast<double>(static_cast<float>(step * resolution_m_ * 0.5));
    return border_m - static_cast<double>(at_m);
  }

 private:
  bool key_of(float coordinate_m, int& key) const {
    const double cell = std::floor(per_m_ * static_cast<double>(coordinate_m));
    if (!(cell >= -kKeyOrigin && cell < kKeyOrigin)) {
      return false;
    }
    key = static_cast<int>(cell) + kKeyOrigin;
    return true;
  }

  double resolution_m_;
  double per_m_;
};

/// Where one return leads: the walk's end point, and whether its voxel was hit.
struct RayEnd {
  Eigen::Vector3f end_m;
  LatticeKey end_key;
  bool hit = false;
};

/// Walks the rays of one scan through its window.
class RayWalker {
 public:
  RayWalker(const RayLattice& lattice, const Eigen::Vector3f& origin_m, const LatticeKey& origin_key)
      : lattice_(lattice), origin_m_(origin_m), origin_key_(origin_key) {}

  const LatticeKey& origin_key() const { return origin_key_; }

  /// Marks every voxel from the origin up to, not including, each end voxel. @return voxels visited
  std::size_t walk(std::span<const RayEnd> ends, ScanWindow& window) const;

 private:
  struct Ray {
    std::array<int, 3> step{0, 0, 0};
    std::array<double, 3> t_max{};
    std::array<double, 3> t_delta{};
    double length = 0.0;
  };
  struct Feed;
  /// False for a ray whose length underflows or overflows: nothing but its first voxel can be relied on.
  bool start(const Eigen::Vector3f& end_m, Ray& ray) const;
  static std::size_t walk_clipped(Ray& ray, LatticeKey key, const LatticeKey& end_key, ScanWindow& window);

  RayLattice lattice_;
  Eigen::Vector3f origin_m_;
  LatticeKey origin_key_;
};

}  // namespace stairwell::mapping
