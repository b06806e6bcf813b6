#include "sim3d/loaders/primitives.hpp"

#include "core/units.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace stairwell::sim3d {

namespace {

constexpr std::uint32_t kSegments = 48;  // around a round body; the flat pieces stay within 0.2 % of the radius
constexpr std::uint32_t kRings = 24;

/// A closed body of revolution about z from rings (radius, z), lowest first; the first and last are poles.
struct Ring {
  double radius_m;
  double z_m;
};

TriangleMesh revolve(const std::vector<Ring>& rings, const Eigen::Vector3d& lowest_m,
                     const Eigen::Vector3d& highest_m) {
  TriangleMesh mesh;
  for (const Ring& ring : rings) {
    for (std::uint32_t k = 0; k < kSegments; ++k) {
      const double angle_rad = 2.0 * kPi * k / kSegments;
      mesh.vertices_m.push_back(
          Eigen::Vector3d(ring.radius_m * std::cos(angle_rad), ring.radius_m * std::sin(angle_rad), ring.z_m)
              .cast<float>());
    }
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.vertices_m.size());
  const std::uint32_t top = bottom + 1;
  mesh.vertices_m.push_back(lowest_m.cast<float>());
  mesh.vertices_m.push_back(highest_m.cast<float>());
  const auto last = static_cast<std::uint32_t>(rings.size() - 1) * kSegments;
  for (std::uint32_t k = 0; k < kSegments; ++k) {
    const std::uint32_t next = (k + 1) % kSegments;
    mesh.triangles.push_back({bottom, next, k});
    mesh.triangles.push_back({top, last + k, last + next});
    for (std::uint32_t base = 0; base < last; base += kSegments) {
      mesh.triangles.push_back({base + k, base + next, base + kSegments + next});
      mesh.triangles.push_back({base + k, base + kSegments + next, base + kSegments + k});
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh box_mesh(const Eigen::Vector3d& size_m) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5,
                               (corner & 4) != 0 ? 0.5 : -0.5);
    mesh.vertices_m.push_back(size_m.cwiseProduct(sign).cast<float>());
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

TriangleMesh cylinder_mesh(double radius_m, double length_m) {
  const double half_m = 0.5 * length_m;
  return revolve({{radius_m, -half_m}, {radius_m, half_m}}, {0, 0, -half_m}, {0, 0, half_m});
}

TriangleMesh ellipsoid_mesh(const Eigen::Vector3d& radii_m) {
  TriangleMesh mesh = capsule_mesh(1.0, 0.0);
  for (Eigen::Vector3f& vertex : mesh.vertices_m) {
    vertex = radii_m.cwiseProduct(vertex.cast<double>()).cast<float>();
  }
  return mesh;
}

TriangleMesh capsule_mesh(double radius_m, double length_m) {
  std::vector<Ring> rings;
  for (std::uint32_t i = 1; i < kRings; ++i) {
    const double elevation_rad = kPi * (static_cast<double>(i) / kRings - 0.5);
    const double z_m = radius_m * std::sin(elevation_rad);
    const double ring_radius_m = radius_m * std::cos(elevation_rad);
    if (2 * i == kRings && length_m > 0.0) {
      rings.push_back({ring_radius_m, -0.5 * length_m});
      rings.push_back({ring_radius_m, 0.5 * length_m});
    } else {
      rings.push_back({ring_radius_m, z_m + (2 * i < kRings ? -0.5 : 0.5) * length_m});
    }
  }
  const double half_m = 0.5 * length_m + radius_m;
  return revolve(rings, {0, 0, -half_m}, {0, 0, half_m});
}

TriangleMesh plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size_m) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
  TriangleMesh mesh;
  for (const Eigen::Vector2d& sign : {Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(0.5, -0.5),
                                      Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d(-0.5, 0.5)}) {
    const Eigen::Vector3d corner(size_m.x() * sign.x(), size_m.y() * sign.y(), 0.0);
    mesh.vertices_m.push_back((turn * corner).cast<float>());
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace stairwell::sim3d
