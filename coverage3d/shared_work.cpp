/// What a frontier strategy knows of UAVs that do not share its map.
#include "coverage3d/frontier_strategy.hpp"
#include "coverage3d/voxel_walk.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr double kTrusted_m = 6.0;    // what a UAV has passed nearer than this it has probably seen, ...
constexpr double kBlind_m = 2.0;      // ... with no more than so much unknown space between, which may hold a wall
constexpr double kSureBlind_m = 0.3;  // hardly any unknown space between, and nothing solid: it has surely seen it
constexpr std::size_t kSampled = 6;   // voxels of a cluster that are asked for

enum class Sight { kNone, kProbable, kSure };

/// Whether somebody there would have seen it, as far as this map can tell.
Sight sight_of(const mapping::OccupancyMap& map, const SensorModel& sensor, const Eigen::Vector3d& from_m,
               const Eigen::Vector3d& target_m) {
  const Eigen::Vector3d offset_m = target_m - from_m;
  const double up_rad = std::atan2(offset_m.z(), offset_m.head<2>().norm());
  if (offset_m.norm() > std::min(kTrusted_m, sensor.max_range_m)) return Sight::kNone;
  if (up_rad < sensor.elevation_lo_rad || up_rad > sensor.elevation_hi_rad) return Sight::kNone;
  double blind_m = 0.0;
  const bool open = walk_voxels(map.grid(), from_m, target_m, [&](const VoxelIndex& v) {
    const Occupancy there = map.at(v);
    if (there == Occupancy::kUnknown) blind_m += map.grid().resolution_m();
    return there != Occupancy::kOccupied && blind_m <= kBlind_m;
  });
  if (!open) return Sight::kNone;
  return blind_m <= kSureBlind_m && sensor.panoramic() ? Sight::kSure : Sight::kProbable;
}

/// How surely all of the cluster has been seen from these places.
Sight sight_of(const mapping::OccupancyMap& map, const SensorModel& sensor, const FrontierCluster& cluster,
               const std::vector<Eigen::Vector3d>& passed_m) {
  Sight least = Sight::kSure;
  const std::size_t count = std::min(kSampled, cluster.cells.size());
  for (std::size_t i = 0; i < count && least != Sight::kNone; ++i) {
    const Eigen::Vector3d cell_m = map.grid().center_of(cluster.cells[i * cluster.cells.size() / count]);
    Sight best = Sight::kNone;
    for (const Eigen::Vector3d& from_m : passed_m) best = std::max(best, sight_of(map, sensor, from_m, cell_m));
    least = std::min(least, best);
  }
  return least;
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

/// What absent UAVs have surely seen is done; what they have probably seen waits until nothing else is left: a meeting
/// may settle it before.
std::vector<FrontierStrategy::Stop> FrontierStrategy::left_by_others(const planning3d::FreeSpace& space,
                                                                     const AssignmentRequest& request,
                                                                     std::vector<Stop> stops) const {
  if (request.passed_m.empty()) return stops;
  std::vector<Stop> left;
  std::vector<Stop> doubtful;
  for (Stop& stop : stops) {
    const Sight sight = sight_of(space.map(), config_.sensor, *stop.cluster, request.passed_m);
    if (sight == Sight::kSure) continue;
    (sight == Sight::kNone ? left : doubtful).push_back(std::move(stop));
  }
  return left.empty() ? doubtful : left;
}

}  // namespace stairwell::coverage3d
