#include "apps/voxel_scene.hpp"

#include "perception/storeys.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::apps {
namespace {

constexpr double kLeastStorey_m = 1.9;
constexpr double kSlab_m = 0.3;
constexpr double kMostCut_m = 1.5;

struct Bounds {
  VoxelIndex lo{1 << 30, 1 << 30, 1 << 30};
  VoxelIndex hi{-1, -1, -1};
  bool any_free = false;
};

Bounds occupied_bounds(const mapping::OccupancyMap& map) {
  Bounds bounds;
  const auto& size = map.grid().size();
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        const Occupancy cell = map.at(VoxelIndex{x, y, z});
        if (cell == Occupancy::kFree) bounds.any_free = true;
        if (cell != Occupancy::kOccupied) continue;
        bounds.lo = {std::min(bounds.lo.x, x), std::min(bounds.lo.y, y), std::min(bounds.lo.z, z)};
        bounds.hi = {std::max(bounds.hi.x, x), std::max(bounds.hi.y, y), std::max(bounds.hi.z, z)};
      }
  return bounds;
}

/// Layers whose tops are floors, from below.
std::vector<int> floor_layers(const VoxelScene& scene) {
  const Eigen::Vector3d size(scene.size[0], scene.size[1], scene.size[2]);
  const GridSpec grid(Aabb{scene.origin_m, scene.origin_m + scene.resolution_m * size}, scene.resolution_m);
  perception::StoreyConfig config;
  config.min_height_m = kLeastStorey_m;
  std::vector<int> floors;
  for (const auto& storey : perception::detect_storeys(scene.cells, grid, config))
    floors.push_back(static_cast<int>(std::lround((storey.floor_z_m - scene.origin_m.z()) / scene.resolution_m)) - 1);
  return floors;
}

}  // namespace

VoxelScene make_scene(const mapping::OccupancyMap& map) {
  const Bounds bounds = occupied_bounds(map);
  VoxelScene scene;
  if (bounds.hi.x < 0) return scene;
  const GridSpec& grid = map.grid();
  scene.resolution_m = grid.resolution_m();
  scene.origin_m = grid.center_of({bounds.lo.x - 1, bounds.lo.y - 1, bounds.lo.z - 1}) -
                   Eigen::Vector3d::Constant(0.5 * scene.resolution_m);
  scene.size = {bounds.hi.x - bounds.lo.x + 3, bounds.hi.y - bounds.lo.y + 3, bounds.hi.z - bounds.lo.z + 3};
  scene.cells.reserve(scene.linear(0, 0, scene.size[2]));
  for (int z = 0; z < scene.size[2]; ++z)
    for (int y = 0; y < scene.size[1]; ++y)
      for (int x = 0; x < scene.size[0]; ++x) {
        const Occupancy cell = map.at(VoxelIndex{bounds.lo.x - 1 + x, bounds.lo.y - 1 + y, bounds.lo.z - 1 + z});
        scene.cells.push_back(cell == Occupancy::kUnknown && !bounds.any_free ? Occupancy::kFree : cell);
      }
  return scene;
}

std::vector<Storey> find_storeys(const VoxelScene& scene, double keep) {
  std::vector<Storey> storeys;
  if (scene.empty()) return storeys;
  std::vector<int> floors = floor_layers(scene);
  if (floors.empty()) floors.push_back(1);
  const int slab = std::max(1, static_cast<int>(std::lround(kSlab_m / scene.resolution_m)));
  const auto height_m = [&](int layer) { return scene.origin_m.z() + layer * scene.resolution_m; };
  const auto cut_away = [&](int height) {  // a tall hall loses its ceiling, not its upper half
    return static_cast<int>(std::lround(std::min((1.0 - keep) * height, kMostCut_m / scene.resolution_m)));
  };
  for (std::size_t k = 0; k < floors.size(); ++k) {
    const bool last = k + 1 == floors.size();
    const int top = last ? scene.size[2] - 2 : std::max(floors[k] + 1, floors[k + 1] - slab);
    // A roof without free space above it (a bare model's own top) is a lid, not a storey.
    if (last && k > 0 && (top - floors[k]) * scene.resolution_m < 0.5 * kLeastStorey_m) {
      storeys.back().ceiling_m = height_m(top + 1);
      break;
    }
    Storey storey;
    storey.floor = floors[k];
    storey.lo = k == 0 ? 0 : std::max(0, floors[k] - slab + 1);
    storey.cut = floors[k] + std::max(1, top - floors[k] - cut_away(top - floors[k]));
    storey.floor_m = height_m(floors[k] + 1);
    storey.ceiling_m = last ? height_m(top + 1) : height_m(floors[k + 1] + 1);
    storeys.push_back(storey);
  }
  return storeys;
}

}  // namespace stairwell::apps
