#pragma once

#include "core/rng.hpp"
#include "sim3d/world.hpp"

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstdint>

namespace stairwell::sim3d::test {

/// Surface of a box, 12 triangles.
inline TriangleMesh box_mesh(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices_m.push_back(Eigen::Vector3d((corner & 1) != 0 ? max_m.x() : min_m.x(),
                                              (corner & 2) != 0 ? max_m.y() : min_m.y(),
                                              (corner & 4) != 0 ? max_m.z() : min_m.z())
                                  .cast<float>());
  }
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces{
      {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}};
  for (const auto& f : kFaces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return mesh;
}

inline void add(TriangleMesh& to, const TriangleMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(to.vertices_m.size());
  to.vertices_m.insert(to.vertices_m.end(), mesh.vertices_m.begin(), mesh.vertices_m.end());
  for (const auto& t : mesh.triangles) to.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

inline Eigen::Vector3d random_point(Rng& rng, double half_m) {
  return {rng.uniform(-half_m, half_m), rng.uniform(-half_m, half_m), rng.uniform(-half_m, half_m)};
}

/// Independent triangles within a cube of this half width.
inline TriangleMesh random_mesh(Rng& rng, int triangles, double half_m, double size_m) {
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const Eigen::Vector3d at_m = random_point(rng, half_m);
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (int corner = 0; corner < 3; ++corner) {
      mesh.vertices_m.push_back((at_m + random_point(rng, size_m)).cast<float>());
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

inline World world_of(const TriangleMesh& mesh) {
  World world;
  world.mesh = mesh;
  for (const auto& vertex : mesh.vertices_m) world.bounds.extend(vertex.cast<double>());
  return world;
}

inline std::array<Eigen::Vector3d, 3> corners_of(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return {mesh.vertices_m[t[0]].cast<double>(), mesh.vertices_m[t[1]].cast<double>(),
          mesh.vertices_m[t[2]].cast<double>()};
}

}  // namespace stairwell::sim3d::test
