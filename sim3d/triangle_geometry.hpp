/// Exact questions about one triangle, in double precision.
#pragma once

#include "core/grid_spec.hpp"
#include "sim3d/world.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::sim3d {

using Triangle = std::array<Eigen::Vector3d, 3>;

Triangle triangle_of(const TriangleMesh& mesh, std::uint32_t index);

/// Half the edge of the smallest axis-aligned cube about `center_m` that touches the triangle.
double cube_half_extent_m(const Triangle& triangle, const Eigen::Vector3d& center_m);

double squared_distance_m2(const Triangle& triangle, const Eigen::Vector3d& point_m);

/// Whether the segment from a to b meets the triangle.
bool segment_hits(const Triangle& triangle, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m);

/// Corners of the part of the triangle inside the box; empty if there is none.
std::vector<Eigen::Vector3d> clip_to_box(const Triangle& triangle, const Aabb& box);

/// Calls visit(voxel, half_extent_m) for every voxel of the grid that the triangle touches when the voxel is grown by
/// `margin_m` on each side; half_extent_m as in `cube_half_extent_m`.
template <typename Visit>
void for_each_voxel_near(const Triangle& triangle, const GridSpec& grid, double margin_m, const Visit& visit) {
  const Eigen::Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  int w = 0;
  normal.cwiseAbs().maxCoeff(&w);
  const bool flat = std::abs(normal[w]) > 0.0;
  const double resolution_m = grid.resolution_m();
  const double reach_m = 0.5 * resolution_m + margin_m;
  Eigen::Vector3i lo;
  Eigen::Vector3i hi;
  Eigen::Vector3d origin_m;
  const auto cell = [&](int axis, double coordinate_m) {
    const int last = grid.size()[static_cast<std::size_t>(axis)];
    return static_cast<int>(
        std::clamp(std::floor((coordinate_m - origin_m[axis]) / resolution_m), -1.0, static_cast<double>(last)));
  };
  const auto extremes = [&](int axis) {
    return std::minmax({triangle[0][axis], triangle[1][axis], triangle[2][axis]});
  };
  for (int axis = 0; axis < 3; ++axis) {
    origin_m[axis] = grid.first_cell()[static_cast<std::size_t>(axis)] * resolution_m;
    const auto [lowest_m, highest_m] = extremes(axis);
    lo[axis] = std::max(0, cell(axis, lowest_m - margin_m));
    hi[axis] = std::min(grid.size()[static_cast<std::size_t>(axis)] - 1, cell(axis, highest_m + margin_m));
  }
  const int u = (w + 1) % 3;
  const int v = (w + 2) % 3;
  // The plane rises by at most this over a grown cell, seen along its steepest axis.
  const double rise_m = flat ? (std::abs(normal[u]) + std::abs(normal[v])) / std::abs(normal[w]) * reach_m : 0.0;
  Eigen::Vector3i at;
  for (at[u] = lo[u]; at[u] <= hi[u]; ++at[u]) {
    for (at[v] = lo[v]; at[v] <= hi[v]; ++at[v]) {
      int first = lo[w];
      int last = hi[w];
      if (flat) {
        const double du = origin_m[u] + (at[u] + 0.5) * resolution_m - triangle[0][u];
        const double dv = origin_m[v] + (at[v] + 0.5) * resolution_m - triangle[0][v];
        const double height_m = triangle[0][w] - (normal[u] * du + normal[v] * dv) / normal[w];
        first = std::max(first, cell(w, height_m - rise_m - margin_m));
        last = std::min(last, cell(w, height_m + rise_m + margin_m));
      }
      for (at[w] = first; at[w] <= last; ++at[w]) {
        const VoxelIndex voxel{at[0], at[1], at[2]};
        const double half_extent_m = cube_half_extent_m(triangle, grid.center_of(voxel));
        if (half_extent_m <= reach_m) visit(voxel, half_extent_m);
      }
    }
  }
}

}  // namespace stairwell::sim3d
