#include "sim3d/sensors.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "test_meshes.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

namespace stairwell::sim3d {
namespace {

std::shared_ptr<const RayCaster> box_room() {
  return std::make_shared<const RayCaster>(test::box_mesh({-3.0, -2.0, 0.0}, {4.0, 2.0, 2.5}));
}

std::shared_ptr<const RayCaster> nothing() { return std::make_shared<const RayCaster>(TriangleMesh{}); }

SensorModel camera() {
  SensorModel model;
  model.azimuth_fov_rad = rad_from_deg(90.0);
  model.elevation_lo_rad = rad_from_deg(-30.0);
  model.elevation_hi_rad = rad_from_deg(40.0);
  model.rays_azimuth = 64;
  model.rays_elevation = 48;
  return model;
}

SensorModel lidar() {
  SensorModel model;
  model.kind = SensorKind::kLidar;
  model.azimuth_fov_rad = 2.0 * kPi;
  model.elevation_lo_rad = rad_from_deg(-7.0);
  model.elevation_hi_rad = rad_from_deg(45.0);
  model.rays_azimuth = 360;
  model.rays_elevation = 53;
  model.max_range_m = 10.0;
  return model;
}

TEST_CASE("A camera's rays form an even lattice on the image plane within its field of view") {
  SimulatedSensor sensor(nothing(), camera(), {}, 1, "camera");
  const Scan scan = sensor.capture(make_pose({1.0, 2.0, 3.0}, 0.7), 4.0);
  REQUIRE(scan.points_m.size() == 64 * 48);
  CHECK(scan.time_s == 4.0);
  CHECK(scan.max_range_m == 5.0);
  CHECK(scan.T_world_sensor.isApprox(make_pose({1.0, 2.0, 3.0}, 0.7)));
  const SensorModel seen = [] {
    SensorModel model = camera();
    model.max_range_m += 1.0;
    return model;
  }();
  const auto on_plane = [&](std::size_t i) { return Eigen::Vector3f(scan.points_m[i] / scan.points_m[i].x()); };
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    REQUIRE(seen.sees(scan.points_m[i].cast<double>()));
    REQUIRE(scan.points_m[i].norm() > 5.0f);
    REQUIRE(scan.points_m[i].norm() < 5.02f);
  }
  CHECK(std::abs((on_plane(1) - on_plane(0)).y()) == Approx(2.0 / 64).epsilon(1e-3));
  CHECK(on_plane(0).y() == Approx(1.0 - 1.0 / 64).epsilon(1e-3));
  const double height = std::tan(rad_from_deg(40.0)) + std::tan(rad_from_deg(30.0));
  CHECK(std::abs((on_plane(64) - on_plane(0)).z()) == Approx(height / 48).epsilon(1e-3));
}

TEST_CASE("A lidar's lattice has both elevations, no azimuth twice, and is drawn from without repetition") {
  SimulatedSensor whole(nothing(), lidar(), {}, 1, "lidar");
  const Scan scan = whole.capture(make_pose({0, 0, 1}), 0.0);
  REQUIRE(scan.points_m.size() == 360 * 53);
  std::set<std::tuple<int, int>> cells;
  for (const auto& p : scan.points_m) {
    const double azimuth_deg = deg_from_rad(std::atan2(p.y(), p.x()));
    const double elevation_deg = deg_from_rad(std::atan2(p.z(), p.head<2>().norm()));
    REQUIRE(elevation_deg > -7.001);
    REQUIRE(elevation_deg < 45.001);
    cells.emplace((static_cast<int>(std::lround(azimuth_deg)) + 360) % 360,
                  static_cast<int>(std::lround(elevation_deg)));
  }
  CHECK(cells.size() == 360 * 53);

  SensorModel sparse = lidar();
  sparse.samples_per_scan = 2000;
  SimulatedSensor sensor(nothing(), sparse, {}, 1, "lidar");
  const Scan first = sensor.capture(make_pose({0, 0, 1}), 0.0);
  const Scan second = sensor.capture(make_pose({0, 0, 1}), 0.1);
  CHECK(first.points_m.size() == 2000);
  CHECK(second.points_m.size() == 2000);
  CHECK(first.points_m != second.points_m);
  std::set<std::tuple<float, float, float>> distinct;
  for (const auto& p : first.points_m) distinct.emplace(p.x(), p.y(), p.z());
  CHECK(distinct.size() == 2000);
}

TEST_CASE("Returns lie just behind the surface, from within the range") {
  const auto room = box_room();
  SensorModel model = camera();
  model.max_range_m = 3.0;
  SimulatedSensor sensor(room, model, {}, 1, "camera");
  const Pose T_world_sensor = make_pose({0.4, -0.3, 1.0}, 0.5);
  std::size_t hits = 0;
  for (const auto& point_sensor_m : sensor.capture(T_world_sensor, 0.0).points_m) {
    const Eigen::Vector3f direction =
        (T_world_sensor.linear() * point_sensor_m.cast<double>()).normalized().cast<float>();
    const float surface_m = room->cast(T_world_sensor.translation().cast<float>(), direction, 100.0f).distance_m;
    const double range_m = static_cast<double>(point_sensor_m.norm());
    if (range_m > model.max_range_m) {
      REQUIRE(static_cast<double>(surface_m) > model.max_range_m - 1.1 * kSurfaceBias_m);
    } else {
      REQUIRE(range_m == Approx(static_cast<double>(surface_m) + kSurfaceBias_m).margin(2e-5));
      ++hits;
    }
  }
  CHECK(hits > 500);
}

TEST_CASE("Nothing nearer than the minimum range is returned") {
  SensorModel model = camera();
  model.min_range_m = 0.5;
  SimulatedSensor sensor(box_room(), model, {}, 1, "camera");
  CHECK(sensor.capture(make_pose({3.8, 0.0, 1.0}), 0.0).points_m.size() < 64 * 48 / 2);
  for (const auto& p : sensor.capture(make_pose({3.6, 0.0, 1.0}), 0.0).points_m) {
    REQUIRE(static_cast<double>(p.norm()) >= 0.5);
  }
}

TEST_CASE("The same seed, name and scan number give the same scan, and only those") {
  SensorNoise noise;
  noise.enabled = true;
  SensorModel model = lidar();
  model.samples_per_scan = 500;
  const Pose pose = make_pose({0.0, 0.0, 1.0}, 0.2);
  SimulatedSensor a(box_room(), model, noise, 7, "uav 0");
  SimulatedSensor b(box_room(), model, noise, 7, "uav 0");
  a.capture(make_pose({1.0, 1.0, 1.0}), 0.0);
  const auto from_a = a.capture(pose, 0.1).points_m;
  CHECK(a.scans_taken() == 2);
  b.set_scans_taken(1);
  CHECK(b.capture(pose, 0.1).points_m == from_a);
  CHECK(b.capture(pose, 0.1).points_m != from_a);
  SimulatedSensor other_name(box_room(), model, noise, 7, "uav 1");
  SimulatedSensor other_seed(box_room(), model, noise, 8, "uav 0");
  other_name.set_scans_taken(1);
  other_seed.set_scans_taken(1);
  CHECK(other_name.capture(pose, 0.1).points_m != from_a);
  CHECK(other_seed.capture(pose, 0.1).points_m != from_a);
}

TEST_CASE("Noise grows with depth squared, drops pixels and quantises") {
  // A wall 4 m ahead.
  const auto wall = std::make_shared<const RayCaster>(test::box_mesh({4.0, -20.0, -20.0}, {4.5, 20.0, 20.0}));
  SensorModel model = camera();
  model.max_range_m = 20.0;
  SensorNoise noise;
  noise.enabled = true;
  noise.disparity_step_m = 0.0;
  noise.dropout = 0.2;
  SimulatedSensor sensor(wall, model, noise, 3, "noise");
  double sum = 0.0;
  double squares = 0.0;
  std::size_t count = 0;
  for (int scan = 0; scan < 10; ++scan) {
    for (const auto& p : sensor.capture(Pose::Identity(), 0.0).points_m) {
      const double error_m = static_cast<double>(p.x()) - 4.0;
      sum += error_m;
      squares += error_m * error_m;
      ++count;
    }
  }
  const auto n = static_cast<double>(count);
  CHECK(n / (10.0 * 64 * 48) == Approx(0.8).margin(0.01));
  CHECK(sum / n == Approx(kSurfaceBias_m).margin(0.0005));
  CHECK(std::sqrt(squares / n - sum * sum / n / n) == Approx(0.0012 * 16.0).epsilon(0.03));

  noise.sigma_at_1m_m = 0.0;
  noise.dropout = 0.0;
  noise.disparity_step_m = 0.01;
  SimulatedSensor stepped(wall, model, noise, 3, "noise");
  std::set<long> levels;
  for (const auto& p : stepped.capture(make_pose({-0.05, 0.0, 0.0}, 0.3), 0.0).points_m) {
    const double along = static_cast<double>(p.normalized().x());
    levels.insert(std::lround(1e3 / (static_cast<double>(p.x()) - kSurfaceBias_m * along)));
    const double steps = 100.0 / (static_cast<double>(p.x()) - kSurfaceBias_m * along);
    REQUIRE(std::abs(steps - std::round(steps)) < 1e-3);
  }
  CHECK(levels.size() > 3);
}

TEST_CASE("Fellow UAVs block the view") {
  SimulatedSensor sensor(box_room(), camera(), {}, 1, "camera");
  const Pose T_world_sensor = make_pose({-2.0, 0.0, 1.2}, 0.0);
  const Eigen::Vector3d fellow_m(0.0, 0.0, 1.2);
  const auto on_fellow = [&](const Scan& scan) {
    return std::count_if(scan.points_m.begin(), scan.points_m.end(), [&](const Eigen::Vector3f& p) {
      return ((T_world_sensor * p.cast<double>()) - fellow_m).norm() <= 0.3 + 1e-4;
    });
  };
  CHECK(on_fellow(sensor.capture(T_world_sensor, 0.0)) == 0);
  sensor.set_fellows({fellow_m, {-2.5, 0.0, 1.2}}, 0.3);
  const Scan scan = sensor.capture(T_world_sensor, 0.0);
  // A disc of 0.3 m at 2 m: pi * (0.3 / 2)^2 of an image plane of 2 x 1.416 at 64 x 48 pixels.
  CHECK(static_cast<double>(on_fellow(scan)) == Approx(kPi * 0.0225 / 2.0 * 64 / 1.416 * 48).epsilon(0.12));
  for (const auto& p : scan.points_m) {
    const Eigen::Vector3d point_m = T_world_sensor * p.cast<double>();
    const Eigen::Vector3d way_m = point_m - T_world_sensor.translation();
    const double t = std::clamp((fellow_m - T_world_sensor.translation()).dot(way_m) / way_m.squaredNorm(), 0.0, 1.0);
    REQUIRE((T_world_sensor.translation() + t * way_m - fellow_m).norm() > 0.3 - 2.0 * kSurfaceBias_m);
  }
  sensor.set_fellows({}, 0.3);
  CHECK(on_fellow(sensor.capture(T_world_sensor, 0.0)) == 0);
}

TEST_CASE("A sensor that cannot exist is refused") {
  SensorModel model = camera();
  model.azimuth_fov_rad = rad_from_deg(200.0);
  CHECK_THROWS_AS(SimulatedSensor(nothing(), model, {}, 1, "x"), InputError);
  SensorNoise noise;
  noise.dropout = 1.5;
  CHECK_THROWS_AS(SimulatedSensor(nothing(), camera(), noise, 1, "x"), InputError);
  CHECK_THROWS_AS(SimulatedSensor(nullptr, camera(), {}, 1, "x"), std::invalid_argument);
}

}  // namespace
}  // namespace stairwell::sim3d
