#include "coverage3d/target_book.hpp"

#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace stairwell::coverage3d {

namespace {

constexpr double kNearby_m = 2.0;          // changes farther away hardly open a view on a cluster that has none
constexpr int kMostSearches = 3;           // thorough searches of one cluster
constexpr double kGainsKept_s = 0.9;       // gains are not worked out anew sooner
constexpr int kHandedOn = 4;               // views serve so many clusters one after the other, less one ...
constexpr double kSeenWell = 0.6;          // ... which they show so much of
constexpr std::size_t kAskedAfter = 1000;  // targets asked in one update whether their views can still be got at

/// Most of what was to be seen from there has become known.
bool outdated(const mapping::OccupancyMap& map, const Viewpoint& view) {
  const auto left = std::count_if(view.seen_cells.begin(), view.seen_cells.end(),
                                  [&](const VoxelIndex& v) { return map.at(v) == Occupancy::kUnknown; });
  return 2 * static_cast<std::size_t>(left) < view.seen_cells.size();
}

/// Cells of a grid, some of them marked.
class MarkedCells {
 public:
  MarkedCells(const GridSpec& grid, int cell_voxels) : cell_voxels_(cell_voxels) {
    for (std::size_t axis = 0; axis < 3; ++axis) cells_[axis] = grid.size()[axis] / cell_voxels_ + 1;
    marked_.assign(
        static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]) * static_cast<std::size_t>(cells_[2]),
        false);
  }

  void mark(const mapping::VoxelBox& box) {
    visit(box, [this](std::size_t cell) { marked_[cell] = true; });
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

/// Where blocks changed, in cells of a metre or a little more, and in wide ones, which answer for most places.
class ChangedPlaces {
 public:
  ChangedPlaces(const GridSpec& grid, const std::vector<mapping::VoxelBox>& changed)
      : fine_(grid, std::max(8, static_cast<int>(std::lround(1.0 / grid.resolution_m())))),
        wide_(grid, std::max(64, static_cast<int>(std::lround(8.0 / grid.resolution_m())))) {
    for (const mapping::VoxelBox& block : changed) {
      fine_.mark(block);
      wide_.mark(block);
    }
  }

  bool any_in(const mapping::VoxelBox& box) const { return wide_.any_in(box) && fine_.any_in(box); }

 private:
  MarkedCells fine_, wide_;
};

}  // namespace

void TargetBook::look_again(Target& target) {
  target.fresh = false;
  target.searched = target.searches >= kMostSearches;
}

/// Where the map changed, what was given up may be seen now, and what was to be gained may have been seen. Places are
/// lost anywhere, where ways close: of many targets, some are asked after in each update.
void TargetBook::refresh(const planning3d::FreeSpace& space, const FrontierFinder& finder,
                         const ViewpointPlaces& places, double time_s, mapping::WorkerPool* workers) {
  time_s_ = time_s;
  const std::vector<Task> all = bequeath(finder);
  const GridSpec& grid = space.grid();
  const ChangedPlaces changed(grid, finder.changed_blocks());
  const std::size_t turns = 1 + all.size() / kAskedAfter;
  const std::size_t turn = ++refreshed_ % turns;
  mapping::for_each_index(workers, all.size(), [&](std::size_t i) {
    Target& target = *all[i].target;
    const Aabb nearby = all[i].cluster->bounds_m.inflated(kNearby_m);
    const bool changes = changed.any_in({grid.index_of(nearby.min_m), grid.index_of(nearby.max_m)});
    if (changes && target.views.empty()) look_again(target);
    target.gains_old = target.gains_old || changes;
    if (target.views.empty()) return;
    if (changes || i % turns == turn) {
      std::erase_if(target.views, [&](const Viewpoint& view) {
        return !space.traversable(view.voxel) || !places.reachable(view.voxel) ||
               (changes && outdated(space.map(), view));
      });
      if (target.views.empty()) look_again(target);
    }
    if (!target.gains_old || time_s - target.gains_time_s < kGainsKept_s) return;
    worked_out(target);
    for (Viewpoint& view : target.views) {
      view.gain_m3 = sampler_.gain_m3(space.map(), view.position_m, view.yaw_rad);
    }
  });
}

/// Takes the targets out whose clusters are gone. @returns the others
std::vector<TargetBook::Task> TargetBook::bequeath(const FrontierFinder& finder) {
  heirlooms_.clear();
  std::vector<Task> kept;
  auto cluster = finder.clusters().begin();  // both are in the order of ids
  targets_.erase_if([&](std::uint32_t id, Target& target) {
    while (cluster != finder.clusters().end() && cluster->first < id) ++cluster;
    if (cluster != finder.clusters().end() && cluster->first == id) {
      kept.push_back({&target, &cluster->second});
      return false;
    }
    if (!target.views.empty())
      heirlooms_.push_back({target.center_m, std::move(target.views), target.handed_on, target.gains_time_s});
    return true;
  });
  return kept;
}

std::vector<const TargetBook::Heirloom*> TargetBook::heirlooms_near(const FrontierCluster& cluster) const {
  std::vector<const Heirloom*> near;
  for (const Heirloom& heirloom : heirlooms_) {
    if ((heirloom.center_m - cluster.center_m).norm() < kNearby_m) near.push_back(&heirloom);
  }
  return near;
}

void TargetBook::inherit(const planning3d::FreeSpace& space, const Task& task,
                         const std::vector<const Heirloom*>& heirlooms) const {
  std::vector<Viewpoint> views;
  double gains_time_s = time_s_;
  for (const Heirloom* heirloom : heirlooms) {
    views.insert(views.end(), heirloom->views.begin(), heirloom->views.end());
    gains_time_s = std::min(gains_time_s, heirloom->gains_time_s);
  }
  if (views.empty()) return;
  task.target->views = sampler_.inherit(space, *task.cluster, views);
  if (!sampler_.config().sensor.panoramic()) return worked_out(*task.target);
  task.target->gains_time_s = gains_time_s;
  task.target->gains_old = true;
}

void TargetBook::worked_out(Target& target) const {
  target.gains_time_s = time_s_;
  target.gains_old = false;
}

/// Most clusters change by a few voxels at a time: where there is much to do, what was seen well goes on to be seen
/// from the same places.
bool TargetBook::takes_over(const planning3d::FreeSpace& space, const Task& task) const {
  const std::vector<const Heirloom*> heirlooms = heirlooms_near(*task.cluster);
  int handed_on = kHandedOn;
  for (const Heirloom* heirloom : heirlooms) handed_on = std::min(handed_on, heirloom->handed_on + 1);
  if (handed_on >= kHandedOn) return false;
  inherit(space, task, heirlooms);
  const std::vector<Viewpoint>& views = task.target->views;
  if (std::none_of(views.begin(), views.end(), [](const Viewpoint& v) { return v.seen_fraction >= kSeenWell; }))
    return false;
  task.target->handed_on = handed_on;
  return true;
}

bool TargetBook::undecided(const Target& target) { return !target.fresh || (target.views.empty() && !target.searched); }

bool TargetBook::undecided(std::uint32_t cluster) const {
  const Target* const found = targets_.find(cluster);
  return found == nullptr || undecided(*found);
}

/// What is to be looked for, and how soon.
struct TargetBook::Waiting {
  bool shallow;
  double nearest_m2;  ///< to a UAV
  std::uint32_t id;
  Task task;
  bool operator<(const Waiting& other) const {
    return std::tie(shallow, nearest_m2, id) < std::tie(other.shallow, other.nearest_m2, other.id);
  }
};

/// Of the clusters worth a visit those that are undecided. Deep ones come first: where the budget ends, the UAVs shall
/// know what is around them.
std::vector<TargetBook::Waiting> TargetBook::waiting(const FrontierFinder& finder, const ViewpointPlaces& places,
                                                     const std::function<bool(std::uint32_t)>& counts) {
  std::vector<Waiting> found;
  auto target = targets_.begin();  // both are in the order of ids
  for (const auto& [id, cluster] : finder.clusters()) {
    while (target != targets_.end() && target->first < id) ++target;
    if (target != targets_.end() && target->first == id && !undecided(target->second)) continue;
    if (!finder.worth_a_visit(cluster) || (counts && !counts(id))) continue;
    double nearest_m2 = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& at_m : places.also_m)
      nearest_m2 = std::min(nearest_m2, (cluster.center_m - at_m).squaredNorm());
    found.push_back({!finder.deep(cluster), nearest_m2, id, {nullptr, &cluster}});
  }
  for (Waiting& one : found) one.task.target = &targets_[one.id];
  return found;
}

/// Takes them out; there may be fewer.
std::vector<TargetBook::Task> TargetBook::take_first(std::vector<Waiting>& waiting, int count) {
  const auto last = waiting.begin() + std::min(std::ssize(waiting), static_cast<std::ptrdiff_t>(std::max(0, count)));
  if (last != waiting.end()) std::nth_element(waiting.begin(), last, waiting.end());
  std::vector<Task> tasks;
  for (auto one = waiting.begin(); one != last; ++one) tasks.push_back(one->task);
  waiting.erase(waiting.begin(), last);
  return tasks;
}

void TargetBook::search(const planning3d::FreeSpace& space, const ViewpointPlaces& places, const Task& task) const {
  task.target->views = sampler_.search(space, *task.cluster, places);
  worked_out(*task.target);
  task.target->searched = true;
  ++task.target->searches;
  if (!task.target->views.empty() || places.layers_m.empty()) return;
  ViewpointPlaces between = places;
  between.only_between_layers = true;
  task.target->views = sampler_.search(space, *task.cluster, between);
}

std::size_t TargetBook::look(const planning3d::FreeSpace& space, const FrontierFinder& finder,
                             const ViewpointPlaces& places, const Budget& budget,
                             const std::function<bool(std::uint32_t)>& counts, mapping::WorkerPool* workers) {
  std::vector<Waiting> searchable = waiting(finder, places, counts);
  std::vector<Waiting> unseen;
  for (const Waiting& one : searchable) {
    if (!one.task.target->fresh) unseen.push_back(one);
  }
  const bool busy = std::ssize(unseen) >= budget.samples;
  const std::vector<Task> sampled = take_first(unseen, budget.samples);
  std::size_t pending = unseen.size();
  std::erase_if(unseen, [](const Waiting& one) { return !one.task.target->views.empty(); });
  const std::vector<Task> inheriting = take_first(unseen, budget.legacies);
  mapping::for_each_index(workers, sampled.size() + inheriting.size(), [&](std::size_t i) {
    const Task& task = i < sampled.size() ? sampled[i] : inheriting[i - sampled.size()];
    task.target->center_m = task.cluster->center_m;
    if (i >= sampled.size()) return inherit(space, task, heirlooms_near(*task.cluster));
    if (!busy || !takes_over(space, task)) {
      task.target->views = sampler_.sample(space, *task.cluster, places);
      task.target->handed_on = 0;
      worked_out(*task.target);
    }
    task.target->fresh = true;
  });
  std::erase_if(searchable, [](const Waiting& one) {
    const Target& target = *one.task.target;
    return !target.fresh || !target.views.empty() || target.searched;
  });
  pending += searchable.size();
  // Whoever found nothing once hardly ever does later: one in 200 clusters in a building of twelve storeys.
  if (busy) std::erase_if(searchable, [](const Waiting& one) { return one.task.target->searches > 0; });
  const std::vector<Task> searched = take_first(searchable, budget.searches);
  pending -= searched.size();
  mapping::for_each_index(workers, searched.size(), [&](std::size_t i) { search(space, places, searched[i]); });
  return pending;
}

}  // namespace stairwell::coverage3d
