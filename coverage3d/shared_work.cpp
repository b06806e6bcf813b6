/// What a frontier strategy knows of UAVs that do not share its map.
#include "coverage3d/frontier_strategy.hpp"
#include "coverage3d/voxel_walk.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr double kBlind_m = 2.0;     // of unknown space, which may hold a wall, between a UAV and what it has seen
constexpr std::size_t kSampled = 6;  // voxels of a cluster that are asked for

constexpr double kLinkStep_m = 0.5;
constexpr double kLinkStepsPerPart = 5.0;
constexpr double kDone = 0.25;      // a part of a cell is done when less of it is unknown and can be got at
constexpr double kClaimed_m = 7.5;  // an open part farther than this from all that anybody knows to visit is done
constexpr double kAsGood_s = 1.5;   // ways to the own cells that are no more than this longer than the best

/// @param uav  may be nobody
bool shares_map(const AssignmentRequest& request, std::size_t uav) {
  return uav < request.uavs.size() && request.uavs[uav].shares_map;
}

/// Whether somebody there has probably seen it, as far as this map can tell: the sensor reaches it, and no wall is known
/// between, nor unknown space that may well hold one.
bool seen_from(const mapping::OccupancyMap& map, const SensorModel& sensor, const Eigen::Vector3d& from_m,
               const Eigen::Vector3d& target_m) {
  const Eigen::Vector3d offset_m = target_m - from_m;
  const double up_rad = std::atan2(offset_m.z(), offset_m.head<2>().norm());
  if (offset_m.norm() > sensor.max_range_m) return false;
  if (up_rad < sensor.elevation_lo_rad || up_rad > sensor.elevation_hi_rad) return false;
  double blind_m = 0.0;
  return walk_voxels(map.grid(), from_m, target_m, [&](const VoxelIndex& v) {
    const Occupancy there = map.at(v);
    if (there == Occupancy::kUnknown) blind_m += map.grid().resolution_m();
    return there != Occupancy::kOccupied && blind_m <= kBlind_m;
  });
}

/// Whether all of the cluster has probably been seen from these places.
bool seen_from(const mapping::OccupancyMap& map, const SensorModel& sensor, const FrontierCluster& cluster,
               const std::vector<Eigen::Vector3d>& passed_m) {
  const std::size_t count = std::min(kSampled, cluster.cells.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d cell_m = map.grid().center_of(cluster.cells[i * cluster.cells.size() / count]);
    if (std::ranges::none_of(passed_m, [&](const auto& from_m) { return seen_from(map, sensor, from_m, cell_m); }))
      return false;
  }
  return true;
}

/// Share of each part of the board that is unknown and linked, through the unknown, with one of these places; on a
/// coarse lattice in `box`.
std::vector<double> linked_unknown(const mapping::OccupancyMap& map, const Aabb& box, const TaskBoard& tasks,
                                   const std::vector<Eigen::Vector3d>& places_m) {
  const GridSpec lattice(box, std::max(kLinkStep_m, tasks.part_edge_m().maxCoeff() / kLinkStepsPerPart));
  std::vector<bool> reached(lattice.voxel_count(), false);
  std::vector<VoxelIndex> queue;
  const auto enter = [&](const Eigen::Vector3d& from_m, const VoxelIndex& v) {
    if (!lattice.contains(v) || reached[lattice.linear(v)]) return;
    const Eigen::Vector3d to_m = lattice.center_of(v);
    const VoxelIndex at = map.grid().index_of(to_m);
    if (!map.grid().contains(at) || map.at(at) != Occupancy::kUnknown) return;
    if (!walk_voxels(map.grid(), from_m, to_m, [&](const VoxelIndex& w) { return map.at(w) != Occupancy::kOccupied; }))
      return;  // not through walls
    reached[lattice.linear(v)] = true;
    queue.push_back(v);
  };
  for (const Eigen::Vector3d& place_m : places_m) {
    for (int n = 0; n < 27; ++n)
      enter(place_m, lattice.index_of(place_m) + VoxelIndex{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1});
  }
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const VoxelIndex v = queue[i];
    const Eigen::Vector3d at_m = lattice.center_of(v);
    for (const int side : {-1, 1}) {
      enter(at_m, v + VoxelIndex{side, 0, 0});
      enter(at_m, v + VoxelIndex{0, side, 0});
      enter(at_m, v + VoxelIndex{0, 0, side});
    }
  }
  std::vector<double> linked(tasks.parts(), 0.0);
  std::vector<double> all(tasks.parts(), 1e-9);
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const std::size_t part = tasks.part_at(lattice.center_of(lattice.voxel(i)));
    all[part] += 1.0;
    linked[part] += reached[i] ? 1.0 : 0.0;
  }
  for (std::size_t part = 0; part < linked.size(); ++part) linked[part] /= all[part];
  return linked;
}

}  // namespace

std::unique_ptr<CoverageStrategy> FrontierStrategy::copy_to(std::unique_ptr<FrontierStrategy> copy) const {
  copy->finder_ = finder_;
  copy->layers_ = layers_;
  copy->finish_ = finish_;
  copy->book_ = book_;
  copy->blacklist_ = blacklist_;
  copy->given_ = given_;
  copy->start_height_m_ = start_height_m_;
  return copy;
}

bool FrontierStrategy::answers_for(const AssignmentRequest& request, std::size_t part) {
  return request.tasks->part_open(part) && shares_map(request, request.tasks->owner(request.tasks->cell_of(part)));
}

/// Parts of cells that hold nothing to visit and hardly anything unknown that something to visit leads to, whoever
/// answers for them.
void FrontierStrategy::close_done_parts(const planning3d::FreeSpace& space, const AssignmentRequest& request,
                                        const std::vector<Stop>& stops, const std::vector<Stop>& unseen) const {
  TaskBoard& tasks = *request.tasks;
  std::vector<bool> busy(tasks.parts(), false);
  std::vector<Eigen::Vector3d> leads_m;
  const auto lead = [&](const FrontierCluster& cluster) {
    for (const VoxelIndex& v : cluster.cells) leads_m.push_back(space.grid().center_of(v));
  };
  for (const Stop& stop : stops) lead(*stop.cluster);
  for (const Stop& stop : unseen) busy[tasks.part_at(stop.cluster->center_m)] = true;
  for (const auto& [id, cluster] : finder_->clusters()) {
    const bool counts = finish_ ? finish_->counts(id) : finder_->worth_a_visit(cluster);
    if (!counts || !book_.undecided(id)) continue;
    lead(cluster);
    busy[tasks.part_at(cluster.center_m)] = true;
  }
  const std::vector<double> linked = linked_unknown(space.map(), finder_->config().box, tasks, leads_m);
  const auto speaker = std::ranges::find_if(request.uavs, &UavView::shares_map) - request.uavs.begin();
  for (std::size_t part = 0; part < tasks.parts(); ++part) {
    if (!busy[part] && linked[part] < kDone) tasks.close_part(part, static_cast<std::size_t>(speaker));
    if (busy[part] && shares_map(request, tasks.closer(part))) tasks.reopen_part(part);
  }
  for (std::size_t uav = 0; uav < request.uavs.size(); ++uav)
    if (request.uavs[uav].shares_map) tasks.claim(uav, busy);
}

/// Those of the stops that lead soonest to cells which the UAVs that share this map answer for and where somebody
/// knows of something to visit.
std::vector<FrontierStrategy::Stop> FrontierStrategy::leading_stops(const AssignmentRequest& request, const Crew& crew,
                                                                    const std::vector<Stop>& stops) const {
  const TaskBoard& tasks = *request.tasks;
  std::vector<Eigen::Vector3d> wanted_m;
  for (std::size_t part = 0; part < tasks.parts(); ++part) {
    if (answers_for(request, part) && tasks.claimed_near(part, kClaimed_m))
      wanted_m.push_back(tasks.part_center_m(part));
  }
  std::vector<Stop> soonest;
  if (wanted_m.empty() || stops.empty()) return soonest;
  std::vector<double> times_s;
  for (const Stop& stop : stops) {
    double beyond_m = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& center_m : wanted_m)
      beyond_m = std::min(beyond_m, (center_m - stop.cluster->center_m).norm());
    times_s.push_back(soonest_s(crew, stop.pose()) + beyond_m / config_.limits.speed_mps);
  }
  const double best_s = *std::ranges::min_element(times_s);
  for (std::size_t i = 0; i < stops.size() && std::isfinite(best_s); ++i)
    if (times_s[i] <= best_s + kAsGood_s) soonest.push_back(stops[i]);
  return soonest;
}

/// What the UAVs that share this map have to visit: of what absent ones have not seen what nobody has said is done, or
/// else what leads to their cells; where absent ones have seen all, the way there leads through it.
std::vector<FrontierStrategy::Stop> FrontierStrategy::own_stops(const AssignmentRequest& request, const Crew& crew,
                                                                const std::vector<Stop>& stops,
                                                                const std::vector<Stop>& unseen) const {
  std::vector<Stop> own;
  for (const Stop& stop : unseen) {
    if (request.tasks->part_open(request.tasks->part_at(stop.cluster->center_m))) own.push_back(stop);
  }
  if (own.empty()) own = leading_stops(request, crew, unseen);
  if (own.empty()) own = leading_stops(request, crew, stops);
  return own;
}

/// Somebody who shares this map and has nothing left takes cells of others.
bool FrontierStrategy::take_over(const AssignmentRequest& request) {
  std::vector<TaskBoard::Worker> others;
  for (std::size_t i = 0; i < request.uavs.size(); ++i) {
    const UavView& uav = request.uavs[i];
    if (!uav.shares_map) others.push_back({i, uav.goal ? uav.goal->position_m : uav.position_m});
  }
  for (std::size_t i = 0; i < request.uavs.size(); ++i) {
    const UavView& uav = request.uavs[i];
    if (uav.shares_map && uav.wants_goal && request.tasks->take_over({i, uav.position_m}, others)) return true;
  }
  return false;
}

/// The stops that are for the UAVs that share this map. What absent ones have seen is no reason to fly: they visit what
/// they find behind it.
std::vector<FrontierStrategy::Stop> FrontierStrategy::own_work(const planning3d::FreeSpace& space,
                                                               const AssignmentRequest& request, const Crew& crew,
                                                               std::vector<Stop> stops) const {
  if (request.tasks == nullptr) return stops;
  std::vector<Stop> unseen;
  for (const Stop& stop : stops) {
    if (!seen_from(space.map(), config_.sensor, *stop.cluster, request.passed_m)) unseen.push_back(stop);
  }
  close_done_parts(space, request, stops, unseen);
  if (std::ranges::all_of(request.uavs, &UavView::shares_map)) return stops;
  std::vector<Stop> work = own_stops(request, crew, stops, unseen);
  if (work.empty() && take_over(request)) work = own_stops(request, crew, stops, unseen);
  return work;
}

}  // namespace stairwell::coverage3d
