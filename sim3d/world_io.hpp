#pragma once

#include "sim3d/world.hpp"

#include <filesystem>

namespace stairwell::sim3d {

/// Size of a world.
struct WorldInfo {
  std::size_t triangles = 0;
  std::size_t vertices = 0;
  Aabb bounds;
  double area_m2 = 0.0;  ///< of all triangles
};

WorldInfo world_info(const World& world);

/// Writes the world's surface as binary .stl, .obj or .ply (by extension). The file appears only once it is complete.
/// @throws InputError for another extension, RunError when it cannot be written.
void save_mesh(const World& world, const std::filesystem::path& file);

}  // namespace stairwell::sim3d
