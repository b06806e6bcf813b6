#include "apps/true_views.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "planning3d/travel_costs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <queue>
#include <tuple>
#include <utility>

namespace stairwell::apps {

namespace {

constexpr double kMostPlaces = 2500.0;
constexpr double kLeastStep_m = 0.4;
constexpr std::size_t kMostTargets = 8192;
constexpr double kNearShare = 0.4;     // of the places' step: edge of the cells that stand for a place
constexpr unsigned kCurveBits = 3;     // of a voxel's coordinates that the order of targets does not look at
constexpr double kOnSurface_m = 2e-3;  // a return this far before the point is of the point's surface

VoxelIndex cell_neighbour(const VoxelIndex& v, int n) { return v + VoxelIndex{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}; }

/// Along a curve that stays in one part of the plane for long (Morton 1966): what is seen together lies together.
std::uint64_t along_curve(const VoxelIndex& v) {
  std::uint64_t place = 0;
  for (unsigned bit = 0; bit < 12; ++bit) {
    place |= static_cast<std::uint64_t>(v.x >> (bit + kCurveBits) & 1) << (2 * bit);
    place |= static_cast<std::uint64_t>(v.y >> (bit + kCurveBits) & 1) << (2 * bit + 1);
  }
  return place;
}

/// One of each run of as many explorable voxels, so that all parts of the world have their share.
std::vector<VoxelIndex> sample_targets(const GridSpec& grid, const std::vector<std::uint8_t>& explorable) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < explorable.size(); ++i)
    if (explorable[i] != 0) all.push_back(i);
  const std::size_t wanted = std::min(all.size(), kMostTargets);
  Rng rng = make_rng(1, "bound/targets");
  std::vector<VoxelIndex> targets;
  for (std::size_t i = 0; i < wanted; ++i) {
    const std::size_t first = i * all.size() / wanted;
    const std::size_t run = (i + 1) * all.size() / wanted - first;
    const auto within = static_cast<std::size_t>(rng.uniform() * static_cast<double>(run));
    targets.push_back(grid.voxel(all[first + std::min(within, run - 1)]));
  }
  std::ranges::sort(targets, {}, [](const VoxelIndex& v) { return std::tuple(along_curve(v), v.z, v.y, v.x); });
  return targets;
}

/// A point of a target to look at: its voxel is known when it is in sight.
struct Aim {
  std::size_t target;
  Eigen::Vector3d point_m;
};

/// The middle of each voxel, and where a surface passes through it or lies on a face of it, a point of that surface.
std::vector<Aim> aims_at(const Simulation& simulation, const std::vector<VoxelIndex>& targets) {
  const sim3d::GroundTruth& truth = simulation.truth();
  const double reach_m = 0.5 * truth.grid().resolution_m() + truth.face_tolerance_m();
  std::vector<Aim> aims;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const Eigen::Vector3d centre_m = truth.grid().center_of(targets[i]);
    aims.push_back({i, centre_m});
    if (truth.at(targets[i]) == sim3d::TruthClass::kFree) continue;
    for (int side = 0; side < 6; ++side) {
      const Eigen::Vector3d direction = (side % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(side / 2);
      const auto hit =
          simulation.caster().cast(centre_m.cast<float>(), direction.cast<float>(), static_cast<float>(reach_m));
      if (std::isfinite(hit.distance_m))
        aims.push_back({i, centre_m + static_cast<double>(hit.distance_m) * direction});
    }
  }
  return aims;
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

double TrueViews::yaw_rad(int yaw) { return wrap_angle(2.0 * kPi * yaw / kYaws); }

TrueViews::TrueViews(const Simulation& simulation, const planning3d::FreeSpace& space,
                     const std::vector<std::uint8_t>& explorable)
    : yaws_(simulation.config().fleet.sensor.panoramic() ? 1 : kYaws), grid_(space.grid()) {
  find_places(space, simulation.airborne_starts_m());
  assign_places(simulation.caster());
  targets_ = sample_targets(space.grid(), explorable);
  look_around(simulation);
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
  const double step_m = std::max({kLeastStep_m, grid.resolution_m(), std::cbrt(volume_m3 / kMostPlaces)});
  cells_ = GridSpec(grid.box(), step_m);
  near_cells_ = GridSpec(grid.box(), kNearShare * step_m);
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

void TrueViews::assign_places(const sim3d::RayCaster& caster) {
  around_.assign(near_cells_.voxel_count(), {});
  std::vector<std::pair<double, std::uint32_t>> near;
  for (std::size_t i = 0; i < around_.size(); ++i) {
    const Eigen::Vector3d at_m = near_cells_.center_of(near_cells_.voxel(i));
    const VoxelIndex cell = cells_.index_of(at_m);
    near.clear();
    for (int n = 0; n < 27; ++n) {
      const VoxelIndex v = cell_neighbour(cell, n);
      if (!cells_.contains(v)) continue;
      for (const std::uint32_t place : places_in_[cells_.linear(v)])
        near.emplace_back((place_m_[place] - at_m).norm(), place);
    }
    if (near.empty()) continue;
    std::ranges::sort(near);
    std::erase_if(near, [&](const auto& entry) {
      const Eigen::Vector3d direction = (place_m_[entry.second] - at_m) / std::max(entry.first, 1e-9);
      return entry != near.front() &&
             caster.occluded(at_m.cast<float>(), direction.cast<float>(), static_cast<float>(entry.first));
    });
    const auto offset_m = [&](const auto& entry) { return Eigen::Vector3d(place_m_[entry.second] - at_m); };
    const auto opposite = std::ranges::find_if(
        near, [&](const auto& entry) { return offset_m(entry).dot(offset_m(near.front())) < 0.0; });
    around_[i] = {near.front().second, opposite == near.end() ? near.front().second : opposite->second};
  }
}

void TrueViews::look_around(const Simulation& simulation) {
  const SensorModel& sensor = simulation.config().fleet.sensor;
  const std::vector<Aim> aims = aims_at(simulation, targets_);
  viewers_.resize(targets());
  struct InView {
    std::size_t target;
    std::uint32_t yaws;
    double away_m;
  };
  std::vector<InView> in_view;
  std::vector<Seen> seen;
  std::vector<Eigen::Vector3f> directions;
  std::vector<float> hit_m;
  for (std::uint32_t place = 0; place < places(); ++place) {
    in_view.clear();
    directions.clear();
    for (const Aim& aim : aims) {
      const Eigen::Vector3d offset_m = aim.point_m - place_m_[place];
      if (offset_m.squaredNorm() > sensor.max_range_m * sensor.max_range_m) continue;
      const std::uint32_t yaws = yaws_that_see(sensor, yaws_, offset_m);
      if (yaws == 0) continue;
      in_view.push_back({aim.target, yaws, offset_m.norm()});
      directions.push_back((offset_m / in_view.back().away_m).cast<float>());
    }
    hit_m.resize(directions.size());
    simulation.caster().cast_from(place_m_[place].cast<float>(), directions, static_cast<float>(sensor.max_range_m),
                                  hit_m);
    seen.clear();
    for (std::size_t i = 0; i < in_view.size(); ++i) {
      const auto& [target, yaws, away_m] = in_view[i];
      if (static_cast<double>(hit_m[i]) >= away_m - kOnSurface_m) seen.push_back({target, yaws});
    }
    keep_sight(place, seen);
  }
}

/// @param seen by target, which may be there several times
void TrueViews::keep_sight(std::uint32_t place, const std::vector<Seen>& seen) {
  Window window{sights_.size(), 0, 0};
  if (!seen.empty()) {
    window.begin = seen.front().target / 64;
    window.end = seen.back().target / 64 + 1;
  }
  const std::size_t size = window.end - window.begin;
  windows_.push_back(window);
  sights_.resize(sights_.size() + static_cast<std::size_t>(yaws_) * size, 0);
  for (const auto& [target, yaws] : seen) {
    std::vector<Viewer>& viewers = viewers_[target];
    if (viewers.empty() || viewers.back().place != place) viewers.push_back({place, 0});
    viewers.back().yaws |= yaws;
    for (std::size_t yaw = 0; yaw < static_cast<std::size_t>(yaws_); ++yaw)
      if ((yaws >> yaw & 1u) != 0)
        sights_[window.at + yaw * size + target / 64 - window.begin] |= std::uint64_t{1} << (target % 64);
  }
}

void TrueViews::forget(std::size_t target, double from_m) {
  const auto far = [&](const Viewer& viewer) { return distance_m(viewer.place, target) >= from_m; };
  for (const Viewer& viewer : viewers_[target]) {
    if (!far(viewer)) continue;
    const Window& window = windows_[viewer.place];
    for (std::size_t yaw = 0; yaw < static_cast<std::size_t>(yaws_); ++yaw)
      sights_[window.at + yaw * (window.end - window.begin) + target / 64 - window.begin] &=
          ~(std::uint64_t{1} << (target % 64));
  }
  std::erase_if(viewers_[target], far);
}

TrueViews::Around TrueViews::around(const Eigen::Vector3d& at_m) const {
  const VoxelIndex cell = near_cells_.index_of(at_m);
  return near_cells_.contains(cell) ? around_[near_cells_.linear(cell)] : Around{};
}

int TrueViews::yaw_step(double yaw_rad) const {
  const long step = std::lround(yaw_rad / (2.0 * kPi) * yaws_);
  return static_cast<int>(((step % yaws_) + yaws_) % yaws_);
}

std::vector<TrueViews::Pose> cover_greedily(const TrueViews& views, double share) {
  std::vector<std::uint64_t> seen(views.words(), 0);
  const auto gain_of = [&](const TrueViews::Pose& pose) {
    const TrueViews::Sight sight = views.sight(pose);
    std::size_t gain = 0;
    for (std::size_t i = sight.begin; i < sight.end; ++i)
      gain += static_cast<std::size_t>(std::popcount(sight.word[i - sight.begin] & ~seen[i]));
    return gain;
  };
  // Gains only fall: what was counted once is an upper bound from then on.
  std::priority_queue<std::tuple<std::size_t, std::uint32_t, int>> queue;
  for (std::uint32_t place = 0; place < views.places(); ++place)
    for (int yaw = 0; yaw < views.yaws(); ++yaw) queue.emplace(gain_of({place, yaw}), place, yaw);
  std::vector<TrueViews::Pose> chosen;
  std::size_t count = 0;
  while (static_cast<double>(count) < share * static_cast<double>(views.targets()) && !queue.empty()) {
    const auto [bound, place, yaw] = queue.top();
    queue.pop();
    const std::size_t gain = gain_of({place, yaw});
    if (gain == 0) continue;
    if (!queue.empty() && gain < std::get<0>(queue.top())) {
      queue.emplace(gain, place, yaw);
      continue;
    }
    chosen.push_back({place, yaw});
    views.sight(chosen.back()).add_to(seen.data());
    count += gain;
  }
  return chosen;
}

}  // namespace stairwell::apps
