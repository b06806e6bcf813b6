#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace stairwell::sim3d {

/// Adds the triangles of a flat simple polygon, convex or not, with its winding kept; fewer than three corners add
/// nothing. A polygon that crosses itself is cut like a fan.
/// @pre every corner < vertices_m.size()
void triangulate(std::span<const std::uint32_t> corners, std::span<const Eigen::Vector3f> vertices_m,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace stairwell::sim3d
