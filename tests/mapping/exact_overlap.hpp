/// Overlap of robot shapes with boxes, written plainly and in other ways than the library does it. Metres.
#pragma once

#include "core/aabb.hpp"
#include "core/pose.hpp"
#include "mapping/collision.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <variant>
#include <vector>

namespace stairwell::mapping::test {

inline std::array<Eigen::Vector3d, 8> corners(const Aabb& box) {
  std::array<Eigen::Vector3d, 8> out;
  for (unsigned i = 0; i < 8; ++i) {
    out[i] = {(i & 1) ? box.max_m.x() : box.min_m.x(), (i & 2) ? box.max_m.y() : box.min_m.y(),
              (i & 4) ? box.max_m.z() : box.min_m.z()};
  }
  return out;
}

inline bool overlaps(const SphereShape& sphere, const Pose& T, const Aabb& voxel) {
  const Eigen::Vector3d nearest_m = T.translation().cwiseMax(voxel.min_m).cwiseMin(voxel.max_m);
  return (nearest_m - T.translation()).norm() < sphere.radius_m;
}

/// Projects all corners of both on every candidate direction.
inline bool overlaps(const BoxShape& box, const Pose& T, const Aabb& voxel) {
  const auto of_voxel = corners(voxel);
  auto of_box = corners({-box.half_m, box.half_m});
  for (Eigen::Vector3d& corner : of_box) corner = T * corner;
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < 3; ++i) {
    directions.push_back(Eigen::Vector3d::Unit(i));
    directions.emplace_back(T.linear().col(i));
    for (int j = 0; j < 3; ++j) directions.push_back(Eigen::Vector3d::Unit(i).cross(T.linear().col(j)));
  }
  for (const Eigen::Vector3d& direction : directions) {
    if (direction.norm() < 1e-9) continue;
    double lo[2] = {1e9, 1e9}, hi[2] = {-1e9, -1e9};
    for (std::size_t i = 0; i < 8; ++i) {
      const double at[2] = {direction.dot(of_voxel[i]), direction.dot(of_box[i])};
      for (int k = 0; k < 2; ++k) {
        lo[k] = std::min(lo[k], at[k]);
        hi[k] = std::max(hi[k], at[k]);
      }
    }
    if (hi[0] <= lo[1] || hi[1] <= lo[0]) return false;
  }
  return true;
}

/// Nearest point of the voxel in the space where the ellipsoid is a unit ball, one coordinate after the other.
inline bool overlaps(const EllipsoidShape& ellipsoid, const Pose& T, const Aabb& voxel) {
  const Eigen::Matrix3d M = ellipsoid.semi_axes_m.cwiseInverse().asDiagonal() * T.linear().transpose();
  Eigen::Vector3d x = T.translation().cwiseMax(voxel.min_m).cwiseMin(voxel.max_m);
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 10000; ++round) {
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d rest = M * (x - T.translation());
      rest -= M.col(i) * (x[i] - T.translation()[i]);
      x[i] =
          std::clamp(T.translation()[i] - rest.dot(M.col(i)) / M.col(i).squaredNorm(), voxel.min_m[i], voxel.max_m[i]);
    }
    const double now = (M * (x - T.translation())).norm();
    if (now < 1.0) return true;
    if (!(now < before)) break;
    before = now;
  }
  return false;
}

/// Distance from the origin to the hull of points in the plane.
inline double distance_to_hull(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  const auto turn = [](const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
  };
  std::vector<Eigen::Vector2d> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t first = hull.size();
    for (const Eigen::Vector2d& p : points) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0.0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  bool inside = hull.size() >= 3;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& p : points) nearest = std::min(nearest, p.norm());
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d& a = hull[i];
    const Eigen::Vector2d& b = hull[(i + 1) % hull.size()];
    inside = inside && turn(a, b, Eigen::Vector2d::Zero()) >= 0.0;
    const double length2 = (b - a).squaredNorm();
    const double u = length2 > 0.0 ? std::clamp(-a.dot(b - a) / length2, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, (a + u * (b - a)).norm());
  }
  return inside ? 0.0 : nearest;
}

/// Cuts the voxel's edges at the caps and looks along the axis.
inline bool overlaps(const CylinderShape& cylinder, const Pose& T, const Aabb& voxel) {
  auto points = corners(voxel);
  for (Eigen::Vector3d& p : points) p = T.inverse() * p;
  const double h_m = cylinder.half_height_m;
  std::vector<Eigen::Vector2d> kept;
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(p.z()) <= h_m) kept.push_back(p.head<2>());
  }
  for (unsigned i = 0; i < 8; ++i) {
    for (const unsigned bit : {1U, 2U, 4U}) {
      const Eigen::Vector3d &a = points[i], &b = points[i | bit];
      for (const double cap_m : {-h_m, h_m}) {
        const double u = (cap_m - a.z()) / (b.z() - a.z());
        if (u >= 0.0 && u <= 1.0) kept.push_back((a + u * (b - a)).head<2>());
      }
    }
  }
  return !kept.empty() && distance_to_hull(kept) < cylinder.radius_m;
}

inline CollisionShape grown(const CollisionShape& shape, double by_m) {
  struct Grow {
    double by_m;
    CollisionShape operator()(const SphereShape& s) const { return SphereShape{s.radius_m + by_m}; }
    CollisionShape operator()(const BoxShape& s) const { return BoxShape{s.half_m + Eigen::Vector3d::Constant(by_m)}; }
    CollisionShape operator()(const EllipsoidShape& s) const {
      return EllipsoidShape{s.semi_axes_m + Eigen::Vector3d::Constant(by_m)};
    }
    CollisionShape operator()(const CylinderShape& s) const {
      return CylinderShape{s.radius_m + by_m, s.half_height_m + by_m};
    }
  };
  return std::visit(Grow{by_m}, shape);
}

inline double reach_m(const CollisionShape& shape) {
  struct Reach {
    double operator()(const SphereShape& s) const { return s.radius_m; }
    double operator()(const BoxShape& s) const { return s.half_m.norm(); }
    double operator()(const EllipsoidShape& s) const { return s.semi_axes_m.maxCoeff(); }
    double operator()(const CylinderShape& s) const { return std::hypot(s.radius_m, s.half_height_m); }
  };
  return std::visit(Reach{}, shape);
}

/// Voxel by voxel, with the grid's surroundings: one layer of voxels is enough, for a body beyond it cuts through it.
inline bool collides_by_search(const OccupancyMap& map, Obstacles obstacles, const CollisionShape& shape,
                               const Pose& T_world_body) {
  const GridSpec& grid = map.grid();
  const double reach = reach_m(shape) + grid.resolution_m();
  const VoxelIndex lo = grid.index_of(T_world_body.translation() - Eigen::Vector3d::Constant(reach));
  const VoxelIndex hi = grid.index_of(T_world_body.translation() + Eigen::Vector3d::Constant(reach));
  for (int z = lo.z; z <= hi.z; ++z) {
    for (int y = lo.y; y <= hi.y; ++y) {
      for (int x = lo.x; x <= hi.x; ++x) {
        const VoxelIndex v{x, y, z};
        if (obstacles == Obstacles::kBlocked ? !map.blocked(v) : map.at(v) != Occupancy::kOccupied) continue;
        const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(0.5 * grid.resolution_m());
        const Aabb voxel{grid.center_of(v) - half_m, grid.center_of(v) + half_m};
        if (std::visit([&](const auto& s) { return overlaps(s, T_world_body, voxel); }, shape)) return true;
      }
    }
  }
  return false;
}

}  // namespace stairwell::mapping::test
