/// Maps, shapes and poses for the tests of the collision checker.
#pragma once

#include "core/rng.hpp"
#include "core/units.hpp"
#include "exact_overlap.hpp"
#include "mapping/collision.hpp"
#include "mapping/scan_integrator.hpp"
#include "scribble.hpp"
#include "sim3d/ground_truth.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/world.hpp"

#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

namespace stairwell::mapping::test {

inline constexpr double kGrazing_m = 1e-9;

inline GridSpec odd_grid(double resolution_m) {
  return {Aabb{Eigen::Vector3d(-1.7, 0.3, -0.9), Eigen::Vector3d(2.4, 3.2, 2.2)}, resolution_m};
}

/// Free and occupied strokes in unknown space.
inline OccupancyMap scribbled_map() {
  OccupancyMap map(odd_grid(0.1));
  Rng rng = make_rng(21, "collision scribble");
  scribble(rng, map, 260);
  return map;
}

/// What is truly there in one of our buildings; all of it known.
inline OccupancyMap true_map() {
  const sim3d::World world = sim3d::load_world(std::filesystem::path(STAIRWELL_SOURCE_DIR) / "worlds/duplex.sdf");
  const sim3d::GroundTruth truth(world, GridSpec(world.bounds.inflated(0.1), 0.1));
  OccupancyMap map(truth.grid());
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    map.set_log_odds(map.grid().voxel(i), truth.at(i) == sim3d::TruthClass::kFree ? -1.0F : 2.0F);
  }
  return map;
}

/// What a few lidar scans of the atrium make known of it.
inline OccupancyMap scanned_map() {
  const sim3d::World world = sim3d::load_world(std::filesystem::path(STAIRWELL_SOURCE_DIR) / "worlds/atrium.sdf");
  SensorModel lidar;
  lidar.kind = SensorKind::kLidar;
  lidar.azimuth_fov_rad = 2.0 * kPi;
  lidar.elevation_lo_rad = rad_from_deg(-45.0);
  lidar.elevation_hi_rad = rad_from_deg(45.0);
  lidar.max_range_m = 8.0;
  lidar.rays_azimuth = 360;
  lidar.rays_elevation = 90;
  sim3d::SimulatedSensor sensor(std::make_shared<sim3d::RayCaster>(world.mesh), lidar, {}, 3, "collision");
  OccupancyMap map(GridSpec({{-8.3, -8.3, -0.3}, {8.3, 8.3, 5.0}}, 0.1));
  ScanIntegrator integrator;
  for (const auto& [x, y] : {std::pair{-6.0, -6.0}, {6.0, -6.0}, {-6.0, 6.0}, {6.0, 6.0}, {0.0, 0.0}}) {
    integrator.integrate(sensor.capture(make_pose({x, y, 0.95}), 0.0), map);
  }
  return map;
}

inline Eigen::Matrix3d random_rotation(Rng& rng) {
  const Eigen::Quaterniond q(rng.normal(), rng.normal(), rng.normal(), rng.normal());
  return q.normalized().toRotationMatrix();
}

/// Half of the poses are level, as a UAV's mostly are, which puts edges and faces parallel to the voxels'.
inline Pose random_pose(Rng& rng, const Aabb& box) {
  Pose T_world_body = Pose::Identity();
  for (Eigen::Index i = 0; i < 3; ++i) T_world_body.translation()[i] = rng.uniform(box.min_m[i], box.max_m[i]);
  switch (rng.uniform_int(0, 3)) {
    case 0:
      break;
    case 1:
      T_world_body.linear() = make_pose(Eigen::Vector3d::Zero(), rng.uniform(-kPi, kPi)).linear();
      break;
    default:
      T_world_body.linear() = random_rotation(rng);
  }
  return T_world_body;
}

inline CollisionShape random_shape(Rng& rng, int kind, double largest_m = 0.5) {
  const auto length_m = [&] { return rng.uniform(0.03, largest_m); };
  switch (kind) {
    case 0:
      return SphereShape{length_m()};
    case 1:
      return BoxShape{{length_m(), length_m(), length_m()}};
    case 2:
      return EllipsoidShape{{length_m(), length_m(), length_m()}};
    default:
      return CylinderShape{length_m(), length_m()};
  }
}

struct Views {
  OccupancyWords words;
  DistanceField distance;

  Views(const OccupancyMap& map, Obstacles obstacles)
      : words(map.grid(), obstacles), distance(map.grid(), 1.0, obstacles) {
    words.update(map);
    distance.update(map);
  }
  CollisionChecker checker(const CollisionShape& shape) const { return {words, distance, shape}; }
};

inline bool sticks_out(const GridSpec& grid, const CollisionShape& shape, const Pose& T_world_body) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_m(shape));
  return !grid.box().contains(T_world_body.translation() - reach) ||
         !grid.box().contains(T_world_body.translation() + reach);
}

inline std::string described(const CollisionShape& shape, const Pose& T_world_body) {
  std::ostringstream text;
  text.precision(17);
  text << "shape " << shape.index() << ", reach " << reach_m(shape) << " m, pose\n" << T_world_body.matrix();
  return text.str();
}

}  // namespace stairwell::mapping::test
