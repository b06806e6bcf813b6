#include "sim3d/loaders/polygon.hpp"

#include <Eigen/Geometry>

namespace stairwell::sim3d {

namespace {

/// Newell's normal: right for any simple polygon, also where single corners are straight.
Eigen::Vector3d normal_of(std::span<const std::uint32_t> corners, std::span<const Eigen::Vector3f> vertices_m) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = vertices_m[corners[0]].cast<double>();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d a = vertices_m[corners[i]].cast<double>() - origin;
    const Eigen::Vector3d b = vertices_m[corners[(i + 1) % corners.size()]].cast<double>() - origin;
    normal += a.cross(b);
  }
  return normal;
}

/// A convex corner with no other corner of the polygon inside its triangle.
bool is_ear(const std::vector<std::uint32_t>& ring, std::size_t i, std::span<const Eigen::Vector3f> vertices_m,
            const Eigen::Vector3d& normal) {
  const std::size_t n = ring.size();
  const auto at = [&](std::size_t k) -> Eigen::Vector3d { return vertices_m[ring[k % n]].cast<double>(); };
  const Eigen::Vector3d a = at(i + n - 1);
  const Eigen::Vector3d b = at(i);
  const Eigen::Vector3d c = at(i + 1);
  const auto side = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r) {
    return (q - p).cross(r - p).dot(normal);
  };
  if (!(side(a, b, c) > 0.0)) {
    return false;
  }
  for (std::size_t k = i + 2; k < i + n - 1; ++k) {
    const Eigen::Vector3d p = at(k);
    const bool is_corner = p == a || p == b || p == c;  // keyhole polygons visit a corner twice
    if (!is_corner && side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0) {
      return false;
    }
  }
  return true;
}

}  // namespace

void triangulate(std::span<const std::uint32_t> corners, std::span<const Eigen::Vector3f> vertices_m,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (corners.size() < 3) {
    return;
  }
  std::vector<std::uint32_t> ring(corners.begin(), corners.end());
  const Eigen::Vector3d normal = normal_of(corners, vertices_m);
  // Ear cutting costs up to n^3: a ring of thousands of corners is a damaged file or a disc, and a fan serves both.
  constexpr std::size_t kLargestRing = 512;
  while (ring.size() > 3 && ring.size() <= kLargestRing) {
    const std::size_t n = ring.size();
    std::size_t ear = 0;
    while (ear < n && !is_ear(ring, ear, vertices_m, normal)) {
      ++ear;
    }
    if (ear == n) {
      break;
    }
    triangles.push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  for (std::size_t i = 2; i < ring.size(); ++i) {
    triangles.push_back({ring[0], ring[i - 1], ring[i]});
  }
}

}  // namespace stairwell::sim3d
