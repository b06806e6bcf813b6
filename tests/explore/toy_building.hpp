/// A small building of boxes with sensors and vehicles in it, for tests of the fleet loop.
#pragma once

#include "core/units.hpp"
#include "explore/fleet.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/vehicles.hpp"
#include "sim3d/world.hpp"

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stairwell::test {

inline void add_box(sim3d::TriangleMesh& mesh, const Eigen::Vector3f& lo, const Eigen::Vector3f& hi) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices_m.emplace_back((corner & 1) ? hi.x() : lo.x(), (corner & 2) ? hi.y() : lo.y(),
                                 (corner & 4) ? hi.z() : lo.z());
  }
  constexpr std::uint32_t kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                           {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& face : kFaces) mesh.triangles.push_back({first + face[0], first + face[1], first + face[2]});
}

/// 6 x 4 x 2.4 m inside, a wall with a 1 m door at x = 3.
inline sim3d::TriangleMesh two_rooms() {
  sim3d::TriangleMesh mesh;
  add_box(mesh, {-0.15F, -0.15F, -0.15F}, {6.15F, 4.15F, 0.0F});
  add_box(mesh, {-0.15F, -0.15F, 2.4F}, {6.15F, 4.15F, 2.55F});
  add_box(mesh, {-0.15F, -0.15F, 0.0F}, {0.0F, 4.15F, 2.4F});
  add_box(mesh, {6.0F, -0.15F, 0.0F}, {6.15F, 4.15F, 2.4F});
  add_box(mesh, {0.0F, -0.15F, 0.0F}, {6.0F, 0.0F, 2.4F});
  add_box(mesh, {0.0F, 4.0F, 0.0F}, {6.0F, 4.15F, 2.4F});
  add_box(mesh, {2.95F, 0.0F, 0.0F}, {3.05F, 1.5F, 2.4F});
  add_box(mesh, {2.95F, 2.6F, 0.0F}, {3.05F, 4.0F, 2.4F});
  return mesh;
}

/// A sensor that also sees the other UAVs.
class FleetSensor final : public DepthSource {
 public:
  FleetSensor(sim3d::SimulatedSensor sensor, const std::vector<std::unique_ptr<Vehicle>>* vehicles, std::size_t self)
      : sensor_(std::move(sensor)), vehicles_(vehicles), self_(self) {}
  const SensorModel& model() const override { return sensor_.model(); }
  Scan capture(const Pose& T_world_sensor, double time_s) override {
    std::vector<Eigen::Vector3d> fellows_m;
    for (std::size_t i = 0; i < vehicles_->size(); ++i) {
      if (i != self_) fellows_m.push_back((*vehicles_)[i]->state().position_m);
    }
    sensor_.set_fellows(std::move(fellows_m), 0.2);
    return sensor_.capture(T_world_sensor, time_s);
  }

 private:
  sim3d::SimulatedSensor sensor_;
  const std::vector<std::unique_ptr<Vehicle>>* vehicles_;
  std::size_t self_;
};

struct ToySimulation {
  ToySimulation(const sim3d::TriangleMesh& mesh, const explore::FleetConfig& config,
                const std::vector<Eigen::Vector3d>& starts_m, bool landed = false)
      : caster(std::make_shared<sim3d::RayCaster>(mesh)) {
    for (std::size_t i = 0; i < starts_m.size(); ++i) {
      MotionState start;
      start.position_m = starts_m[i];
      vehicles.push_back(sim3d::make_vehicle("limited", config.limits, start, landed));
      sensors.push_back(std::make_unique<FleetSensor>(
          sim3d::SimulatedSensor(caster, config.sensor, {}, config.seed, "uav" + std::to_string(i)), &vehicles, i));
    }
  }
  std::vector<explore::UavDoors> doors() {
    std::vector<explore::UavDoors> all;
    for (std::size_t i = 0; i < vehicles.size(); ++i) all.push_back({sensors[i].get(), vehicles[i].get()});
    return all;
  }

  std::shared_ptr<const sim3d::RayCaster> caster;
  std::vector<std::unique_ptr<Vehicle>> vehicles;
  std::vector<std::unique_ptr<FleetSensor>> sensors;
};

inline explore::FleetConfig toy_config() {
  explore::FleetConfig config;
  config.task_box = {{0.0, 0.0, 0.0}, {6.0, 4.0, 2.4}};
  config.sensor.azimuth_fov_rad = rad_from_deg(90.0);
  config.sensor.elevation_lo_rad = rad_from_deg(-36.85);
  config.sensor.elevation_hi_rad = rad_from_deg(36.85);
  config.sensor.rays_azimuth = 96;
  config.sensor.rays_elevation = 72;
  config.time_limit_s = 200.0;
  config.charge_planning = false;
  return config;
}

inline double no_clock() { return 0.0; }

inline std::vector<mapping::OccupancyMap> only(mapping::OccupancyMap map) {
  std::vector<mapping::OccupancyMap> maps;
  maps.push_back(std::move(map));
  return maps;
}

/// Counts events and notes who has just begun to look for a goal.
struct RecordingLog final : explore::ExplorationLog {
  void on_state(double, std::size_t uav, std::string_view state) override {
    searching[uav] = state == "find_goal" || state == "radial_scan";
  }
  void on_event(double, std::size_t, std::string_view event, std::string_view) override {
    ++events[std::string(event)];
  }

  std::map<std::string, int> events;
  std::map<std::size_t, bool> searching;
};

}  // namespace stairwell::test
