// explore_programmatically: one simulated UAV explores a generated single-storey building, without the command line.
#include "core/errors.hpp"
#include "explore/fleet.hpp"
#include "sim3d/generator.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/vehicles.hpp"
#include "sim3d/world.hpp"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>

namespace {

using namespace stairwell;

sim3d::World make_world() {
  sim3d::GeneratorConfig building;
  building.storeys = 1;
  building.width_m = 10.0;
  building.depth_m = 8.0;
  const std::filesystem::path file = "generated_building.sdf";
  std::ofstream(file) << sim3d::generate_building(building);
  return sim3d::load_world(file);
}

SensorModel wide_camera() {
  SensorModel sensor;
  sensor.azimuth_fov_rad = 1.8;
  sensor.elevation_lo_rad = -0.6;
  sensor.elevation_hi_rad = 0.6;
  sensor.max_range_m = 5.0;
  sensor.rate_hz = 5.0;
  return sensor;
}

/// Says what the fleet decides.
class PrintingLog final : public explore::ExplorationLog {
 public:
  void on_goal(double time_s, std::size_t, const Eigen::Vector3d& goal_m, double gain_m3, std::string_view) override {
    std::printf("%6.1f s  fly to %.1f, %.1f, %.1f to see %.1f m3\n", time_s, goal_m.x(), goal_m.y(), goal_m.z(),
                gain_m3);
  }
};

}  // namespace

int main() {
  try {
    const sim3d::World world = make_world();
    const auto caster = std::make_shared<const sim3d::RayCaster>(world.mesh);

    explore::FleetConfig config;
    config.task_box = world.bounds;
    config.resolution_m = 0.15;
    config.sensor = wide_camera();
    config.time_limit_s = 60.0;
    config.charge_planning = false;

    MotionState start;
    start.position_m = {0.0, 0.0, 0.95};
    sim3d::SimulatedSensor sensor(caster, config.sensor, {}, config.seed, "sensor");
    const auto vehicle = sim3d::make_vehicle("limited", config.limits, start, false);
    PrintingLog log;
    explore::Fleet fleet(config, {{&sensor, vehicle.get()}}, log, [] { return 0.0; });
    while (fleet.step()) {
    }
    std::printf("%s after %.1f s: %.1f m3 known\n", explore::to_string(fleet.stop_reason()), fleet.time_s(),
                fleet.map().known_volume_m3());
    return fleet.map().known_volume_m3() > 50.0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "explore_programmatically: %s\n", error.what());
    return 1;
  }
}
