#include "apps/cast_storey.hpp"

#include "core/units.hpp"
#include "sim3d/loaders/voxel_faces.hpp"
#include "sim3d/ray_caster.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace stairwell::apps {
namespace {

constexpr double kWall_m = 0.6;          ///< thickest wall that is recognised as near or inner wall
constexpr float kShadow_m = 6.0f;        ///< length of the shadow rays
constexpr float kAmbientReach_m = 1.0f;  ///< what is nearer than this takes ambient light away
constexpr float kAmbient = 0.62f;
constexpr float kSun = 0.50f;
constexpr float kShade = 0.35f;  ///< share of the sun that is left in a shadow
constexpr float kCut = 0.34f;    ///< light on walls that are cut
const Eigen::Vector3f kLight = Eigen::Vector3f(-0.42f, -0.16f, 0.89f).normalized();

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
  /// The outer faces, metres from the scene's origin.
  sim3d::TriangleMesh surface() const {
    sim3d::SolidVoxels solid;
    for (int z = storey_->lo; z <= storey_->cut; ++z)
      for (int y = 0; y < scene_->size[1]; ++y)
        for (int x = 0; x < scene_->size[0]; ++x)
          if (flags_[scene_->linear(x, y, z)] != 0) solid.add(x, y, z);
    return solid.exposed_faces(Eigen::Vector3d::Constant(scene_->resolution_m));
  }
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

/// Directions over the hemisphere about +z, as dense as the cosine (Malley's method: a disc lifted up). The samples of
/// one pixel share them out, and every pixel has the same, so that nothing flickers or grains.
class AmbientDirections {
 public:
  static constexpr std::size_t kPerSample = 6;
  static constexpr std::size_t kSets = Canvas::kSamples * Canvas::kSamples;
  using Set = std::array<Eigen::Vector3f, kPerSample>;

  AmbientDirections() {
    constexpr std::size_t kAll = kSets * kPerSample;
    for (std::size_t i = 0; i < kAll; ++i) {
      const float radius = std::sqrt((static_cast<float>(i) + 0.5f) / kAll);
      const auto angle = static_cast<float>(static_cast<double>(i) * kPi * (3.0 - std::sqrt(5.0)));  // golden angle
      sets_[i % kSets][i / kSets] = {radius * std::cos(angle), radius * std::sin(angle),
                                     std::sqrt(1.0f - radius * radius)};
    }
  }
  const Set& at(int x, int y) const {
    return sets_[static_cast<std::size_t>(Canvas::kSamples * (y % Canvas::kSamples) + x % Canvas::kSamples)];
  }

 private:
  std::array<Set, kSets> sets_;
};

/// Where a ray of sight meets a voxel, metres from the scene's origin.
struct Sight {
  Eigen::Vector3f point_m;
  Eigen::Vector3f normal;
  std::array<int, 3> cell;
};

/// Looks at the drawn part of one storey.
class StoreyCaster {
 public:
  StoreyCaster(const VoxelScene& scene, const Storey& storey, const Projection& view)
      : scene_(&scene), shown_(scene, storey, view), caster_(shown_.surface()), away_(view.away) {
    for (std::size_t a = 0; a < 3; ++a) size_m_[static_cast<Eigen::Index>(a)] = scene.resolution_m * scene.size[a];
    reach_m_ = size_m_.norm();
  }

  /// @param through_m any point of the line of sight. @returns metres along it from that point; infinity: nothing there
  double look(const Eigen::Vector3d& through_m, Sight& sight) const {
    const double begin_m = away_.dot(0.5 * size_m_ - through_m) - reach_m_;
    const Eigen::Vector3f from = (through_m + begin_m * away_).cast<float>();
    const Eigen::Vector3f along = away_.cast<float>();
    const sim3d::RayHit hit = caster_.cast(from, along, static_cast<float>(2.0 * reach_m_));
    if (!std::isfinite(hit.distance_m)) return hit.distance_m;
    sight.point_m = from + hit.distance_m * along;
    Eigen::Index axis = 0;
    hit.normal.cwiseAbs().maxCoeff(&axis);
    sight.normal = Eigen::Vector3f::Zero();
    sight.normal[axis] = along[axis] > 0.0f ? -1.0f : 1.0f;
    const auto edge = static_cast<float>(scene_->resolution_m);
    const Eigen::Vector3f inside = sight.point_m / edge - 0.5f * sight.normal;
    for (std::size_t a = 0; a < 3; ++a)
      sight.cell[a] =
          std::clamp(static_cast<int>(std::floor(inside[static_cast<Eigen::Index>(a)])), 0, scene_->size[a] - 1);
    return begin_m + hit.distance_m;
  }

  float light(const Sight& sight, const AmbientDirections::Set& ambient) const {
    if (sight.normal.z() > 0.0f && shown_.cut_at(sight.cell[0], sight.cell[1], sight.cell[2])) return kCut;
    const Eigen::Vector3f from = sight.point_m + static_cast<float>(0.02 * scene_->resolution_m) * sight.normal;
    float open = 0.0f;  // what is near takes more of the light: soft edges with few rays
    for (const Eigen::Vector3f& local : ambient)
      open +=
          std::min(1.0f, caster_.cast(from, turned(local, sight.normal), kAmbientReach_m).distance_m / kAmbientReach_m);
    const float facing = std::max(0.0f, sight.normal.dot(kLight));
    const float sun = facing > 0.0f && caster_.occluded(from, kLight, kShadow_m) ? kShade : 1.0f;
    return kAmbient * open / AmbientDirections::kPerSample + kSun * facing * sun;
  }

 private:
  /// From the hemisphere about +z to the one about an axis.
  static Eigen::Vector3f turned(const Eigen::Vector3f& local, const Eigen::Vector3f& normal) {
    if (normal.x() != 0.0f) return {normal.x() * local.z(), local.x(), local.y()};
    if (normal.y() != 0.0f) return {local.x(), normal.y() * local.z(), local.y()};
    return {local.x(), local.y(), normal.z() * local.z()};
  }

  const VoxelScene* scene_;
  Shown shown_;
  sim3d::RayCaster caster_;
  Eigen::Vector3d away_;
  Eigen::Vector3d size_m_ = Eigen::Vector3d::Zero();
  double reach_m_ = 0.0;
};

/// The samples that a box of the scene's size may cover: x from, y from, x to, y to (past the end).
std::array<int, 4> window_of(const Canvas& canvas, const Projection& view, const VoxelScene& scene,
                             const Storey& storey, const Eigen::Vector3d& shift_m) {
  std::array<double, 4> window{INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d cell((i & 1) != 0 ? scene.size[0] : 0, (i & 2) != 0 ? scene.size[1] : 0,
                               (i & 4) != 0 ? storey.cut + 1 : storey.lo);
    const Eigen::Vector2d at = view.screen(scene.origin_m + scene.resolution_m * cell + shift_m);
    window = {std::min(window[0], at.x()), std::min(window[1], at.y()), std::max(window[2], at.x()),
              std::max(window[3], at.y())};
  }
  const auto sample = [](double at, int most) { return static_cast<int>(std::clamp(at, 0.0, double(most))); };
  return {sample(std::floor(window[0]), canvas.width()), sample(std::floor(window[1]), canvas.height()),
          sample(std::ceil(window[2]) + 1.0, canvas.width()), sample(std::ceil(window[3]) + 1.0, canvas.height())};
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
  const StoreyCaster caster(scene, storey, view);
  const AmbientDirections ambient;
  const Eigen::Vector3d origin_m = scene.origin_m + shift_m;
  const auto [x_begin, y_begin, x_end, y_end] = window_of(canvas, view, scene, storey, shift_m);
  for (int y = y_begin; y < y_end; ++y)
    for (int x = x_begin; x < x_end; ++x) {
      const Eigen::Vector2d flat_m = (Eigen::Vector2d(x + 0.5, y + 0.5) - view.offset) / view.samples_per_m;
      const Eigen::Vector3d plane_m = flat_m.x() * view.right - flat_m.y() * view.up;
      Sight sight;
      const double depth_m = caster.look(plane_m - origin_m, sight);
      if (!std::isfinite(depth_m) || depth_m > canvas.depth(x, y)) continue;
      canvas.set(x, y, static_cast<float>(depth_m),
                 caster.light(sight, ambient.at(x, y)) * colours[static_cast<std::size_t>(sight.cell[2])]);
    }
}

}  // namespace stairwell::apps
