#include "learning/train/training_world.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::train {

namespace {

constexpr float kOccupied = 2.0F;  // log-odds
constexpr float kFree = -1.0F;
constexpr double kSlab_m = 0.2;
constexpr double kTruncation_m = 1.5;

Aabb box_of(double x0, double y0, double z0, double x1, double y1, double z1) {
  return Aabb{{x0, y0, z0}, {x1, y1, z1}};
}

void add_disc(VoxelScene& scene, const Eigen::Vector2d& center_m, double radius_m) {
  const double res = scene.grid.resolution_m();
  const double top = scene.grid.box().max_m.z();
  for (double y = center_m.y() - radius_m; y <= center_m.y() + radius_m; y += res) {
    const double half = std::sqrt(std::max(0.0, radius_m * radius_m - (y - center_m.y()) * (y - center_m.y())));
    scene.fill(box_of(center_m.x() - half, y, 0.0, center_m.x() + half, y + res, top), true);
  }
}

void add_slice_obstacle(VoxelScene& scene, const SliceWorldConfig& config, double scale, Rng& rng) {
  const Eigen::Vector2d at(rng.uniform(0.0, config.size_m), rng.uniform(0.0, config.size_m));
  const int kind = rng.uniform_int(0, 5);
  Eigen::Vector2d size;
  if (kind <= 1) {  // a thin wall
    size = {config.resolution_m * rng.uniform_int(1, 3), scale * rng.uniform(1.0, 4.0)};
    if (rng.uniform() < 0.5) std::swap(size.x(), size.y());
  } else if (kind == 2) {  // two walls at a corner: a trap
    const double length = scale * rng.uniform(1.0, 2.5), wide = config.resolution_m * rng.uniform_int(1, 3);
    const double sx = rng.uniform() < 0.5 ? -1.0 : 1.0;
    const double x1 = at.x() + sx * length;
    scene.fill(box_of(std::min(at.x(), x1), at.y(), 0, std::max(at.x(), x1), at.y() + wide, config.height_m), true);
    size = {wide, length};
  } else if (kind == 3) {
    add_disc(scene, at, scale * rng.uniform(0.3, 1.0));
    return;
  } else {
    size = {scale * rng.uniform(0.6, 2.5), scale * rng.uniform(0.6, 2.5)};
  }
  scene.fill(box_of(at.x(), at.y(), 0.0, at.x() + size.x(), at.y() + size.y(), config.height_m), true);
}

/// Cuts a room in two by a wall with one or two doors, and goes on with the halves.
void split_room(VoxelScene& scene, const Aabb& room, int depth, Rng& rng) {
  const Eigen::Vector3d size = room.max_m - room.min_m;
  const int axis = size.x() > size.y() ? 0 : 1;
  if (depth == 0 || size[axis] < 5.0 || rng.uniform() < 0.1) return;
  const int other = 1 - axis;
  const double at = room.min_m[axis] + rng.uniform(0.35, 0.65) * size[axis];
  const double half = 0.05 * rng.uniform_int(1, 2);
  Aabb wall = room;
  wall.min_m[axis] = at - half;
  wall.max_m[axis] = at + half;
  scene.fill(wall, true);
  const int doors = rng.uniform() < 0.3 ? 2 : 1;
  for (int i = 0; i < doors; ++i) {
    Aabb door = wall;
    const double wide = rng.uniform(0.9, 1.6);
    door.min_m[other] =
        rng.uniform(room.min_m[other] + 0.2, std::max(room.min_m[other] + 0.3, room.max_m[other] - 0.2 - wide));
    door.max_m[other] = door.min_m[other] + wide;
    door.min_m[axis] -= 0.1;
    door.max_m[axis] += 0.1;
    if (rng.uniform() < 0.7) door.max_m.z() = room.min_m.z() + rng.uniform(1.9, 2.2);
    if (rng.uniform() < 0.15) door.min_m.z() = room.min_m.z() + 0.9;  // a window
    scene.fill(door, false);
  }
  Aabb low = room, high = room;
  low.max_m[axis] = at - half;
  high.min_m[axis] = at + half;
  split_room(scene, low, depth - 1, rng);
  split_room(scene, high, depth - 1, rng);
}

void add_clutter(VoxelScene& scene, const Aabb& storey, Rng& rng) {
  const Eigen::Vector3d size = storey.max_m - storey.min_m;
  const int count = rng.uniform_int(0, static_cast<int>(size.x() * size.y() / 6.0));
  for (int i = 0; i < count; ++i) {
    const double x = rng.uniform(storey.min_m.x(), storey.max_m.x()),
                 y = rng.uniform(storey.min_m.y(), storey.max_m.y());
    const double wx = rng.uniform(0.2, 1.4), wy = rng.uniform(0.2, 1.4);
    double z0 = storey.min_m.z(), z1 = z0 + rng.uniform(0.4, 1.8);
    const double kind = rng.uniform();
    if (kind < 0.25) z1 = storey.max_m.z();                                                // a pillar
    if (kind > 0.8) z0 = storey.max_m.z() - rng.uniform(0.3, 1.2), z1 = storey.max_m.z();  // it hangs
    const double slim = kind < 0.25 ? 0.5 : 1.0;
    scene.fill(box_of(x, y, z0, x + slim * wx, y + slim * wy, z1), true);
  }
}

}  // namespace

VoxelScene::VoxelScene(const Aabb& box, double resolution_m) : grid(box, resolution_m), solid(grid.voxel_count(), 0) {}

void VoxelScene::fill(const Aabb& box, bool is_solid) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid.resolution_m());
  const VoxelIndex lo = grid.index_of(box.min_m + half), hi = grid.index_of(box.max_m + half);  // hi is not included
  const auto& n = grid.size();
  const int x0 = std::clamp(lo.x, 0, n[0]), x1 = std::clamp(hi.x, x0, n[0]);
  for (int z = std::max(0, lo.z); z < std::min(n[2], hi.z); ++z) {
    for (int y = std::max(0, lo.y); y < std::min(n[1], hi.y); ++y) {
      const auto row = solid.begin() + static_cast<std::ptrdiff_t>(grid.linear({0, y, z}));
      std::fill(row + x0, row + x1, static_cast<std::uint8_t>(is_solid ? 1 : 0));
    }
  }
}

double VoxelScene::solid_fraction() const {
  return static_cast<double>(std::ranges::count(solid, 1)) / static_cast<double>(solid.size());
}

VoxelScene make_slice_scene(const SliceWorldConfig& config, Rng& rng) {
  const double s = config.size_m, b = config.resolution_m, h = config.height_m;
  VoxelScene scene(box_of(0, 0, 0, s, s, h), b);
  scene.fill(box_of(0, 0, 0, s, b, h), true);
  scene.fill(box_of(0, s - b, 0, s, s, h), true);
  scene.fill(box_of(0, 0, 0, b, s, h), true);
  scene.fill(box_of(s - b, 0, 0, s, s, h), true);
  const double wanted = rng.uniform(config.least_obstacles, config.most_obstacles);
  const double scale = rng.uniform(0.6, 1.4);
  for (int i = 0; i < 400 && scene.solid_fraction() < wanted; ++i) add_slice_obstacle(scene, config, scale, rng);
  return scene;
}

VoxelScene make_storey_scene(const StoreyWorldConfig& config, Rng& rng) {
  const double wx = rng.uniform(config.least_size_m, config.most_size_m);
  const double wy = rng.uniform(config.least_size_m, config.most_size_m);
  const double high = rng.uniform(config.least_height_m, config.most_height_m);
  const int storeys = rng.uniform_int(config.least_storeys, config.most_storeys);
  VoxelScene scene(box_of(0, 0, 0, wx, wy, storeys * high), config.resolution_m);
  for (int k = 0; k < storeys; ++k) {
    const Aabb storey = box_of(0, 0, k * high, wx, wy, (k + 1) * high - kSlab_m);
    split_room(scene, storey, rng.uniform_int(0, 3), rng);
    add_clutter(scene, storey, rng);
    scene.fill(box_of(0, 0, storey.max_m.z(), wx, wy, (k + 1) * high), true);
  }
  for (int k = 0; k + 1 < storeys; ++k) {
    const int holes = rng.uniform_int(1, 2);
    for (int i = 0; i < holes; ++i) {
      const double hx = rng.uniform(1.2, 2.4), hy = rng.uniform(1.2, 2.4);
      const double x = rng.uniform(0.2, wx - hx - 0.2), y = rng.uniform(0.2, wy - hy - 0.2);
      const double middle = (k + 1) * high;  // what stands in the hole or hangs into it goes
      scene.fill(box_of(x, y, middle - kSlab_m - 0.6, x + hx, y + hy, middle + 0.6), false);
    }
  }
  return scene;
}

TrainingWorld::TrainingWorld(const VoxelScene& scene, const Robot& robot, const std::vector<std::uint8_t>* seen)
    : robot_(robot),
      map_(scene.grid),
      blocked_(scene.grid, kTruncation_m, mapping::Obstacles::kBlocked),
      words_(scene.grid, mapping::Obstacles::kBlocked) {
  const auto& n = scene.grid.size();
  std::size_t i = 0;
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x, ++i) {
        if (seen != nullptr && (*seen)[i] == 0) continue;
        map_.set_log_odds({x, y, z}, scene.solid[i] != 0 ? kOccupied : kFree);
      }
    }
  }
  blocked_.update(map_);
  words_.update(map_);
}

std::vector<std::uint8_t> seen_from(const VoxelScene& scene, const std::vector<Eigen::Vector3d>& places_m,
                                    double range_m) {
  constexpr int kAzimuths = 180, kElevations = 25;
  std::vector<std::uint8_t> seen(scene.solid.size(), 0);
  const double step_m = 0.5 * scene.grid.resolution_m();
  for (const Eigen::Vector3d& place : places_m) {
    for (int e = 0; e < kElevations; ++e) {
      const double elevation = rad_from_deg(-50.0 + 100.0 * e / (kElevations - 1));
      for (int a = 0; a < kAzimuths; ++a) {
        const double azimuth = 2.0 * kPi * a / kAzimuths;
        const Eigen::Vector3d step =
            step_m * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                                     std::sin(elevation));
        Eigen::Vector3d p = place;
        for (double gone_m = 0.0; gone_m < range_m; gone_m += step_m, p += step) {
          const VoxelIndex v = scene.grid.index_of(p);
          if (!scene.grid.contains(v)) break;
          const std::size_t i = scene.grid.linear(v);
          seen[i] = 1;
          if (scene.solid[i] != 0) break;
        }
      }
    }
  }
  return seen;
}

std::optional<Eigen::Vector3d> random_place(const planning3d::FreeSpace& space, std::optional<double> height_m,
                                            Rng& rng) {
  const Aabb box = space.grid().box();
  for (int i = 0; i < 2000; ++i) {
    Eigen::Vector3d p;
    for (Eigen::Index a = 0; a < 3; ++a) p[a] = rng.uniform(box.min_m[a], box.max_m[a]);
    if (height_m) p.z() = *height_m;
    if (space.traversable(space.grid().index_of(p)) && space.sphere_free(p, space.robot().radius_m)) return p;
  }
  return std::nullopt;
}

}  // namespace stairwell::train
