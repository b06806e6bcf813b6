#include "coverage3d/target_book.hpp"

#include <algorithm>

namespace stairwell::coverage3d {

namespace {

constexpr double kNearby_m = 2.0;  // changes farther away hardly open a view on a cluster that has none
constexpr int kMostSearches = 3;   // thorough searches of one cluster

/// Most of what was to be seen from there has become known.
bool outdated(const mapping::OccupancyMap& map, const Viewpoint& view) {
  const auto left = std::count_if(view.seen_cells.begin(), view.seen_cells.end(),
                                  [&](const VoxelIndex& v) { return map.at(v) == Occupancy::kUnknown; });
  return 2 * static_cast<std::size_t>(left) < view.seen_cells.size();
}

}  // namespace

/// Where the map changed: what was given up may be seen now, and what was to be gained may have been seen.
void TargetBook::revise(const planning3d::FreeSpace& space, const FrontierFinder& finder) {
  const GridSpec& grid = space.grid();
  for (auto& [id, target] : targets_) {
    const Aabb nearby = finder.clusters().at(id).bounds_m.inflated(kNearby_m);
    const bool changed = std::any_of(
        finder.changed_blocks().begin(), finder.changed_blocks().end(), [&](const mapping::VoxelBox& block) {
          return !nearby.intersection({grid.center_of(block.lo), grid.center_of(block.hi)}).empty();
        });
    if (!changed) continue;
    for (Viewpoint& view : target.views) {
      view.gain_m3 = sampler_.gain_m3(space.map(), view.position_m, view.yaw_rad);
    }
    if (target.views.empty()) look_again(target);
  }
}

void TargetBook::look_again(Target& target) {
  target.fresh = false;
  target.searched = target.searches >= kMostSearches;
}

void TargetBook::refresh(const planning3d::FreeSpace& space, const FrontierFinder& finder,
                         const ViewpointPlaces& places) {
  std::erase_if(targets_, [&](const auto& entry) { return !finder.clusters().contains(entry.first); });
  revise(space, finder);
  for (auto& [id, target] : targets_) {
    const bool had_views = !target.views.empty();
    std::erase_if(target.views, [&](const Viewpoint& view) {
      return !space.traversable(view.voxel) || !places.reachable(view.voxel) || outdated(space.map(), view);
    });
    if (had_views && target.views.empty()) look_again(target);
  }
}

std::size_t TargetBook::look(const planning3d::FreeSpace& space, const FrontierFinder& finder,
                             const ViewpointPlaces& places, const Budget& budget) {
  Budget left = budget;
  std::size_t pending = 0;
  for (const auto& [id, cluster] : finder.clusters()) {
    if (!finder.worth_a_visit(cluster)) continue;
    Target& target = targets_[id];
    if (!target.fresh) {
      if (left.samples-- <= 0) {
        ++pending;
        continue;
      }
      target.views = sampler_.sample(space, cluster, places);
      target.fresh = true;
    }
    if (!target.views.empty() || target.searched) continue;
    if (left.searches-- <= 0) {
      ++pending;
      continue;
    }
    target.views = sampler_.search(space, cluster, places);
    target.searched = true;
    ++target.searches;
    if (!target.views.empty() || places.layers_m.empty()) continue;
    ViewpointPlaces between = places;
    between.only_between_layers = true;
    target.views = sampler_.search(space, cluster, between);
  }
  return pending;
}

}  // namespace stairwell::coverage3d
