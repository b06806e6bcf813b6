#include "coverage3d/target_book.hpp"

#include <algorithm>

namespace stairwell::coverage3d {

namespace {

/// Most of what was to be seen from there has become known.
bool outdated(const mapping::OccupancyMap& map, const Viewpoint& view) {
  const auto left = std::count_if(view.seen_cells.begin(), view.seen_cells.end(),
                                  [&](const VoxelIndex& v) { return map.at(v) == Occupancy::kUnknown; });
  return 2 * static_cast<std::size_t>(left) < view.seen_cells.size();
}

}  // namespace

void TargetBook::mark_stale(const FrontierFinder& finder, const GridSpec& grid) {
  if (finder.changed_blocks().empty()) return;
  Aabb changed;
  for (const mapping::VoxelBox& block : finder.changed_blocks()) {
    changed.extend(grid.center_of(block.lo));
    changed.extend(grid.center_of(block.hi));
  }
  const double reach_m = sampler_.config().range_fraction * sampler_.config().sensor.max_range_m;
  for (auto& [id, target] : targets_) {
    if (!target.views.empty()) continue;
    if (finder.clusters().at(id).bounds_m.inflated(reach_m).intersection(changed).empty()) continue;
    target.fresh = target.searched = false;
  }
}

std::size_t TargetBook::update(const planning3d::FreeSpace& space, const FrontierFinder& finder,
                               const ViewpointPlaces& places, const Budget& budget) {
  std::erase_if(targets_, [&](const auto& entry) { return !finder.clusters().contains(entry.first); });
  mark_stale(finder, space.grid());
  for (auto& [id, target] : targets_) {
    const bool had_views = !target.views.empty();
    std::erase_if(target.views, [&](const Viewpoint& view) {
      return !space.traversable(view.voxel) || !places.reachable(view.voxel) || outdated(space.map(), view);
    });
    if (had_views && target.views.empty()) target.fresh = target.searched = false;
  }
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
    if (!target.views.empty() || places.layers_m.empty()) continue;
    ViewpointPlaces between = places;
    between.only_between_layers = true;
    target.views = sampler_.search(space, cluster, between);
  }
  return pending;
}

}  // namespace stairwell::coverage3d
