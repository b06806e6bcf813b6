/// One reader per kind of world file. Each throws InputError with one line that names the file.
#pragma once

#include "sim3d/world.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::sim3d {

/// A named piece of a mesh file (.obj object or group, scene node).
struct MeshPart {
  std::string name;
  TriangleMesh mesh;
};

/// .stl .obj .dae .ply .glb .gltf; the parts in file order, z up.
std::vector<MeshPart> load_mesh_parts(const std::filesystem::path& file);
bool is_mesh_extension(const std::string& lower_extension);

TriangleMesh load_stl(const std::filesystem::path& file);
std::vector<MeshPart> load_obj(const std::filesystem::path& file);
/// Faces and points of a .ply file; a file of points alone has no triangles.
TriangleMesh load_ply(const std::filesystem::path& file);
std::vector<MeshPart> load_scene(const std::filesystem::path& file);

TriangleMesh load_sdf(const std::filesystem::path& file);
TriangleMesh load_octomap(const std::filesystem::path& file);
/// Points of a .pcd file, some may be NaN.
std::vector<Eigen::Vector3d> load_pcd(const std::filesystem::path& file);
/// The faces of the voxels that hold a point, and of the gaps between them where the options say so.
TriangleMesh mesh_of_points(const std::vector<Eigen::Vector3d>& points_m, const WorldOptions& options,
                            const std::filesystem::path& file);
TriangleMesh load_image_map(const std::filesystem::path& file, double extrude_height_m);
TriangleMesh load_voxel3dmap(const std::filesystem::path& file, double voxel_size_m);

}  // namespace stairwell::sim3d
