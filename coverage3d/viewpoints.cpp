#include "coverage3d/viewpoints.hpp"

#include "core/rng.hpp"
#include "core/units.hpp"
#include "coverage3d/nearest_and_random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr std::array<VoxelIndex, 6> kFaces{{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};
constexpr std::array<VoxelIndex, 8> kBeside{
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {1, 1, 0}, {-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}}};
constexpr int kRoughCells = 8;
constexpr int kGlanceCells = 10;
constexpr double kRaySlack = 1.3;       // one return in so many neighbouring voxels is enough
constexpr std::size_t kJudged = 12;     // candidates that get the full count
constexpr std::size_t kSearched = 400;  // candidates of an exhaustive search
constexpr double kSearchSteps = 25.0;   // along the reach of an exhaustive search, where the range is long
constexpr double kKeptPart = 0.7;       // of a cluster's seen cells, when a view is turned to see more besides
constexpr double kLeastSeen = 0.3;      // of what the best view sees of the cluster
constexpr double kFieldFill = 0.9;      // part of the field of view that is relied on

int distance_cells(const VoxelIndex& a, const VoxelIndex& b) {
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

/// Centre of the window of `width_rad` that holds most of the azimuths; also the middle of what it holds.
double best_window(std::vector<double> azimuths_rad, double width_rad) {
  std::sort(azimuths_rad.begin(), azimuths_rad.end());
  const std::size_t n = azimuths_rad.size();
  for (std::size_t i = 0; i < n; ++i) azimuths_rad.push_back(azimuths_rad[i] + 2.0 * kPi);
  std::size_t most = 0;
  double center = 0.0;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < n; ++begin) {
    end = std::max(end, begin);
    while (end < begin + n && azimuths_rad[end] - azimuths_rad[begin] <= width_rad) ++end;
    if (end - begin <= most) continue;
    most = end - begin;
    center = 0.5 * (azimuths_rad[begin] + azimuths_rad[end - 1]);
  }
  return wrap_angle(center);
}

/// Elevations that are relied on. Nearly all directions are told apart without the arc tangent.
class ElevationBand {
 public:
  explicit ElevationBand(const SensorModel& sensor)
      : lo_rad_(kFieldFill * sensor.elevation_lo_rad),
        hi_rad_(kFieldFill * sensor.elevation_hi_rad),
        tan_lo_(std::tan(lo_rad_)),
        tan_hi_(std::tan(hi_rad_)),
        steep_(std::max(std::abs(lo_rad_), std::abs(hi_rad_)) > kSteep_rad) {}

  bool contains(const Eigen::Vector3d& offset_m) const {
    const double across_m = std::sqrt(offset_m.x() * offset_m.x() + offset_m.y() * offset_m.y());
    const double unsure_m = 1e-9 * (across_m + std::abs(offset_m.z()));
    const double above_lo_m = offset_m.z() - across_m * tan_lo_;
    const double below_hi_m = across_m * tan_hi_ - offset_m.z();
    const double inside_m = std::min(above_lo_m, below_hi_m);
    if (!steep_ && std::abs(above_lo_m) > unsure_m && std::abs(below_hi_m) > unsure_m) return inside_m > 0.0;
    const double elevation = std::atan2(offset_m.z(), std::hypot(offset_m.x(), offset_m.y()));
    return elevation >= lo_rad_ && elevation <= hi_rad_;
  }

  /// False when nothing inside a box with these horizontal distances and heights above the sensor can be in the band.
  bool may_contain(double nearest_m, double farthest_m, double lowest_m, double highest_m) const {
    if (steep_) return true;
    return lowest_m <= tan_hi_ * (tan_hi_ > 0.0 ? farthest_m : nearest_m) &&
           highest_m >= tan_lo_ * (tan_lo_ < 0.0 ? farthest_m : nearest_m);
  }

 private:
  static constexpr double kSteep_rad = 1.5;  // beyond, tangents are too large to be compared with
  double lo_rad_, hi_rad_, tan_lo_, tan_hi_;
  bool steep_;
};

/// Whether something of a box may be in sight of a place: near enough, and not too steeply above or below it.
class BoxInSight {
 public:
  BoxInSight(const SensorModel& sensor, double sight_m, const Aabb& box)
      : band_(sensor), squared_sight_m2_(sight_m * sight_m), box_(box) {}

  bool from(const Eigen::Vector3d& at_m) const {
    const Eigen::Vector3d past_lo_m = at_m - box_.min_m;
    const Eigen::Vector3d past_hi_m = at_m - box_.max_m;
    const Eigen::Vector3d nearest_m = past_hi_m.cwiseMax(-past_lo_m).cwiseMax(0.0);
    if (nearest_m.squaredNorm() > squared_sight_m2_) return false;
    const Eigen::Vector3d farthest_m = past_lo_m.cwiseAbs().cwiseMax(past_hi_m.cwiseAbs());
    return band_.may_contain(nearest_m.head<2>().norm(), farthest_m.head<2>().norm(), -past_lo_m.z(), -past_hi_m.z());
  }

 private:
  ElevationBand band_;
  double squared_sight_m2_;
  Aabb box_;
};

std::vector<VoxelIndex> heights_voxels(const GridSpec& grid, const std::vector<double>& heights_m) {
  std::vector<VoxelIndex> found;
  found.reserve(heights_m.size());
  for (const double height_m : heights_m) found.push_back(grid.index_of(Eigen::Vector3d(0.0, 0.0, height_m)));
  return found;
}

/// Slice mode: viewpoints at the layers; while an opening is looked through, well between them.
bool height_allowed(const GridSpec& grid, const std::vector<VoxelIndex>& layers, bool between, const VoxelIndex& v) {
  if (layers.empty()) return true;
  int nearest = std::numeric_limits<int>::max();
  for (const VoxelIndex& layer : layers) nearest = std::min(nearest, std::abs(layer.z - v.z));
  return between ? nearest * grid.resolution_m() > 0.5 : nearest == 0;
}

ViewGainConfig gain_config(const ViewpointConfig& config) {
  return {config.sensor, config.box, config.gain, config.occupancy};
}

}  // namespace

ViewpointSampler::ViewpointSampler(const ViewpointConfig& config) : config_(config), gain_(gain_config(config)) {}

std::vector<ViewpointSampler::Target> ViewpointSampler::targets(const planning3d::FreeSpace& space,
                                                                const FrontierCluster& cluster, int most) const {
  std::vector<Target> found;
  const std::size_t count = std::min(cluster.cells.size(), static_cast<std::size_t>(most));
  const std::span<const VoxelIndex> sides =
      config_.planar ? std::span<const VoxelIndex>(kBeside) : std::span<const VoxelIndex>(kFaces);
  for (std::size_t i = 0; i < count; ++i) {
    const VoxelIndex cell = cluster.cells[i * cluster.cells.size() / count];
    for (std::size_t j = 0; j < sides.size(); ++j) {  // one of its unknown sides, each direction in its turn
      const VoxelIndex beyond = cell + sides[(i + j) % sides.size()];
      if (!space.grid().contains(beyond) || space.map().at(beyond) != Occupancy::kUnknown) continue;
      found.push_back({beyond, space.grid().center_of(beyond)});
      break;
    }
  }
  return found;
}

double ViewpointSampler::seen_part(const planning3d::FreeSpace& space, const Viewpoint& view,
                                   const FrontierCluster& cluster) const {
  const std::vector<Target> aims = targets(space, cluster, kGlanceCells);
  const double far_m = sight_m(space.grid());
  const double half_fov = config_.sensor.panoramic() ? kPi : 0.5 * kFieldFill * config_.sensor.azimuth_fov_rad;
  const ElevationBand band(config_.sensor);
  SightLines lines;
  std::vector<const Target*> looked_at;
  for (const Target& aim : aims) {
    const Eigen::Vector3d offset_m = aim.unknown_m - view.position_m;
    if (offset_m.norm() > far_m || !band.contains(offset_m)) continue;
    if (std::abs(wrap_angle(std::atan2(offset_m.y(), offset_m.x()) - view.yaw_rad)) > half_fov) continue;
    lines.add(view.position_m, aim.unknown_m);
    looked_at.push_back(&aim);
  }
  const std::vector<std::uint32_t>& stops = lines.follow(space.map());
  int seen = 0;
  for (std::size_t i = 0; i < stops.size(); ++i) seen += sees(space.map(), stops[i], *looked_at[i]);
  return aims.empty() ? 0.0 : static_cast<double>(seen) / static_cast<double>(aims.size());
}

double ViewpointSampler::sight_m(const GridSpec& grid) const {
  // Beyond the distance at which neighbouring rays are wider apart than voxels, much is missed.
  const SensorModel& sensor = config_.sensor;
  const double spacing_rad = sensor.azimuth_fov_rad / std::max(1, sensor.rays_azimuth);
  const double dense_m = kRaySlack * grid.resolution_m() / std::max(spacing_rad, 1e-6);
  return std::min(0.95 * sensor.max_range_m, std::max(dense_m, 0.3 * sensor.max_range_m));
}

/// Through free space; a free voxel in which a return once fell lies at a surface, and what is behind it inside.
/// @param stop  where the line to the target ends
bool ViewpointSampler::sees(const mapping::OccupancyMap& map, std::uint32_t stop, const Target& target) {
  return stop != SightLines::kNothing && map.at(std::size_t{stop}) == Occupancy::kUnknown &&
         distance_cells(map.grid().voxel(stop), target.unknown) <= 1;
}

/// Turns a view, without losing much of its cluster, to where the most unknown space comes into sight with it.
void ViewpointSampler::turn_to_most(const mapping::OccupancyMap& map, Viewpoint& view) const {
  const ViewGain::Panorama sectors = gain_.panorama(map, view.position_m);
  view.gain_m3 = gain_.in_view_m3(sectors, view.yaw_rad);
  if (config_.sensor.panoramic()) return;
  const double half_fov = 0.5 * kFieldFill * config_.sensor.azimuth_fov_rad;
  const auto cells_in_view = [&](double yaw_rad) {
    std::vector<VoxelIndex> cells;
    for (const VoxelIndex& v : view.seen_cells) {
      const Eigen::Vector3d offset_m = map.grid().center_of(v) - view.position_m;
      if (std::abs(wrap_angle(std::atan2(offset_m.y(), offset_m.x()) - yaw_rad)) <= half_fov) cells.push_back(v);
    }
    return cells;
  };
  const double seen = static_cast<double>(view.seen_cells.size());
  double best_yaw_rad = view.yaw_rad;
  for (int sector = 0; sector < ViewGain::kSectors; ++sector) {
    const double yaw_rad = wrap_angle(2.0 * kPi * sector / ViewGain::kSectors);
    const double gain = gain_.in_view_m3(sectors, yaw_rad);
    if (gain <= view.gain_m3 || static_cast<double>(cells_in_view(yaw_rad).size()) < kKeptPart * seen) continue;
    view.gain_m3 = gain;
    best_yaw_rad = yaw_rad;
  }
  if (best_yaw_rad == view.yaw_rad) return;
  view.seen_fraction *= static_cast<double>(cells_in_view(best_yaw_rad).size()) / seen;
  view.seen_cells = cells_in_view(best_yaw_rad);
  view.yaw_rad = best_yaw_rad;
}

/// Of a few of the targets, how many are seen from each candidate.
std::vector<int> ViewpointSampler::rough_counts(const mapping::OccupancyMap& map,
                                                const std::vector<VoxelIndex>& candidates,
                                                const std::vector<Target>& targets, SightLines& lines) const {
  const double far_m = sight_m(map.grid());
  const ElevationBand band(config_.sensor);
  const std::size_t few = std::min<std::size_t>(kRoughCells, targets.size());
  struct Line {
    std::size_t candidate;
    const Target* target;
  };
  std::vector<Line> looks;
  looks.reserve(few * candidates.size());
  lines.clear();
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Eigen::Vector3d from_m = map.grid().center_of(candidates[c]);
    for (std::size_t i = 0; i < few; ++i) {
      const Target& target = targets[i * targets.size() / few];
      const Eigen::Vector3d offset_m = target.unknown_m - from_m;
      if (offset_m.norm() > far_m || !band.contains(offset_m)) continue;
      lines.add(from_m, target.unknown_m);
      looks.push_back({c, &target});
    }
  }
  const std::vector<std::uint32_t>& stops = lines.follow(map);
  std::vector<int> seen(candidates.size(), 0);
  for (std::size_t i = 0; i < looks.size(); ++i) seen[looks[i].candidate] += sees(map, stops[i], *looks[i].target);
  return seen;
}

Viewpoint ViewpointSampler::judge(const mapping::OccupancyMap& map, const VoxelIndex& voxel,
                                  const std::vector<Target>& targets, SightLines& lines) const {
  Viewpoint view;
  view.voxel = voxel;
  view.position_m = map.grid().center_of(voxel);
  const double far_m = sight_m(map.grid());
  const ElevationBand band(config_.sensor);
  std::vector<const Target*> looked_at;
  lines.clear();
  for (const Target& target : targets) {
    const Eigen::Vector3d offset_m = target.unknown_m - view.position_m;
    const double distance_m = offset_m.norm();
    if (distance_m > far_m || distance_m < config_.sensor.min_range_m || !band.contains(offset_m)) continue;
    lines.add(view.position_m, target.unknown_m);
    looked_at.push_back(&target);
  }
  const std::vector<std::uint32_t>& stops = lines.follow(map);
  std::vector<VoxelIndex> firsts;
  std::vector<double> azimuths_rad;
  for (std::size_t i = 0; i < looked_at.size(); ++i) {
    if (!sees(map, stops[i], *looked_at[i])) continue;
    firsts.push_back(map.grid().voxel(stops[i]));
    const Eigen::Vector3d offset_m = looked_at[i]->unknown_m - view.position_m;
    if (!config_.sensor.panoramic()) azimuths_rad.push_back(std::atan2(offset_m.y(), offset_m.x()));
  }
  if (firsts.empty()) return view;
  if (config_.sensor.panoramic()) {
    view.seen_cells = std::move(firsts);
  } else {
    view.yaw_rad = best_window(azimuths_rad, kFieldFill * config_.sensor.azimuth_fov_rad);
    for (std::size_t i = 0; i < firsts.size(); ++i) {
      const double aside = std::abs(wrap_angle(azimuths_rad[i] - view.yaw_rad));
      if (aside <= 0.5 * config_.sensor.azimuth_fov_rad) view.seen_cells.push_back(firsts[i]);
    }
  }
  view.seen_fraction = static_cast<double>(view.seen_cells.size()) / static_cast<double>(targets.size());
  return view;
}

std::vector<Viewpoint> ViewpointSampler::best_of(const planning3d::FreeSpace& space,
                                                 const std::vector<VoxelIndex>& candidates,
                                                 const std::vector<Target>& targets,
                                                 const std::vector<double>& gains_m3) const {
  SightLines lines;
  const std::vector<int> seen = rough_counts(space.map(), candidates, targets, lines);
  std::vector<std::pair<int, std::size_t>> ranked;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (seen[i] > 0) ranked.emplace_back(-seen[i], i);
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > kJudged) {  // among equals: spread over the candidates, which are ordered by distance
    const auto equal_end = std::find_if(ranked.begin(), ranked.end(),
                                        [&](const auto& entry) { return entry.first > ranked.front().first + 1; });
    const auto good = static_cast<std::size_t>(equal_end - ranked.begin());
    std::vector<std::pair<int, std::size_t>> spread;
    const std::size_t pool = std::max(good, kJudged);
    for (std::size_t i = 0; i < kJudged; ++i) spread.push_back(ranked[i * pool / kJudged]);
    ranked = std::move(spread);
  }
  std::vector<Viewpoint> judged;
  for (const auto& [rank, i] : ranked) {
    Viewpoint view = judge(space.map(), candidates[i], targets, lines);
    if (!gains_m3.empty()) view.gain_m3 = gains_m3[i];
    if (!view.seen_cells.empty()) judged.push_back(std::move(view));
  }
  const auto drop_poor_ones = [&judged] {
    double most_seen = 0.0;
    for (const Viewpoint& view : judged) most_seen = std::max(most_seen, view.seen_fraction);
    std::erase_if(judged, [&](const Viewpoint& view) { return view.seen_fraction < kLeastSeen * most_seen; });
  };
  if (config_.sensor.panoramic()) drop_poor_ones();  // turning changes nothing of what is seen
  if (gains_m3.empty())
    for (Viewpoint& view : judged) turn_to_most(space.map(), view);
  if (!config_.sensor.panoramic()) drop_poor_ones();
  std::stable_sort(judged.begin(), judged.end(),
                   [](const Viewpoint& a, const Viewpoint& b) { return a.gain_m3 > b.gain_m3; });
  std::vector<Viewpoint> kept;
  for (Viewpoint& view : judged) {
    if (kept.size() >= static_cast<std::size_t>(config_.keep)) break;
    if (!kept.empty() && view.gain_m3 < 0.3 * kept.front().gain_m3) break;
    const bool crowded = std::any_of(kept.begin(), kept.end(), [&](const Viewpoint& other) {
      return (other.position_m - view.position_m).norm() < 0.5;
    });
    if (crowded) continue;
    kept.push_back(std::move(view));
  }
  return kept;
}

std::vector<Viewpoint> ViewpointSampler::sample(const planning3d::FreeSpace& space, const FrontierCluster& cluster,
                                                const ViewpointPlaces& places) const {
  const std::vector<Target> aims = targets(space, cluster, config_.max_cells);
  if (aims.empty()) return {};
  const GridSpec& grid = space.grid();
  const std::vector<VoxelIndex> layers = heights_voxels(grid, places.layers_m);
  std::vector<double> heights_m;
  if (layers.empty() || places.only_between_layers) {
    for (const double up_m : {0.0, 0.8, -0.8, 1.6, -1.6}) heights_m.push_back(cluster.center_m.z() + up_m);
  } else {
    for (const double layer_m : places.layers_m)
      if (std::abs(layer_m - cluster.center_m.z()) < config_.range_fraction * config_.sensor.max_range_m)
        heights_m.push_back(layer_m);
  }
  std::vector<VoxelIndex> candidates;
  const auto offer = [&](const VoxelIndex& v) {
    if (grid.contains(v) && space.traversable(v) && height_allowed(grid, layers, places.only_between_layers, v) &&
        places.reachable(v))
      candidates.push_back(v);
  };
  const double farthest_m = config_.range_fraction * config_.sensor.max_range_m;
  constexpr int kAzimuths = 12;
  int ring = 0;
  for (double radius_m = config_.nearest_m; radius_m <= farthest_m; radius_m *= 1.7, ++ring)
    for (int i = 0; i < kAzimuths; ++i) {
      const double azimuth = 2.0 * kPi * (i + 0.5 * (ring % 2)) / kAzimuths;
      for (const double height_m : heights_m)
        offer(grid.index_of({cluster.center_m.x() + radius_m * std::cos(azimuth),
                             cluster.center_m.y() + radius_m * std::sin(azimuth), height_m}));
    }
  for (const Eigen::Vector3d& position_m : places.also_m)
    if ((position_m - cluster.center_m).norm() < farthest_m) offer(grid.index_of(position_m));
  return best_of(space, candidates, aims);
}

std::vector<Viewpoint> ViewpointSampler::inherit(const planning3d::FreeSpace& space, const FrontierCluster& cluster,
                                                 const std::vector<Viewpoint>& views) const {
  const std::vector<Target> aims = targets(space, cluster, config_.max_cells);
  std::vector<VoxelIndex> places;
  std::vector<double> gains_m3;
  for (const Viewpoint& view : views) {
    if (!space.traversable(view.voxel)) continue;
    places.push_back(view.voxel);
    if (config_.sensor.panoramic()) gains_m3.push_back(view.gain_m3);  // from there; others may have to turn
  }
  return aims.empty() ? std::vector<Viewpoint>{} : best_of(space, places, aims, gains_m3);
}

std::vector<Viewpoint> ViewpointSampler::search(const planning3d::FreeSpace& space, const FrontierCluster& cluster,
                                                const ViewpointPlaces& places) const {
  const std::vector<Target> aims = targets(space, cluster, config_.max_cells);
  if (aims.empty()) return {};
  const GridSpec& grid = space.grid();
  const std::vector<VoxelIndex> layers = heights_voxels(grid, places.layers_m);
  const double reach_m = config_.range_fraction * config_.sensor.max_range_m;
  const double step_m = std::max(0.2, reach_m / kSearchSteps);
  const int step = std::max(1, static_cast<int>(std::lround(step_m / grid.resolution_m())));
  const VoxelIndex lo = grid.index_of(cluster.bounds_m.min_m - Eigen::Vector3d::Constant(reach_m));
  const VoxelIndex hi = grid.index_of(cluster.bounds_m.max_m + Eigen::Vector3d::Constant(reach_m));
  // Targets are unknown voxels beside the cluster's.
  const BoxInSight in_sight(config_.sensor, sight_m(grid), cluster.bounds_m.inflated(1.5 * grid.resolution_m()));
  const std::vector<std::uint16_t>& squared = space.blocked_distance().data();
  const int least = space.min_squared_cells();
  std::vector<VoxelIndex> all;
  const int z_step = layers.empty() ? step : 1;
  for (int z = std::max(lo.z, 0); z <= std::min(hi.z, grid.size()[2] - 1); z += z_step) {
    if (z < space.lo().z || z > space.hi().z) continue;
    if (!height_allowed(grid, layers, places.only_between_layers, {0, 0, z})) continue;
    for (int y = std::max(lo.y, 0); y <= std::min(hi.y, grid.size()[1] - 1); y += step) {
      if (y < space.lo().y || y > space.hi().y) continue;
      const std::uint16_t* const row = squared.data() + grid.linear({0, y, z});  // FreeSpace::traversable, row by row
      for (int x = std::max(lo.x, 0); x <= std::min(hi.x, grid.size()[0] - 1); x += step)
        if (row[x] >= least && x >= space.lo().x && x <= space.hi().x && in_sight.from(grid.center_of({x, y, z})) &&
            places.reachable({x, y, z}))
          all.push_back({x, y, z});
    }
  }
  if (all.size() > kSearched) {  // half of them the nearest, half from anywhere
    Rng rng = make_rng(config_.seed + cluster.id, "viewpoint search");
    all = nearest_and_random(grid, cluster.center_m, all, kSearched / 2, kSearched, rng);
  }
  return best_of(space, all, aims);
}

}  // namespace stairwell::coverage3d
