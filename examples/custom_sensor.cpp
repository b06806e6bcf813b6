// custom_sensor FILE.bt: maps a room with a home-made range sensor. Anything that can fill a Scan can be mapped: a
// driver of a real camera implements DepthSource in the same way.
#include "core/doors.hpp"
#include "core/units.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/octomap_io.hpp"
#include "mapping/scan_integrator.hpp"

#include <cmath>
#include <exception>
#include <iostream>

namespace {

using namespace stairwell;

/// Measures the walls of an empty room of 6 x 5 x 2.6 m with rays in all directions.
class RoomSensor final : public DepthSource {
 public:
  RoomSensor() {
    model_.kind = SensorKind::kLidar;
    model_.azimuth_fov_rad = 2.0 * kPi;
    model_.elevation_lo_rad = -0.5 * kPi;
    model_.elevation_hi_rad = 0.5 * kPi;
    model_.max_range_m = 10.0;
  }
  const SensorModel& model() const override { return model_; }

  Scan capture(const Pose& T_world_sensor, double time_s) override {
    Scan scan;
    scan.T_world_sensor = T_world_sensor;
    scan.time_s = time_s;
    scan.max_range_m = model_.max_range_m;
    for (int row = 0; row < 120; ++row)
      for (int column = 0; column < 360; ++column) {
        const double elevation_rad = (row + 0.5) / 120.0 * kPi - 0.5 * kPi;
        const double azimuth_rad = column / 360.0 * 2.0 * kPi;
        const Eigen::Vector3d ray(std::cos(elevation_rad) * std::cos(azimuth_rad),
                                  std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad));
        const double distance_m = to_wall_m(T_world_sensor.translation(), T_world_sensor.linear() * ray);
        scan.points_m.push_back((distance_m * ray).cast<float>());
      }
    return scan;
  }

 private:
  /// @pre the origin lies inside the room
  static double to_wall_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) {
    const Aabb room{{-3.05, -2.55, -0.05}, {3.05, 2.55, 2.65}};
    double nearest_m = 100.0;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(direction[axis]) < 1e-9) continue;
      const double wall_m = direction[axis] > 0.0 ? room.max_m[axis] : room.min_m[axis];
      nearest_m = std::min(nearest_m, (wall_m - origin_m[axis]) / direction[axis]);
    }
    return nearest_m;
  }

  SensorModel model_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: custom_sensor FILE.bt\n";
    return 2;
  }
  try {
    RoomSensor sensor;
    mapping::OccupancyMap map(GridSpec(Aabb{{-3.5, -3.0, -0.5}, {3.5, 3.0, 3.0}}, 0.1));
    mapping::ScanIntegrator integrator;
    for (const double x_m : {-2.0, 0.0, 2.0}) {
      const Scan scan = sensor.capture(make_pose({x_m, 0.3, 1.2}), 0.0);
      integrator.integrate(scan, map);
    }
    mapping::save_octomap(map, argv[1]);
    std::cout << argv[1] << ": " << map.known_volume_m3() << " m3 known, " << map.occupied_voxels()
              << " occupied voxels\n";
    return map.known_volume_m3() > 70.0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "custom_sensor: " << error.what() << '\n';
    return 1;
  }
}
