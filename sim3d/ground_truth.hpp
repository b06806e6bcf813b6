#pragma once

#include "core/grid_spec.hpp"
#include "core/robot.hpp"
#include "core/scan.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/world.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace stairwell::sim3d {

/// What a voxel truly is. kBoundary: the surface lies on (or within a millimetre or two of) one of its faces, so both
/// answers are right.
enum class TruthClass : std::uint8_t { kFree, kBoundary, kSurface };

/// The world on the map's own lattice: which voxels a surface passes through. Used only outside the agents.
class GroundTruth {
 public:
  GroundTruth(const World& world, const GridSpec& grid);

  const GridSpec& grid() const { return grid_; }
  const TriangleMesh& mesh() const { return mesh_; }
  TruthClass at(const VoxelIndex& v) const { return at(grid_.linear(v)); }
  TruthClass at(std::size_t linear_index) const {
    if (!near_surface_[linear_index]) return TruthClass::kFree;
    return surface_[linear_index] ? TruthClass::kSurface : TruthClass::kBoundary;
  }
  /// A surface this near to a voxel's face, on either side, makes the voxel kBoundary.
  double face_tolerance_m() const { return std::min(0.002, 0.1 * grid_.resolution_m()); }
  /// A sphere of `radius_m` centred at the point touches no surface (exact triangle distance).
  bool sphere_free(const Eigen::Vector3d& center_m, double radius_m) const;
  /// Distance from a point to the nearest surface, capped at `cap_m`.
  double clearance_m(const Eigen::Vector3d& point_m, double cap_m) const;

  /// Appends at least every triangle that reaches into the cube around the sphere (some may appear twice).
  void triangles_near(const Eigen::Vector3d& center_m, double radius_m, std::vector<std::uint32_t>& triangles) const;

  /// Voxels whose centre the robot can occupy collision-free and reach from one of the starts inside `flight_box`.
  /// One byte per voxel.
  std::vector<std::uint8_t> reachable(const std::vector<Eigen::Vector3d>& starts_m, const Robot& robot,
                                      const Aabb& flight_box) const;

  /// Voxels inside `task_box` that some reachable pose can see with this sensor (any yaw): every reachable voxel,
  /// and each further free or surface voxel for which a ray from some reachable voxel, within range and elevation
  /// limits, ends in it. One byte per voxel. `rays_per_voxel` poses are tried before a voxel counts as unseeable.
  std::vector<std::uint8_t> explorable(const std::vector<std::uint8_t>& reachable, const RayCaster& caster,
                                       const SensorModel& sensor, const Aabb& task_box, int rays_per_voxel = 96) const;

 private:
  void classify();
  void fill_bins();
  template <typename Visit>
  bool any_triangle_near(const Eigen::Vector3d& center_m, double radius_m, const Visit& visit) const;
  /// The free voxel centre nearest to a start that a straight way leads to (a start may stand on the ground).
  std::optional<VoxelIndex> entry_voxel(const Eigen::Vector3d& start_m, double radius_m, const Aabb& flight_box) const;

  GridSpec grid_;
  TriangleMesh mesh_;
  Aabb mesh_bounds_;
  // Bits: large worlds have hundreds of millions of voxels.
  std::vector<bool> near_surface_;  ///< kBoundary or kSurface
  std::vector<bool> surface_;
  // Triangles per coarse cell, for exact distances.
  GridSpec bins_;
  std::vector<std::uint32_t> bin_begin_;
  std::vector<std::uint32_t> bin_triangles_;
};

}  // namespace stairwell::sim3d
