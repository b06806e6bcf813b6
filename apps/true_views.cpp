#include "apps/true_views.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "planning3d/travel_costs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace stairwell::apps {

namespace {

constexpr double kMostPlaces = 2500.0;
constexpr double kLeastStep_m = 0.4;
constexpr std::size_t kMostTargets = 6000;
constexpr double kInVoxel = 0.9;  // of its edge: a return this far before the centre still falls into the voxel

VoxelIndex cell_neighbour(const VoxelIndex& v, int n) { return v + VoxelIndex{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}; }

std::vector<VoxelIndex> sample_targets(const GridSpec& grid, const std::vector<std::uint8_t>& explorable) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < explorable.size(); ++i)
    if (explorable[i] != 0) all.push_back(i);
  const std::size_t wanted = std::min(all.size(), kMostTargets);
  Rng rng = make_rng(1, "bound/targets");
  std::vector<VoxelIndex> targets;
  for (std::size_t i = 0; i < wanted; ++i) {
    const auto left = all.size() - i;
    std::swap(all[i], all[i + std::min(left - 1, static_cast<std::size_t>(rng.uniform() * static_cast<double>(left)))]);
  }
  all.resize(wanted);
  std::sort(all.begin(), all.end());  // neighbouring rays are cast together
  for (const std::size_t i : all) targets.push_back(grid.voxel(i));
  return targets;
}

std::uint32_t yaws_that_see(const SensorModel& sensor, int yaws, const Eigen::Vector3d& offset_m) {
  std::uint32_t mask = 0;
  for (int yaw = 0; yaw < yaws; ++yaw) {
    const double angle = 2.0 * kPi * yaw / yaws;
    const Eigen::Vector3d in_sensor_m(std::cos(angle) * offset_m.x() + std::sin(angle) * offset_m.y(),
                                      -std::sin(angle) * offset_m.x() + std::cos(angle) * offset_m.y(), offset_m.z());
    if (sensor.sees(in_sensor_m)) mask |= 1u << yaw;
  }
  return mask;
}

}  // namespace

mapping::OccupancyMap fully_known_map(const Simulation& simulation, const std::vector<std::uint8_t>& reachable) {
  const sim3d::GroundTruth& truth = simulation.truth();
  const GridSpec& grid = truth.grid();
  std::vector<std::uint8_t> open = reachable;
  std::vector<VoxelIndex> front;
  for (std::size_t i = 0; i < open.size(); ++i)
    if (open[i] != 0) front.push_back(grid.voxel(i));
  while (!front.empty()) {
    const VoxelIndex from = front.back();
    front.pop_back();
    for (const VoxelIndex& step : {VoxelIndex{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
      const VoxelIndex to = from + step;
      if (!grid.contains(to) || open[grid.linear(to)] != 0 || truth.at(to) == sim3d::TruthClass::kSurface) continue;
      // Between two free voxels there may be a surface only where one of them has it on a face.
      const bool clear = truth.at(to) == sim3d::TruthClass::kFree && truth.at(from) == sim3d::TruthClass::kFree;
      const Eigen::Vector3f direction(static_cast<float>(step.x), static_cast<float>(step.y),
                                      static_cast<float>(step.z));
      if (!clear && simulation.caster().occluded(grid.center_of(from).cast<float>(), direction,
                                                 static_cast<float>(grid.resolution_m())))
        continue;
      open[grid.linear(to)] = 1;
      front.push_back(to);
    }
  }
  mapping::OccupancyMap map(grid, simulation.config().fleet.occupancy);
  for (std::size_t i = 0; i < open.size(); ++i) map.update(grid.voxel(i), open[i] == 0);
  return map;
}

double TrueViews::Pose::yaw_rad() const { return wrap_angle(2.0 * kPi * yaw / kYaws); }

TrueViews::TrueViews(const Simulation& simulation, const planning3d::FreeSpace& space,
                     const std::vector<std::uint8_t>& explorable)
    : yaws_(simulation.config().fleet.sensor.panoramic() ? 1 : kYaws) {
  find_places(space, simulation.airborne_starts_m());
  const std::vector<VoxelIndex> targets = sample_targets(space.grid(), explorable);
  target_count_ = targets.size();
  look_around(simulation, targets);
}

void TrueViews::find_places(const planning3d::FreeSpace& space, const std::vector<Eigen::Vector3d>& starts_m) {
  const GridSpec& grid = space.grid();
  std::vector<planning3d::TravelCosts> costs(starts_m.size());
  for (std::size_t k = 0; k < starts_m.size(); ++k)
    costs[k].compute(space, starts_m[k], planning3d::MotionRule::volume());
  std::vector<VoxelIndex> there;
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const auto gets_to = [&](const planning3d::TravelCosts& c) { return std::isfinite(c.distance_m(v)); };
    if (space.traversable(v) && std::any_of(costs.begin(), costs.end(), gets_to)) there.push_back(v);
  }
  if (there.empty()) throw InputError("no start leads to free space: move the starts");
  const double volume_m3 = static_cast<double>(there.size()) * grid.voxel_volume_m3();
  step_m_ = std::max({kLeastStep_m, grid.resolution_m(), std::cbrt(volume_m3 / kMostPlaces)});
  cells_ = GridSpec(grid.box(), step_m_);
  std::vector<std::int64_t> best(cells_.voxel_count(), -1);
  for (std::size_t i = 0; i < there.size(); ++i) {  // the most open place of each cell
    const VoxelIndex cell = cells_.index_of(grid.center_of(there[i]));
    std::int64_t& chosen = best[cells_.linear(cell)];
    const auto& field = space.blocked_distance();
    if (chosen < 0 || field.squared_cells(there[i]) > field.squared_cells(there[static_cast<std::size_t>(chosen)]))
      chosen = static_cast<std::int64_t>(i);
  }
  places_in_.resize(cells_.voxel_count());
  for (std::size_t cell = 0; cell < best.size(); ++cell) {
    if (best[cell] < 0) continue;
    places_in_[cell].push_back(static_cast<std::uint32_t>(place_m_.size()));
    place_m_.push_back(grid.center_of(there[static_cast<std::size_t>(best[cell])]));
  }
}

void TrueViews::look_around(const Simulation& simulation, const std::vector<VoxelIndex>& targets) {
  const sim3d::GroundTruth& truth = simulation.truth();
  const SensorModel& sensor = simulation.config().fleet.sensor;
  const double resolution_m = truth.grid().resolution_m();
  sights_.resize(place_m_.size());
  std::vector<Sight> in_view;
  std::vector<Eigen::Vector3f> directions;
  std::vector<double> away_m;
  std::vector<float> hit_m;
  for (std::size_t place = 0; place < place_m_.size(); ++place) {
    in_view.clear();
    directions.clear();
    away_m.clear();
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const Eigen::Vector3d offset_m = truth.grid().center_of(targets[i]) - place_m_[place];
      if (offset_m.squaredNorm() > sensor.max_range_m * sensor.max_range_m) continue;
      const std::uint32_t yaws = yaws_that_see(sensor, yaws_, offset_m);
      if (yaws == 0) continue;
      in_view.push_back({static_cast<std::uint32_t>(i), yaws});
      away_m.push_back(offset_m.norm());
      directions.push_back((offset_m / away_m.back()).cast<float>());
    }
    hit_m.resize(directions.size());
    simulation.caster().cast_from(place_m_[place].cast<float>(), directions, static_cast<float>(sensor.max_range_m),
                                  hit_m);
    for (std::size_t i = 0; i < in_view.size(); ++i) {
      const bool free = truth.at(targets[in_view[i].target]) == sim3d::TruthClass::kFree;
      if (static_cast<double>(hit_m[i]) >= away_m[i] - (free ? 0.0 : kInVoxel * resolution_m))
        sights_[place].push_back(in_view[i]);
    }
  }
}

std::size_t TrueViews::place_near(const Eigen::Vector3d& at_m) const {
  const VoxelIndex cell = cells_.index_of(at_m);
  std::size_t nearest = 0;
  double nearest_m2 = std::numeric_limits<double>::infinity();
  for (int n = 0; n < 27; ++n) {
    const VoxelIndex v = cell_neighbour(cell, n);
    if (!cells_.contains(v)) continue;
    for (const std::uint32_t place : places_in_[cells_.linear(v)]) {
      const double m2 = (place_m_[place] - at_m).squaredNorm();
      if (m2 >= nearest_m2) continue;
      nearest_m2 = m2;
      nearest = place;
    }
  }
  return nearest;
}

int TrueViews::yaw_step(double yaw_rad) const {
  const long step = std::lround(yaw_rad / (2.0 * kPi) * yaws_);
  return static_cast<int>(((step % yaws_) + yaws_) % yaws_);
}

std::vector<std::size_t> TrueViews::beside(std::size_t place) const {
  std::vector<std::size_t> found;
  const VoxelIndex cell = cells_.index_of(place_m_[place]);
  for (int n = 0; n < 27; ++n) {
    const VoxelIndex v = cell_neighbour(cell, n);
    if (n == 13 || !cells_.contains(v)) continue;
    for (const std::uint32_t other : places_in_[cells_.linear(v)]) found.push_back(other);
  }
  return found;
}

std::vector<TrueViews::Pose> cover_greedily(const TrueViews& views, double share) {
  std::vector<std::uint8_t> seen(views.targets(), 0);
  const auto best_yaw = [&](std::size_t place) {
    std::vector<std::size_t> gain(static_cast<std::size_t>(views.yaws()), 0);
    for (const TrueViews::Sight& sight : views.sights(place))
      if (seen[sight.target] == 0)
        for (std::size_t yaw = 0; yaw < gain.size(); ++yaw) gain[yaw] += sight.yaws >> yaw & 1u;
    const auto most = std::max_element(gain.begin(), gain.end());
    return std::pair(*most, static_cast<int>(most - gain.begin()));
  };
  // Gains only fall: what was counted once is an upper bound from then on.
  std::priority_queue<std::pair<std::size_t, std::size_t>> queue;
  for (std::size_t place = 0; place < views.places(); ++place) queue.emplace(best_yaw(place).first, place);
  std::vector<TrueViews::Pose> chosen;
  std::size_t count = 0;
  while (static_cast<double>(count) < share * static_cast<double>(views.targets()) && !queue.empty()) {
    const std::size_t place = queue.top().second;
    queue.pop();
    const auto [gain, yaw] = best_yaw(place);
    if (gain == 0) continue;
    if (!queue.empty() && gain < queue.top().first) {
      queue.emplace(gain, place);
      continue;
    }
    chosen.push_back({place, yaw});
    for (const TrueViews::Sight& sight : views.sights(place)) {
      if ((sight.yaws >> yaw & 1u) == 0 || seen[sight.target] != 0) continue;
      seen[sight.target] = 1;
      ++count;
    }
    queue.emplace(gain, place);  // another yaw of the same place may still show much
  }
  return chosen;
}

}  // namespace stairwell::apps
