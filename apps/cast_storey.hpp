#pragma once

#include "apps/canvas.hpp"
#include "apps/voxel_scene.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stairwell::apps {

/// Parallel projection to canvas samples: x to the right, y down, depth away from the viewer in metres.
struct Projection {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Vector3d away = -Eigen::Vector3d::UnitZ();
  double samples_per_m = 1.0;
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();

  /// @param azimuth_rad direction of view in the xy plane; @param elevation_rad of the viewer above the horizon
  static Projection looking(double azimuth_rad, double elevation_rad);

  Eigen::Vector2d flat_m(const Eigen::Vector3d& p) const { return {right.dot(p), -up.dot(p)}; }
  Eigen::Vector2d screen(const Eigen::Vector3d& p) const { return samples_per_m * flat_m(p) + offset; }
  float depth(const Eigen::Vector3d& p) const { return static_cast<float>(away.dot(p)); }
};

/// Draws the voxels of one storey, moved by `shift_m`: a ray of sight per sample, and from where it ends rays to the
/// sun and over the hemisphere (ambient occlusion). Outer walls between the viewer and the inside are left out: solid
/// voxels that show no known-free side to the viewer.
/// @param colours one per voxel layer of the scene
void draw_storey(Canvas& canvas, const Projection& view, const VoxelScene& scene, const Storey& storey,
                 const Eigen::Vector3d& shift_m, const std::vector<Colour>& colours);

}  // namespace stairwell::apps
