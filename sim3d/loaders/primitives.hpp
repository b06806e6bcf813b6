#pragma once

#include "sim3d/world.hpp"

#include <Eigen/Core>

namespace stairwell::sim3d {

/// Bodies around the origin, outward winding. Round bodies are cut into flat pieces with their corners on the true
/// surface, so they never reach beyond it.
TriangleMesh box_mesh(const Eigen::Vector3d& size_m);
TriangleMesh cylinder_mesh(double radius_m, double length_m);
TriangleMesh ellipsoid_mesh(const Eigen::Vector3d& radii_m);
/// `length_m` of the cylindrical part, along z.
TriangleMesh capsule_mesh(double radius_m, double length_m);
/// A rectangle through the origin across `normal`.
TriangleMesh plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size_m);

}  // namespace stairwell::sim3d
