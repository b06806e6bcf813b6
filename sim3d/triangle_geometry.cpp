#include "sim3d/triangle_geometry.hpp"

#include <Eigen/Geometry>

namespace stairwell::sim3d {

Triangle triangle_of(const TriangleMesh& mesh, std::uint32_t index) {
  const auto& corners = mesh.triangles[index];
  return {mesh.vertices_m[corners[0]].cast<double>(), mesh.vertices_m[corners[1]].cast<double>(),
          mesh.vertices_m[corners[2]].cast<double>()};
}

// Separating axes of a box and a triangle (Akenine-Moeller 2001), solved for the size of a cube: along each axis the
// cube's half width is half_extent * |axis|_1, so the largest gap over all axes is the half extent at first touch.
double cube_half_extent_m(const Triangle& triangle, const Eigen::Vector3d& center_m) {
  const Triangle t{triangle[0] - center_m, triangle[1] - center_m, triangle[2] - center_m};
  double half_extent_m = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax({t[0][axis], t[1][axis], t[2][axis]});
    half_extent_m = std::max({half_extent_m, low, -high});
  }
  const auto separate = [&](const Eigen::Vector3d& axis) {
    const double size = axis.lpNorm<1>();
    if (size < 1e-12) return;
    const double p0 = axis.dot(t[0]);
    const double p1 = axis.dot(t[1]);
    const double p2 = axis.dot(t[2]);
    const double gap = std::max(std::min({p0, p1, p2}), -std::max({p0, p1, p2}));
    half_extent_m = std::max(half_extent_m, gap / size);
  };
  const Triangle edges{t[1] - t[0], t[2] - t[1], t[0] - t[2]};
  separate(edges[0].cross(edges[1]));
  for (const Eigen::Vector3d& edge : edges) {
    separate({0.0, -edge.z(), edge.y()});
    separate({edge.z(), 0.0, -edge.x()});
    separate({-edge.y(), edge.x(), 0.0});
  }
  return half_extent_m;
}

namespace {

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double s = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - s * ab).squaredNorm();
}

}  // namespace

double squared_distance_m2(const Triangle& triangle, const Eigen::Vector3d& point_m) {
  const Eigen::Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  bool above = normal.squaredNorm() > 0.0;
  for (std::size_t i = 0; above && i < 3; ++i) {
    const Eigen::Vector3d edge = triangle[(i + 1) % 3] - triangle[i];
    above = normal.cross(edge).dot(point_m - triangle[i]) >= 0.0;
  }
  if (above) {
    const double height = normal.dot(point_m - triangle[0]);
    return height * height / normal.squaredNorm();
  }
  double nearest = squared_distance_to_segment(point_m, triangle[0], triangle[1]);
  nearest = std::min(nearest, squared_distance_to_segment(point_m, triangle[1], triangle[2]));
  return std::min(nearest, squared_distance_to_segment(point_m, triangle[2], triangle[0]));
}

bool segment_hits(const Triangle& triangle, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
  // Moeller & Trumbore 1997
  const Eigen::Vector3d direction = b_m - a_m;
  const Eigen::Vector3d e1 = triangle[1] - triangle[0];
  const Eigen::Vector3d e2 = triangle[2] - triangle[0];
  const Eigen::Vector3d p = direction.cross(e2);
  const double determinant = e1.dot(p);
  if (std::abs(determinant) < 1e-15) return false;
  const Eigen::Vector3d s = a_m - triangle[0];
  const double u = s.dot(p) / determinant;
  const Eigen::Vector3d q = s.cross(e1);
  const double v = direction.dot(q) / determinant;
  const double t = e2.dot(q) / determinant;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t <= 1.0;
}

std::vector<Eigen::Vector3d> clip_to_box(const Triangle& triangle, const Aabb& box) {
  for (int axis = 0; axis < 3; ++axis) {  // most triangles that are asked about lie beside the box
    const auto [least, most] = std::minmax({triangle[0][axis], triangle[1][axis], triangle[2][axis]});
    if (most < box.min_m[axis] || least > box.max_m[axis]) return {};
  }
  // Sutherland & Hodgman 1974, one box face after the other
  std::vector<Eigen::Vector3d> polygon(triangle.begin(), triangle.end());
  std::vector<Eigen::Vector3d> clipped;
  for (int face = 0; face < 6 && !polygon.empty(); ++face) {
    const int axis = face / 2;
    const double sign = face % 2 == 0 ? 1.0 : -1.0;
    const double limit = face % 2 == 0 ? box.min_m[axis] : box.max_m[axis];
    const auto inside_by = [&](const Eigen::Vector3d& p) { return sign * (p[axis] - limit); };
    clipped.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector3d& a = polygon[i];
      const Eigen::Vector3d& b = polygon[(i + 1) % polygon.size()];
      const double da = inside_by(a);
      const double db = inside_by(b);
      if (da >= 0.0) clipped.push_back(a);
      if ((da >= 0.0) != (db >= 0.0)) clipped.emplace_back(a + da / (da - db) * (b - a));
    }
    polygon.swap(clipped);
  }
  return polygon;
}

}  // namespace stairwell::sim3d
