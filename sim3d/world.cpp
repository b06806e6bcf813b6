#include "sim3d/world.hpp"

#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"

#include <Eigen/Geometry>

#include <bit>
#include <cmath>
#include <new>
#include <stdexcept>
#include <unordered_map>

namespace stairwell::sim3d {

namespace {

struct BitsHash {
  std::size_t operator()(const std::array<std::uint32_t, 3>& bits) const {
    std::uint64_t hash = 0;
    for (const std::uint32_t word : bits) {
      hash = (hash ^ word) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29;
    }
    return static_cast<std::size_t>(hash);
  }
};

std::array<std::uint32_t, 3> bits_of(const Eigen::Vector3f& vertex) {
  // +0 makes -0 and 0 the same vertex.
  return {std::bit_cast<std::uint32_t>(vertex.x() + 0.0F), std::bit_cast<std::uint32_t>(vertex.y() + 0.0F),
          std::bit_cast<std::uint32_t>(vertex.z() + 0.0F)};
}

bool usable(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  for (const std::uint32_t index : triangle) {
    if (index >= mesh.vertices_m.size() || !mesh.vertices_m[index].allFinite()) {
      return false;
    }
  }
  const Eigen::Vector3d a = mesh.vertices_m[triangle[0]].cast<double>();
  const Eigen::Vector3d b = mesh.vertices_m[triangle[1]].cast<double>();
  const Eigen::Vector3d c = mesh.vertices_m[triangle[2]].cast<double>();
  return (b - a).cross(c - a).squaredNorm() > 0.0;
}

/// Equal vertices become one; unusable triangles and unused vertices go. Returns how many triangles went.
std::size_t tidy(TriangleMesh& mesh) {
  TriangleMesh tidied;
  tidied.triangles.reserve(mesh.triangles.size());
  std::unordered_map<std::array<std::uint32_t, 3>, std::uint32_t, BitsHash> index_of;
  index_of.reserve(mesh.vertices_m.size());
  for (const auto& triangle : mesh.triangles) {
    if (!usable(mesh, triangle)) {
      continue;
    }
    auto& corners = tidied.triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3f& vertex = mesh.vertices_m[triangle[i]];
      const auto [found, is_new] =
          index_of.try_emplace(bits_of(vertex), static_cast<std::uint32_t>(tidied.vertices_m.size()));
      if (is_new) {
        tidied.vertices_m.push_back(vertex);
      }
      corners[i] = found->second;
    }
  }
  const std::size_t dropped = mesh.triangles.size() - tidied.triangles.size();
  mesh = std::move(tidied);
  return dropped;
}

void require_positive(double value, const char* name, const std::filesystem::path& file) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    fail_input(file, std::string(name) + " must be a positive number of metres, got " + std::to_string(value));
  }
}

TriangleMesh join(const std::vector<MeshPart>& parts) {
  TriangleMesh mesh;
  for (const MeshPart& part : parts) {
    mesh.append(part.mesh);
  }
  return mesh;
}

TriangleMesh load_ply_world(const std::filesystem::path& file, const WorldOptions& options) {
  TriangleMesh mesh = load_ply(file);
  if (!mesh.triangles.empty()) {
    return mesh;
  }
  require_positive(options.point_size_m, "point size", file);
  std::vector<Eigen::Vector3d> points_m;
  points_m.reserve(mesh.vertices_m.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices_m) {
    points_m.push_back(vertex.cast<double>());
  }
  return mesh_of_points(points_m, options, file);
}

TriangleMesh load_by_extension(const std::filesystem::path& file, const WorldOptions& options) {
  const std::string extension = lower_extension(file);
  if (extension == ".sdf" || extension == ".world") {
    return load_sdf(file);
  }
  if (extension == ".ply") {
    return load_ply_world(file, options);
  }
  if (is_mesh_extension(extension)) {
    return join(load_mesh_parts(file));
  }
  if (extension == ".bt" || extension == ".ot") {
    return load_octomap(file);
  }
  if (extension == ".pcd") {
    require_positive(options.point_size_m, "point size", file);
    return mesh_of_points(load_pcd(file), options, file);
  }
  if (extension == ".yaml" || extension == ".yml") {
    require_positive(options.extrude_height_m, "wall height", file);
    return load_image_map(file, options.extrude_height_m);
  }
  if (extension == ".3dmap") {
    require_positive(options.voxel_size_m, "voxel size", file);
    return load_voxel3dmap(file, options.voxel_size_m);
  }
  if (extension == ".pgm" || extension == ".png") {
    fail_input(file, "is the image of a map; name its .yaml file (ROS map_server), which holds scale and origin");
  }
  fail_input(file, "unknown kind of world '" + extension +
                       "'; known are .sdf .world .stl .obj .dae .ply .glb .gltf .bt .ot .pcd .yaml .3dmap");
}

}  // namespace

void TriangleMesh::append(const TriangleMesh& other) {
  const auto offset = static_cast<std::uint32_t>(vertices_m.size());
  vertices_m.insert(vertices_m.end(), other.vertices_m.begin(), other.vertices_m.end());
  triangles.reserve(triangles.size() + other.triangles.size());
  for (const auto& [a, b, c] : other.triangles) {
    triangles.push_back({a + offset, b + offset, c + offset});
  }
}

Aabb TriangleMesh::bounds() const {
  Aabb box;
  for (const Eigen::Vector3f& vertex : vertices_m) {
    box.extend(vertex.cast<double>());
  }
  return box;
}

World load_world(const std::filesystem::path& file, const WorldOptions& options) {
  require_file(file);
  World world;
  world.name = file.stem().string();
  try {
    world.mesh = load_by_extension(file, options);
  } catch (const std::bad_alloc&) {
    fail_input(file, "needs more memory than there is");
  } catch (const std::length_error&) {
    fail_input(file, "needs more memory than there is");
  }
  const bool had_triangles = !world.mesh.triangles.empty();
  world.dropped_triangles = tidy(world.mesh);
  if (world.mesh.triangles.empty()) {
    fail_input(file, had_triangles ? "none of its triangles is usable (corners not finite, or no area); export it again"
                                   : "holds no geometry (no triangle, no solid cell); nothing to explore");
  }
  world.bounds = world.mesh.bounds();
  return world;
}

}  // namespace stairwell::sim3d
