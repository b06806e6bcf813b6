/// Robot shapes in cells, less what may touch. Internal to the collision checker.
///
/// `probes`: points inside, far out, as shares of the half sizes; if an obstacle holds one, nothing else needs to be
/// asked. `inner` and `outer`: radii of balls inside and around. `grown`: holds the body moved by up to that much.
#pragma once

#include "mapping/collision.hpp"
#include "mapping/convex_bodies.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>

namespace stairwell::mapping::convex {

using Triple = std::array<double, 3>;

struct BallBody {
  static constexpr std::array<Triple, 0> probes{};

  double radius;
  Triple half_sizes() const { return {radius, radius, radius}; }
  double inner() const { return radius; }
  double outer() const { return radius; }
  BallBody grown(double by) const { return {radius + by}; }
  Ball place(const Eigen::Matrix3d&) const { return Ball(radius); }
};
struct BoxBody {
  static constexpr std::array<Triple, 12> probes{{{1, 0, 0},
                                                  {-1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, -1, 0},
                                                  {1, 1, 1},
                                                  {-1, -1, -1},
                                                  {1, 1, -1},
                                                  {-1, -1, 1},
                                                  {1, -1, 1},
                                                  {-1, 1, -1},
                                                  {1, -1, -1},
                                                  {-1, 1, 1}}};

  Triple half;
  const Triple& half_sizes() const { return half; }
  double inner() const { return std::min({half[0], half[1], half[2]}); }
  double outer() const { return std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]); }
  BoxBody grown(double by) const { return {{half[0] + by, half[1] + by, half[2] + by}}; }
  OrientedBox place(const Eigen::Matrix3d& R_world_body) const { return {half, R_world_body}; }
};
struct EllipsoidBody {
  static constexpr std::array<Triple, 10> probes{{{1, 0, 0},
                                                  {-1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, -1, 0},
                                                  {0, 0, 1},
                                                  {0, 0, -1},
                                                  {0.7, 0.7, 0},
                                                  {-0.7, -0.7, 0},
                                                  {0.7, -0.7, 0},
                                                  {-0.7, 0.7, 0}}};

  Triple semi_axes;
  const Triple& half_sizes() const { return semi_axes; }
  double inner() const { return std::min({semi_axes[0], semi_axes[1], semi_axes[2]}); }
  double outer() const { return std::max({semi_axes[0], semi_axes[1], semi_axes[2]}); }
  /// An ellipsoid around ellipsoid plus ball (Kurzhanski and Valyi 1997, outer bounds of sums).
  EllipsoidBody grown(double by) const {
    const double ratio = by / outer();
    EllipsoidBody out;
    for (std::size_t i = 0; i < 3; ++i) {
      out.semi_axes[i] = std::sqrt((1.0 + ratio) * semi_axes[i] * semi_axes[i] + by * by + by * outer());
    }
    return out;
  }
  Ellipsoid place(const Eigen::Matrix3d& R_world_body) const { return {semi_axes, R_world_body}; }
};
struct CylinderBody {
  static constexpr std::array<Triple, 12> probes{{{1, 0, 1},
                                                  {-1, 0, -1},
                                                  {1, 0, -1},
                                                  {-1, 0, 1},
                                                  {0, 1, 1},
                                                  {0, -1, -1},
                                                  {0, 1, -1},
                                                  {0, -1, 1},
                                                  {0.7, 0.7, 0},
                                                  {-0.7, -0.7, 0},
                                                  {0.7, -0.7, 0},
                                                  {-0.7, 0.7, 0}}};

  double radius;
  double half_height;
  Triple half_sizes() const { return {radius, radius, half_height}; }
  double inner() const { return std::min(radius, half_height); }
  double outer() const { return std::hypot(radius, half_height); }
  CylinderBody grown(double by) const { return {radius + by, half_height + by}; }
  Cylinder place(const Eigen::Matrix3d& R_world_body) const { return {radius, half_height, R_world_body.col(2)}; }
};

struct ToCells {
  double per_m;
  double operator()(double length_m) const { return (length_m - kCollisionTouch_m) * per_m; }
  Triple operator()(const Eigen::Vector3d& v) const { return {(*this)(v.x()), (*this)(v.y()), (*this)(v.z())}; }

  BallBody operator()(const SphereShape& s) const { return {(*this)(s.radius_m)}; }
  BoxBody operator()(const BoxShape& s) const { return {(*this)(s.half_m)}; }
  EllipsoidBody operator()(const EllipsoidShape& s) const { return {(*this)(s.semi_axes_m)}; }
  CylinderBody operator()(const CylinderShape& s) const { return {(*this)(s.radius_m), (*this)(s.half_height_m)}; }
};

}  // namespace stairwell::mapping::convex
