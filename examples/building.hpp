/// One simulated UAV that explores a generated single-storey building, for the examples.
#pragma once

#include "explore/fleet.hpp"
#include "sim3d/generator.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/vehicles.hpp"
#include "sim3d/world.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>

namespace stairwell::example {

struct Explored {
  double time_s = 0.0;
  double known_m3 = 0.0;
  std::size_t fallbacks = 0;
  const char* stop_reason = "";
};

inline sim3d::World make_world() {
  sim3d::GeneratorConfig building;
  building.storeys = 1;
  building.width_m = 10.0;
  building.depth_m = 8.0;
  const std::filesystem::path file = "generated_building.sdf";
  std::ofstream(file) << sim3d::generate_building(building);
  return sim3d::load_world(file);
}

/// @param change sets what the example is about
inline Explored explore_building(explore::ExplorationLog& log,
                                 const std::function<void(explore::FleetConfig&)>& change = {}) {
  const sim3d::World world = make_world();
  const auto caster = std::make_shared<const sim3d::RayCaster>(world.mesh);

  explore::FleetConfig config;
  config.task_box = world.bounds;
  config.resolution_m = 0.15;
  config.sensor.azimuth_fov_rad = 1.8;
  config.sensor.elevation_lo_rad = -0.6;
  config.sensor.elevation_hi_rad = 0.6;
  config.sensor.max_range_m = 5.0;
  config.sensor.rate_hz = 5.0;
  config.time_limit_s = 60.0;
  config.charge_planning = false;
  if (change) change(config);

  MotionState start;
  start.position_m = {0.0, 0.0, 0.95};
  sim3d::SimulatedSensor sensor(caster, config.sensor, {}, config.seed, "sensor");
  const auto vehicle = sim3d::make_vehicle("limited", config.limits, start, false);
  explore::Fleet fleet(config, {{&sensor, vehicle.get()}}, log, [] { return 0.0; });
  while (fleet.step()) {
  }
  return {fleet.time_s(), fleet.map().known_volume_m3(), fleet.stats().fallbacks,
          explore::to_string(fleet.stop_reason())};
}

}  // namespace stairwell::example
