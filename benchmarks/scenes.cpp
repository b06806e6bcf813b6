#include "scenes.hpp"

#include "core/rng.hpp"
#include "core/units.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/world.hpp"

#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

namespace stairwell::bench {

namespace {

constexpr std::size_t kScans = 48;
constexpr double kClearance_m = 0.4;

SensorModel camera() {
  SensorModel model;
  model.kind = SensorKind::kDepthCamera;
  model.azimuth_fov_rad = rad_from_deg(90.0);
  model.elevation_lo_rad = rad_from_deg(-36.85);
  model.elevation_hi_rad = rad_from_deg(36.85);
  model.max_range_m = 8.0;
  model.rays_azimuth = 320;
  model.rays_elevation = 240;
  return model;
}

/// Indoors and clear: something above and below, nothing near.
bool good_place(const sim3d::RayCaster& caster, const Eigen::Vector3d& position_m) {
  const std::array<Eigen::Vector3f, 6> directions{Eigen::Vector3f::UnitX(), -Eigen::Vector3f::UnitX(),
                                                  Eigen::Vector3f::UnitY(), -Eigen::Vector3f::UnitY(),
                                                  Eigen::Vector3f::UnitZ(), -Eigen::Vector3f::UnitZ()};
  for (const Eigen::Vector3f& direction : directions) {
    if (caster.occluded(position_m.cast<float>(), direction, static_cast<float>(kClearance_m))) return false;
  }
  return caster.occluded(position_m.cast<float>(), directions[4], 100.0F) &&
         caster.occluded(position_m.cast<float>(), directions[5], 100.0F);
}

Scene make_office_tower() {
  const sim3d::World world = sim3d::load_world(std::filesystem::path(STAIRWELL_WORLDS) / "office_tower.sdf");
  const auto caster = std::make_shared<sim3d::RayCaster>(world.mesh);
  sim3d::SimulatedSensor sensor(caster, camera(), {}, 1, "benchmark");
  Scene scene;
  scene.box = world.bounds.inflated(0.2);
  Rng rng = make_rng(1, "benchmark poses");
  while (scene.scans.size() < kScans) {
    Pose T_world_sensor = Pose::Identity();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      T_world_sensor.translation()[axis] = rng.uniform(world.bounds.min_m[axis], world.bounds.max_m[axis]);
    }
    if (!good_place(*caster, T_world_sensor.translation())) continue;
    T_world_sensor.linear() = Eigen::AngleAxisd(rng.uniform(-kPi, kPi), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    scene.scans.push_back(sensor.capture(T_world_sensor, 0.1 * static_cast<double>(scene.scans.size())));
  }
  return scene;
}

constexpr int kTurn = 12;
constexpr int kFlight = 240;
constexpr double kStep_m = 0.1;

/// Flies ahead while nothing is near, else turns; always the same way.
class Pilot {
 public:
  Pilot(const sim3d::RayCaster& caster, const Aabb& box) : caster_(caster) {
    Rng rng = make_rng(3, "benchmark flight");
    do {
      for (int axis = 0; axis < 3; ++axis) at_m_[axis] = rng.uniform(box.min_m[axis], box.max_m[axis]);
      yaw_rad_ = rng.uniform(-kPi, kPi);
    } while (!good_place(caster_, at_m_) || !ahead_clear());
  }

  Pose pose() const {
    Pose T_world_camera = Pose::Identity();
    T_world_camera.translation() = at_m_;
    T_world_camera.linear() = Eigen::AngleAxisd(yaw_rad_, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T_world_camera;
  }
  void turn(double by_rad) { yaw_rad_ += by_rad; }
  void fly() {
    const bool ahead = ahead_clear();
    if (ahead) at_m_ += kStep_m * direction(0.0);
    turn(ahead ? 0.004 : 0.08);
  }

 private:
  Eigen::Vector3d direction(double beside_rad) const {
    return {std::cos(yaw_rad_ + beside_rad), std::sin(yaw_rad_ + beside_rad), 0.0};
  }
  bool clear(double beside_rad, double range_m) const {
    return !caster_.occluded(at_m_.cast<float>(), direction(beside_rad).cast<float>(), static_cast<float>(range_m));
  }
  bool ahead_clear() const {
    return clear(0.0, 1.0) && clear(0.4, 0.8) && clear(-0.4, 0.8) && clear(0.9, 0.5) && clear(-0.9, 0.5);
  }

  const sim3d::RayCaster& caster_;
  Eigen::Vector3d at_m_;
  double yaw_rad_ = 0.0;
};

Scene make_office_flight() {
  const sim3d::World world = sim3d::load_world(std::filesystem::path(STAIRWELL_WORLDS) / "office_tower.sdf");
  const auto caster = std::make_shared<sim3d::RayCaster>(world.mesh);
  sim3d::SimulatedSensor sensor(caster, camera(), {}, 1, "benchmark flight");
  Scene scene;
  scene.box = world.bounds.inflated(0.2);
  Pilot pilot(*caster, world.bounds);
  for (int i = 0; i < kFlight; ++i) {
    scene.scans.push_back(sensor.capture(pilot.pose(), 0.1 * i));
    if (i < kTurn) {
      pilot.turn(2.0 * kPi / kTurn);
    } else {
      pilot.fly();
    }
  }
  return scene;
}

/// A figure of /proc/self/status, there in KiB.
double status_mib(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(name + ":", 0) == 0) return std::stod(line.substr(name.size() + 1)) / 1024.0;
  }
  return 0.0;
}

}  // namespace

std::array<std::pair<double, const char*>, 2> resolutions() { return {{{0.1, "0.10"}, {0.05, "0.05"}}}; }

double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double resident_mib() { return status_mib("VmRSS"); }
double peak_resident_mib() { return status_mib("VmHWM"); }

const Scene& office_flight() {
  static const Scene scene = make_office_flight();
  return scene;
}

const Scene& office_tower() {
  static const Scene scene = make_office_tower();
  return scene;
}

}  // namespace stairwell::bench
