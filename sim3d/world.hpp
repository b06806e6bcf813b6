#pragma once

#include "core/aabb.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::sim3d {

/// Triangle soup in the world frame, metres.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  void append(const TriangleMesh& other);
  Aabb bounds() const;
};

/// A ground-truth world: everything is surfaces. Voxel inputs (OctoMap, clouds, images, .3dmap) become the exposed
/// faces of their solid voxels.
struct World {
  std::string name;  ///< file stem
  TriangleMesh mesh;
  Aabb bounds;                        ///< of the mesh (infinite planes are clipped to a finite patch)
  std::size_t dropped_triangles = 0;  ///< left out because a corner is not finite or the area is zero
};

/// What formats without sizes of their own need.
struct WorldOptions {
  double extrude_height_m = 2.5;  ///< .yaml/.pgm maps: height of the walls
  double point_size_m = 0.1;      ///< clouds: each point fills the voxel of this size that holds it ...
  bool close_gaps = true;         ///< ... and the voxels between two such ones along an axis are filled as well
  double voxel_size_m = 1.0;      ///< .3dmap: edge of one cell
};

/// By extension: .sdf/.world (SDFormat), .stl .obj .dae .ply(with faces) .glb .gltf (meshes), .bt .ot (OctoMap),
/// .pcd .ply(points) (clouds), .yaml (+ image, ROS map_server), .3dmap (Moving AI).
/// Files whose format defines an up direction (.dae .glb .gltf) are turned to z up; the others are taken as they are.
/// @throws InputError naming the file and what is wrong (missing, empty, truncated, malformed, nothing solid in it).
World load_world(const std::filesystem::path& file, const WorldOptions& options = {});

}  // namespace stairwell::sim3d
