#include "toy_world.hpp"

#include "core/units.hpp"
#include "coverage3d/voxel_walk.hpp"
#include "planning3d/travel_costs.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace stairwell::coverage3d::toy {
namespace {

constexpr double kTick_s = 1.0;
constexpr double kAssumedFree_m = 0.6;

/// Computing time, so that other programs on the machine do not count.
double now_ms() { return 1000.0 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double known_part(const Scenario& scenario, const mapping::OccupancyMap& map) {
  const std::vector<char>& wanted = scenario.seeable;
  std::size_t all = 0;
  std::size_t known = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] == 0) continue;
    ++all;
    known += map.at(scenario.world.grid().voxel(i)) == Occupancy::kFree;
  }
  return all == 0 ? 1.0 : static_cast<double>(known) / static_cast<double>(all);
}

struct Uav {
  Eigen::Vector3d position_m;
  double yaw_rad = 0.0;
  double busy_until_s = 0.0;
  std::optional<Goal> goal;
};

}  // namespace

std::vector<char> seeable_from(const Scenario& scenario) {
  const World& world = scenario.world;
  const GridSpec& grid = world.grid();
  mapping::OccupancyMap map(grid);
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) map.update(grid.voxel(i), world.occupied(grid.voxel(i)));
  mapping::DistanceField distance(grid, 1.0, mapping::Obstacles::kBlocked);
  distance.update(map);
  const planning3d::FreeSpace space(map, distance, scenario.config.robot, scenario.config.box);
  planning3d::TravelCosts costs;
  costs.compute(space, scenario.starts_m.front(), planning3d::MotionRule::volume());
  mapping::OccupancyMap seen(grid);
  const int step = std::max(2, static_cast<int>(std::lround(0.8 / grid.resolution_m())));
  SensorModel sensor = scenario.config.sensor;
  sensor.azimuth_fov_rad = 2.0 * kPi;
  for (int z = 0; z < grid.size()[2]; z += step)
    for (int y = 0; y < grid.size()[1]; y += step)
      for (int x = 0; x < grid.size()[0]; x += step) {
        const VoxelIndex v{x, y, z};
        if (space.traversable(v) && std::isfinite(costs.distance_m(v)))
          look(world, sensor, grid.center_of(v), 0.0, seen);
      }
  std::vector<char> result(grid.voxel_count(), 0);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = seen.at(grid.voxel(i)) == Occupancy::kFree;
  return result;
}

World::World(const Aabb& box, double resolution_m)
    : grid_(box.inflated(resolution_m), resolution_m), occupied_(grid_.voxel_count(), 1) {
  fill(box, false);
}

void World::fill(const Aabb& box, bool occupied) {
  for (std::size_t i = 0; i < occupied_.size(); ++i)
    if (box.contains(grid_.center_of(grid_.voxel(i)))) occupied_[i] = occupied ? 1 : 0;
}

void look(const World& world, const SensorModel& sensor, const Eigen::Vector3d& position_m, double yaw_rad,
          mapping::OccupancyMap& map) {
  const GridSpec& grid = world.grid();
  if (world.occupied(grid.index_of(position_m))) return;
  const double step = 0.7 * grid.resolution_m() / std::min(4.0, sensor.max_range_m);
  std::vector<VoxelIndex> hits;
  std::vector<VoxelIndex> misses;
  for (double azimuth = -0.5 * sensor.azimuth_fov_rad; azimuth <= 0.5 * sensor.azimuth_fov_rad; azimuth += step)
    for (double elevation = sensor.elevation_lo_rad; elevation <= sensor.elevation_hi_rad; elevation += step) {
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(yaw_rad + azimuth),
                                      std::cos(elevation) * std::sin(yaw_rad + azimuth), std::sin(elevation));
      walk_voxels(grid, position_m, position_m + sensor.max_range_m * direction, [&](const VoxelIndex& v) {
        (world.occupied(v) ? hits : misses).push_back(v);
        return !world.occupied(v);
      });
    }
  for (const VoxelIndex& v : misses)
    if (map.at(v) == Occupancy::kUnknown) map.update(v, false);
  for (const VoxelIndex& v : hits)
    if (grid.contains(v) && map.at(v) == Occupancy::kUnknown) map.update(v, true);
}

SensorModel camera() {
  SensorModel sensor;
  sensor.azimuth_fov_rad = rad_from_deg(90.0);
  sensor.elevation_lo_rad = rad_from_deg(-35.0);
  sensor.elevation_hi_rad = rad_from_deg(35.0);
  sensor.max_range_m = 5.0;
  return sensor;
}

SensorModel lidar() {
  SensorModel sensor;
  sensor.kind = SensorKind::kLidar;
  sensor.azimuth_fov_rad = 2.0 * kPi;
  sensor.elevation_lo_rad = rad_from_deg(-45.0);
  sensor.elevation_hi_rad = rad_from_deg(45.0);
  sensor.max_range_m = 8.0;
  return sensor;
}

CoverageConfig config_for(const World& world, const SensorModel& sensor) {
  CoverageConfig config;
  config.sensor = sensor;
  config.box = world.grid().box();
  config.models_dir = STAIRWELL_SOURCE_DIR "/models";
  return config;
}

World two_storeys(double resolution_m) {
  World world({{0.0, 0.0, 0.0}, {10.0, 8.0, 6.2}}, resolution_m);
  world.fill({{0.0, 0.0, 2.9}, {10.0, 8.0, 3.3}}, true);  // slab
  world.fill({{7.0, 5.0, 2.8}, {9.0, 7.0, 3.4}}, false);  // opening
  for (const double z : {0.0, 3.3}) {
    world.fill({{4.8, 0.0, z}, {5.2, 8.0, z + 2.9}}, true);  // wall with a door
    world.fill({{4.6, 3.0, z}, {5.4, 4.6, z + 2.2}}, false);
    world.fill({{0.0, 3.8, z}, {4.8, 4.2, z + 2.9}}, true);
    world.fill({{1.0, 3.6, z}, {2.4, 4.4, z + 2.2}}, false);
  }
  return world;
}

World office(double resolution_m) {
  World world({{0.0, 0.0, 0.0}, {20.0, 20.0, 3.6}}, resolution_m);
  for (int i = 0; i < 4; ++i) {
    const double at = 5.0 * i;
    if (i > 0) {
      world.fill({{at - 0.1, 0.0, 0.0}, {at + 0.1, 8.6, 3.6}}, true);
      world.fill({{at - 0.1, 11.4, 0.0}, {at + 0.1, 20.0, 3.6}}, true);
    }
    world.fill({{at, 8.4, 0.0}, {at + 5.0, 8.6, 3.6}}, true);
    world.fill({{at, 11.4, 0.0}, {at + 5.0, 11.6, 3.6}}, true);
    world.fill({{at + 1.4, 8.2, 0.0}, {at + 2.6, 8.8, 2.2}}, false);
    world.fill({{at + 2.4, 11.2, 0.0}, {at + 3.6, 11.8, 2.2}}, false);
    world.fill({{at + 3.4, 2.0, 0.0}, {at + 4.4, 5.0, 1.6}}, true);  // cupboards
    world.fill({{at + 1.0, 15.0, 0.0}, {at + 3.0, 15.6, 2.4}}, true);
  }
  return world;
}

World corridor(double resolution_m) { return World({{0.0, 0.0, 0.0}, {24.0, 1.6, 2.4}}, resolution_m); }

Outcome run(const Scenario& scenario, CoverageStrategy& strategy) {
  const World& world = scenario.world;
  const CoverageConfig& config = scenario.config;
  mapping::OccupancyMap map(world.grid());
  mapping::DistanceField distance(world.grid(), 1.0, mapping::Obstacles::kBlocked);
  Outcome outcome;
  std::vector<Uav> uavs;
  for (const Eigen::Vector3d& start_m : scenario.starts_m) {
    uavs.push_back({start_m, 0.0, 0.0, std::nullopt});
    map.assume_free(start_m, kAssumedFree_m);
    for (int i = 0; i < 6; ++i) look(world, config.sensor, start_m, i * kPi / 3.0, map);
  }
  std::size_t assignments = 0;
  for (double time_s = 0.0; outcome.goals < scenario.most_goals; time_s += kTick_s) {
    distance.update(map);
    const planning3d::FreeSpace space(map, distance, config.robot, config.box);
    AssignmentRequest request;
    request.time_s = time_s;
    bool wanted = false;
    for (Uav& uav : uavs) {
      if (uav.goal && uav.busy_until_s <= time_s) {
        uav.position_m = uav.goal->position_m;
        uav.yaw_rad = uav.goal->yaw_rad;
        look(world, config.sensor, uav.position_m, uav.yaw_rad, map);
        if (strategy.still_useful(space, *uav.goal)) {
          strategy.report_failure(*uav.goal, time_s);
          ++outcome.vain;
        }
        uav.goal.reset();
      }
      request.uavs.push_back({uav.position_m, Eigen::Vector3d::Zero(), uav.yaw_rad, !uav.goal, uav.goal});
      wanted = wanted || !uav.goal;
    }
    if (!wanted) continue;
    distance.update(map);
    const double before_ms = now_ms();
    const Assignment assignment = strategy.assign(space, request);
    const double took_ms = now_ms() - before_ms;
    ++assignments;
    outcome.assign_ms += took_ms;
    outcome.assign_max_ms = std::max(outcome.assign_max_ms, took_ms);
    bool flying = false;
    for (std::size_t i = 0; i < uavs.size(); ++i) {
      Uav& uav = uavs[i];
      if (!uav.goal && assignment.goals[i]) {
        uav.goal = assignment.goals[i];
        const double way_m = uav.goal->travel_m;
        const double turn_s = config.sensor.panoramic() ? 0.0
                                                        : std::abs(wrap_angle(uav.goal->yaw_rad - uav.yaw_rad)) /
                                                              config.limits.yaw_rate_radps;
        uav.busy_until_s = time_s + std::max(way_m / config.limits.speed_mps, turn_s) + 1.0;
        outcome.travel_m += way_m;
        ++outcome.goals;
        outcome.longest_s = std::max(outcome.longest_s, uav.busy_until_s);
      }
      flying = flying || uav.goal.has_value();
    }
    if (!flying) {
      outcome.finished = assignment.open_targets == 0;
      break;
    }
  }
  outcome.assign_ms /= static_cast<double>(std::max<std::size_t>(1, assignments));
  outcome.known_part = known_part(scenario, map);
  return outcome;
}

}  // namespace stairwell::coverage3d::toy
