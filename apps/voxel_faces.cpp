#include "apps/voxel_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace stairwell::apps {
namespace {

constexpr double kWall_m = 0.6;    ///< thickest wall that is recognised as near or inner wall
constexpr double kShadow_m = 6.0;  ///< length of the shadow rays
constexpr float kAmbient = 0.62f;
constexpr float kSun = 0.50f;
const Eigen::Vector3d kLight = Eigen::Vector3d(-0.42, -0.16, 0.89).normalized();

/// The voxels of one storey that are drawn.
class Shown {
 public:
  Shown(const VoxelScene& scene, const Storey& storey, const Projection& view) : scene_(&scene), storey_(&storey) {
    flags_.assign(scene.linear(0, 0, scene.size[2]), 0);
    const int reach = std::max(1, static_cast<int>(std::lround(kWall_m / scene.resolution_m)));
    const int toward_x = view.away.x() > 1e-6 ? -1 : 0, toward_y = view.away.y() > 1e-6 ? -1 : 0;
    const bool from_above = toward_x == 0 && toward_y == 0;
    for (int z = storey.lo; z <= storey.cut; ++z)
      for (int y = 0; y < scene.size[1]; ++y)
        for (int x = 0; x < scene.size[0]; ++x) {
          if (scene.at(x, y, z) != Occupancy::kOccupied) continue;
          const bool open = from_above || opens(x, y, z, 0, 0, 1, reach) || opens(x, y, z, toward_x, 0, 0, reach) ||
                            opens(x, y, z, 0, toward_y, 0, reach);
          flags_[scene.linear(x, y, z)] = open ? 1 : 0;
        }
  }
  bool at(int x, int y, int z) const { return scene_->contains(x, y, z) && flags_[scene_->linear(x, y, z)] != 0; }
  bool cut_at(int x, int y, int z) const {
    return z == storey_->cut && scene_->at(x, y, z + 1) == Occupancy::kOccupied;
  }

 private:
  /// Walking through solid voxels in a direction ends in free space.
  bool opens(int x, int y, int z, int dx, int dy, int dz, int reach) const {
    if (dx == 0 && dy == 0 && dz == 0) return false;
    for (int i = 0; i < reach; ++i) {
      x += dx, y += dy, z += dz;
      const Occupancy cell = scene_->at(x, y, z);
      if (cell != Occupancy::kOccupied) return cell == Occupancy::kFree;
    }
    return false;
  }

  const VoxelScene* scene_;
  const Storey* storey_;
  std::vector<std::uint8_t> flags_;
};

/// One of the three face directions that the viewer can see.
struct FaceKind {
  std::array<int, 3> normal;
  std::array<int, 3> u;
  std::array<int, 3> v;
  float facing = 0.0f;  ///< cosine to the light
};

Eigen::Vector3d vector_of(const std::array<int, 3>& a) { return {double(a[0]), double(a[1]), double(a[2])}; }

/// Share of the sun that reaches a lattice point seen along `normal`.
float sunlight(const VoxelScene& scene, const Shown& shown, Eigen::Vector3d point_cells, int top) {
  const int steps = static_cast<int>(kShadow_m / scene.resolution_m);
  const Eigen::Vector3d step = kLight / kLight.cwiseAbs().maxCoeff();
  for (int i = 0; i < steps; ++i) {
    point_cells += step;
    const int z = static_cast<int>(std::floor(point_cells.z()));
    if (z > top) return 1.0f;
    if (shown.at(static_cast<int>(std::floor(point_cells.x())), static_cast<int>(std::floor(point_cells.y())), z))
      return 0.35f;
  }
  return 1.0f;
}

/// Ambient light at a corner of a face: fewer open neighbours, darker.
float corner_openness(const Shown& shown, const std::array<int, 3>& cell, const FaceKind& kind, int su, int sv) {
  const auto solid = [&](int a, int b) {
    return shown.at(cell[0] + kind.normal[0] + a * kind.u[0] + b * kind.v[0],
                    cell[1] + kind.normal[1] + a * kind.u[1] + b * kind.v[1],
                    cell[2] + kind.normal[2] + a * kind.u[2] + b * kind.v[2]);
  };
  const bool side_u = solid(su, 0), side_v = solid(0, sv);
  const int closed = side_u && side_v ? 3 : int(side_u) + int(side_v) + int(solid(su, sv));
  constexpr std::array<float, 4> kOpenness = {1.0f, 0.80f, 0.64f, 0.50f};
  return kOpenness[static_cast<std::size_t>(closed)];
}

/// Fills the parallelogram p + s*u + t*v, s and t in [0,1), with bilinear light.
void fill_face(Canvas& canvas, const Eigen::Vector2d& p, const Eigen::Vector2d& u, const Eigen::Vector2d& v,
               const Eigen::Vector3f& depth, const std::array<float, 4>& light, const Colour& colour) {
  const double det = u.x() * v.y() - u.y() * v.x();
  if (std::abs(det) < 1e-9) return;
  const Eigen::Vector2d lo = p + u.cwiseMin(0.0) + v.cwiseMin(0.0), hi = p + u.cwiseMax(0.0) + v.cwiseMax(0.0);
  constexpr double kGrow = 1e-6;  // faces that share an edge leave no gap
  for (int y = static_cast<int>(std::floor(lo.y())); y <= static_cast<int>(hi.y()); ++y)
    for (int x = static_cast<int>(std::floor(lo.x())); x <= static_cast<int>(hi.x()); ++x) {
      const double dx = x + 0.5 - p.x(), dy = y + 0.5 - p.y();
      const double s = (dx * v.y() - dy * v.x()) / det, t = (dy * u.x() - dx * u.y()) / det;
      if (s < -kGrow || t < -kGrow || s > 1.0 + kGrow || t > 1.0 + kGrow) continue;
      const auto sf = static_cast<float>(s), tf = static_cast<float>(t);
      const float low = light[0] + sf * (light[1] - light[0]), high = light[2] + sf * (light[3] - light[2]);
      canvas.set(x, y, depth[0] + sf * depth[1] + tf * depth[2], (low + tf * (high - low)) * colour);
    }
}

std::vector<FaceKind> visible_faces(const Projection& view) {
  std::vector<FaceKind> kinds;
  const std::array<std::array<int, 3>, 3> axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (std::size_t a = 0; a < 3; ++a) {
    const double along = view.away[static_cast<Eigen::Index>(a)];
    if (std::abs(along) < 1e-6) continue;
    FaceKind kind;
    kind.normal = axes[a];
    if (along > 0.0) kind.normal[a] = -1;
    kind.u = axes[(a + 1) % 3];
    kind.v = axes[(a + 2) % 3];
    kind.facing = static_cast<float>(std::max(0.0, vector_of(kind.normal).dot(kLight)));
    kinds.push_back(kind);
  }
  return kinds;
}

}  // namespace

Projection Projection::looking(double azimuth_rad, double elevation_rad) {
  const double ca = std::cos(azimuth_rad), sa = std::sin(azimuth_rad);
  const double ce = std::cos(elevation_rad), se = std::sin(elevation_rad);
  Projection view;
  view.right = {sa, -ca, 0.0};
  view.up = {ca * se, sa * se, ce};
  view.away = {ca * ce, sa * ce, -se};
  return view;
}

void draw_storey(Canvas& canvas, const Projection& view, const VoxelScene& scene, const Storey& storey,
                 const Eigen::Vector3d& shift_m, const std::vector<Colour>& colours) {
  const Shown shown(scene, storey, view);
  const double res = scene.resolution_m;
  const auto draw_face = [&](const std::array<int, 3>& cell, const FaceKind& kind) {
    Eigen::Vector3d corner = vector_of(cell);
    for (int a = 0; a < 3; ++a)
      if (kind.normal[static_cast<std::size_t>(a)] > 0) corner[a] += 1.0;
    const bool cut = kind.normal[2] > 0 && shown.cut_at(cell[0], cell[1], cell[2]);
    std::array<float, 4> light{};
    for (std::size_t i = 0; i < 4; ++i) {
      const bool far_u = (i & 1) != 0, far_v = (i & 2) != 0;
      if (cut) {
        light[i] = 0.34f;
        continue;
      }
      const Eigen::Vector3d at = corner + (far_u ? 1.0 : 0.0) * vector_of(kind.u) +
                                 (far_v ? 1.0 : 0.0) * vector_of(kind.v) + 0.5 * vector_of(kind.normal);
      const float sun = kind.facing > 0.0f ? sunlight(scene, shown, at, storey.cut) : 0.0f;
      light[i] =
          kAmbient * corner_openness(shown, cell, kind, far_u ? 1 : -1, far_v ? 1 : -1) + kSun * kind.facing * sun;
    }
    const Eigen::Vector3d at_m = scene.origin_m + res * corner + shift_m;
    const Eigen::Vector3d u_m = res * vector_of(kind.u), v_m = res * vector_of(kind.v);
    fill_face(canvas, view.screen(at_m), view.samples_per_m * view.flat_m(u_m), view.samples_per_m * view.flat_m(v_m),
              {view.depth(at_m), view.depth(u_m), view.depth(v_m)}, light, colours[static_cast<std::size_t>(cell[2])]);
  };
  for (const FaceKind& kind : visible_faces(view))
    for (int z = storey.lo; z <= storey.cut; ++z)
      for (int y = 0; y < scene.size[1]; ++y)
        for (int x = 0; x < scene.size[0]; ++x)
          if (shown.at(x, y, z) && !shown.at(x + kind.normal[0], y + kind.normal[1], z + kind.normal[2]))
            draw_face({x, y, z}, kind);
}

}  // namespace stairwell::apps
