#include "coverage3d/target_book.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

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

/// The clusters worth a visit, deep ones first: where the budget ends, the UAVs shall know what is around them.
std::vector<std::uint32_t> nearest_first(const FrontierFinder& finder, const std::vector<Eigen::Vector3d>& uavs_m) {
  std::vector<std::tuple<bool, double, std::uint32_t>> order;
  for (const auto& [id, cluster] : finder.clusters()) {
    if (!finder.worth_a_visit(cluster)) continue;
    double nearest_m2 = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& at_m : uavs_m)
      nearest_m2 = std::min(nearest_m2, (cluster.center_m - at_m).squaredNorm());
    order.emplace_back(!finder.deep(cluster), nearest_m2, id);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> ids;
  ids.reserve(order.size());
  for (const auto& entry : order) ids.push_back(std::get<2>(entry));
  return ids;
}

/// Where blocks changed, in cells of a metre or a little more.
class ChangedPlaces {
 public:
  ChangedPlaces(const GridSpec& grid, const std::vector<mapping::VoxelBox>& changed)
      : cell_voxels_(std::max(8, static_cast<int>(std::lround(1.0 / grid.resolution_m())))) {
    for (std::size_t axis = 0; axis < 3; ++axis) cells_[axis] = grid.size()[axis] / cell_voxels_ + 1;
    marked_.assign(
        static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]) * static_cast<std::size_t>(cells_[2]),
        false);
    for (const mapping::VoxelBox& block : changed) {
      visit(block, [this](std::size_t cell) { marked_[cell] = true; });
    }
  }

  bool any_in(const mapping::VoxelBox& box) const {
    bool any = false;
    visit(box, [&](std::size_t cell) { any = any || marked_[cell]; });
    return any;
  }

 private:
  template <typename Visit>
  void visit(const mapping::VoxelBox& box, const Visit& each) const {
    const auto lowest = [this](int at) { return std::max(0, at / cell_voxels_); };
    const auto highest = [this](int at, int cells) { return std::min(cells - 1, at / cell_voxels_); };
    for (int z = lowest(box.lo.z); z <= highest(box.hi.z, cells_[2]); ++z)
      for (int y = lowest(box.lo.y); y <= highest(box.hi.y, cells_[1]); ++y)
        for (int x = lowest(box.lo.x); x <= highest(box.hi.x, cells_[0]); ++x)
          each(static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x));
  }

  int cell_voxels_;
  std::array<int, 3> cells_{1, 1, 1};
  std::vector<bool> marked_;
};

}  // namespace

/// Where the map changed: what was given up may be seen now, and what was to be gained may have been seen.
void TargetBook::revise(const planning3d::FreeSpace& space, const FrontierFinder& finder) {
  const GridSpec& grid = space.grid();
  const ChangedPlaces changed(grid, finder.changed_blocks());
  for (auto& [id, target] : targets_) {
    const Aabb nearby = finder.clusters().at(id).bounds_m.inflated(kNearby_m);
    if (!changed.any_in({grid.index_of(nearby.min_m), grid.index_of(nearby.max_m)})) continue;
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
  bequeath(finder);
  revise(space, finder);
  for (auto& [id, target] : targets_) {
    const bool had_views = !target.views.empty();
    std::erase_if(target.views, [&](const Viewpoint& view) {
      return !space.traversable(view.voxel) || !places.reachable(view.voxel) || outdated(space.map(), view);
    });
    if (had_views && target.views.empty()) look_again(target);
  }
}

void TargetBook::bequeath(const FrontierFinder& finder) {
  heirlooms_.clear();
  for (auto entry = targets_.begin(); entry != targets_.end();) {
    if (finder.clusters().contains(entry->first)) {
      ++entry;
      continue;
    }
    Target& gone = entry->second;
    if (!gone.views.empty()) heirlooms_.push_back({gone.center_m, std::move(gone.views)});
    entry = targets_.erase(entry);
  }
}

std::vector<Viewpoint> TargetBook::inherited(const planning3d::FreeSpace& space, const FrontierCluster& cluster) const {
  std::vector<Viewpoint> views;
  for (const Heirloom& heirloom : heirlooms_) {
    if ((heirloom.center_m - cluster.center_m).norm() < kNearby_m) {
      views.insert(views.end(), heirloom.views.begin(), heirloom.views.end());
    }
  }
  return views.empty() ? views : sampler_.inherit(space, cluster, views);
}

bool TargetBook::undecided(std::uint32_t cluster) const {
  const auto found = targets_.find(cluster);
  if (found == targets_.end() || !found->second.fresh) return true;
  return found->second.views.empty() && !found->second.searched;
}

std::size_t TargetBook::look(const planning3d::FreeSpace& space, const FrontierFinder& finder,
                             const ViewpointPlaces& places, const Budget& budget,
                             const std::function<bool(std::uint32_t)>& counts) {
  Budget left = budget;
  std::size_t pending = 0;
  for (const std::uint32_t id : nearest_first(finder, places.also_m)) {
    if (counts && !counts(id)) continue;
    const FrontierCluster& cluster = finder.clusters().at(id);
    Target& target = targets_[id];
    if (!target.fresh) {
      target.center_m = cluster.center_m;
      if (left.samples-- <= 0) {
        if (target.views.empty() && left.legacies-- > 0) target.views = inherited(space, cluster);
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
