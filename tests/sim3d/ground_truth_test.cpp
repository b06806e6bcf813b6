#include "sim3d/ground_truth.hpp"

#include "core/units.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/triangle_geometry.hpp"
#include "test_meshes.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

namespace stairwell::sim3d {
namespace {

/// Nearest of a dense lattice of points of the triangle: never below the true distance, and close to it.
double sampled_distance_m(const Triangle& t, const Eigen::Vector3d& p, int density) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= density; ++i) {
    for (int j = 0; i + j <= density; ++j) {
      const double u = static_cast<double>(i) / density;
      const double v = static_cast<double>(j) / density;
      nearest_m = std::min(nearest_m, (t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]) - p).norm());
    }
  }
  return nearest_m;
}

Triangle random_triangle(Rng& rng, double half_m) {
  return {test::random_point(rng, half_m), test::random_point(rng, half_m), test::random_point(rng, half_m)};
}

TEST_CASE("Distances to a triangle agree with a dense sampling of it") {
  Rng rng = make_rng(1, "triangles");
  for (int round = 0; round < 200; ++round) {
    const Triangle t = random_triangle(rng, 1.0);
    const Eigen::Vector3d p = test::random_point(rng, 2.0);
    const double found_m = std::sqrt(squared_distance_m2(t, p));
    const double sampled_m = sampled_distance_m(t, p, 200);
    REQUIRE(found_m <= sampled_m + 1e-9);
    REQUIRE(sampled_m - found_m < 0.02);
  }
  const Triangle line{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(2, 0, 0)};
  CHECK(squared_distance_m2(line, {1.5, 3, 0}) == Approx(9.0));
}

TEST_CASE("The cube that first touches a triangle agrees with a dense sampling of it") {
  Rng rng = make_rng(2, "triangles");
  for (int round = 0; round < 200; ++round) {
    const Triangle t = random_triangle(rng, 1.0);
    const Eigen::Vector3d p = test::random_point(rng, 1.5);
    double sampled_m = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 200; ++i) {
      for (int j = 0; i + j <= 200; ++j) {
        const Eigen::Vector3d at_m = t[0] + i / 200.0 * (t[1] - t[0]) + j / 200.0 * (t[2] - t[0]);
        sampled_m = std::min(sampled_m, (at_m - p).lpNorm<Eigen::Infinity>());
      }
    }
    const double found_m = cube_half_extent_m(t, p);
    REQUIRE(found_m <= sampled_m + 1e-9);
    REQUIRE(sampled_m - found_m < 0.02);
  }
}

TEST_CASE("A clipped triangle stays in its box and keeps its area") {
  Rng rng = make_rng(3, "triangles");
  for (int round = 0; round < 200; ++round) {
    const Triangle t = random_triangle(rng, 1.0);
    double area = 0.0;
    for (int octant = 0; octant < 8; ++octant) {  // eight boxes that tile the space around the triangle
      const Eigen::Vector3d lo((octant & 1) - 1.0, (octant >> 1 & 1) - 1.0, (octant >> 2 & 1) - 1.0);
      const Aabb box{lo, lo + Eigen::Vector3d::Ones()};
      const auto polygon = clip_to_box(t, box);
      for (const auto& corner : polygon) REQUIRE(box.inflated(1e-9).contains(corner));
      for (std::size_t i = 2; i < polygon.size(); ++i) {
        area += 0.5 * (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]).norm();
      }
    }
    REQUIRE(area == Approx(0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm()));
  }
}

TEST_CASE("Voxel classes agree with points sprinkled over the surfaces and with the exact test everywhere") {
  Rng rng = make_rng(4, "classes");
  for (int round = 0; round < 6; ++round) {
    const TriangleMesh mesh = test::random_mesh(rng, 12, 0.9, 0.8);
    const GridSpec grid({Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}, 0.1);
    const GroundTruth truth(test::world_of(mesh), grid);
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      double half_m = 1.0;
      for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
        half_m = std::min(half_m, cube_half_extent_m(triangle_of(mesh, k), grid.center_of(grid.voxel(i))));
      }
      const auto expected = half_m < 0.048    ? TruthClass::kSurface
                            : half_m <= 0.052 ? TruthClass::kBoundary
                                              : TruthClass::kFree;
      REQUIRE(truth.at(i) == expected);
    }
    std::vector<std::uint8_t> sprinkled(grid.voxel_count(), 0);
    for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
      const Triangle t = triangle_of(mesh, k);
      for (int n = 0; n < 20000; ++n) {
        double u = rng.uniform();
        double v = rng.uniform();
        if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
        const Eigen::Vector3d p = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
        if (grid.contains(p)) sprinkled[grid.linear(grid.index_of(p))] = 1;
      }
    }
    std::size_t surface = 0;
    std::size_t found = 0;
    for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
      if (sprinkled[i] != 0) REQUIRE(truth.at(i) != TruthClass::kFree);
      surface += truth.at(i) == TruthClass::kSurface ? 1 : 0;
      found += truth.at(i) == TruthClass::kSurface && sprinkled[i] != 0 ? 1 : 0;
    }
    CHECK(static_cast<double>(found) > 0.97 * static_cast<double>(surface));
  }
}

TEST_CASE("A surface on a voxel face makes both sides boundary; a slanted or inner one is a surface") {
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2, 2, 2)}, 0.1);
  const GroundTruth truth(test::world_of(test::box_mesh({0.5, 0.5, 0.5}, {1.5, 1.5, 1.33})), grid);
  CHECK(truth.at({4, 10, 10}) == TruthClass::kBoundary);
  CHECK(truth.at({5, 10, 10}) == TruthClass::kBoundary);
  CHECK(truth.at({3, 10, 10}) == TruthClass::kFree);
  CHECK(truth.at({6, 10, 10}) == TruthClass::kFree);
  CHECK(truth.at({10, 10, 13}) == TruthClass::kSurface);
  CHECK(truth.at({10, 10, 12}) == TruthClass::kFree);
  CHECK(truth.at({10, 10, 14}) == TruthClass::kFree);
}

TEST_CASE("Spheres and clearances agree with all triangles, inside the grid and far outside") {
  Rng rng = make_rng(5, "clearance");
  const TriangleMesh mesh = test::random_mesh(rng, 40, 4.0, 1.0);
  const GroundTruth truth(test::world_of(mesh), GridSpec({Eigen::Vector3d(-2, -2, -1), Eigen::Vector3d(2, 2, 1)}, 0.1));
  int free = 0;
  for (int round = 0; round < 2000; ++round) {
    const Eigen::Vector3d p = test::random_point(rng, round % 4 == 0 ? 8.0 : 2.0);
    double nearest_m = 1e9;
    for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
      nearest_m = std::min(nearest_m, std::sqrt(squared_distance_m2(triangle_of(mesh, k), p)));
    }
    const double radius_m = rng.uniform(0.0, 1.0);
    REQUIRE(truth.sphere_free(p, radius_m) == (nearest_m > radius_m));
    REQUIRE(truth.clearance_m(p, 1.5) == Approx(std::min(nearest_m, 1.5)));
    REQUIRE(truth.clearance_m(p, 100.0) == Approx(nearest_m));
    free += nearest_m > radius_m ? 1 : 0;
  }
  CHECK(free > 200);
  CHECK(free < 1800);
}

Robot robot_of(double radius_m) {
  Robot robot;
  robot.radius_m = radius_m;
  return robot;
}

TEST_CASE("Reachable space agrees with a plain flood with exact spheres") {
  Rng rng = make_rng(6, "reachable");
  for (const double radius_m : {0.05, 0.17, 0.3}) {
    TriangleMesh mesh = test::box_mesh({-1.51, -1.47, 0.02}, {1.53, 1.52, 1.98});
    test::add(mesh, test::random_mesh(rng, 8, 1.2, 0.6));
    // The wall at y = 1.52 m is just outside the grid and still in the way.
    const GridSpec grid({Eigen::Vector3d(-2, -2, 0), Eigen::Vector3d(2, 1.5, 2)}, 0.1);
    const GroundTruth truth(test::world_of(mesh), grid);
    const Aabb flight_box{Eigen::Vector3d(-1.8, -1.8, 0.3), Eigen::Vector3d(1.2, 1.8, 1.8)};
    Eigen::Vector3d start_m(0, 0, 1);
    while (!truth.sphere_free(start_m, radius_m + 0.1)) {
      start_m = Eigen::Vector3d(0, 0, 1) + 0.5 * test::random_point(rng, 1.0).cwiseProduct(Eigen::Vector3d(2, 2, 1));
    }
    const auto found = truth.reachable({start_m}, robot_of(radius_m), flight_box);

    std::vector<std::uint8_t> plain(grid.voxel_count(), 0);
    std::vector<VoxelIndex> open{grid.index_of(start_m)};
    REQUIRE(truth.sphere_free(grid.center_of(open[0]), radius_m));
    plain[grid.linear(open[0])] = 1;
    while (!open.empty()) {
      const VoxelIndex v = open.back();
      open.pop_back();
      for (const VoxelIndex step : {VoxelIndex{1, 0, 0}, VoxelIndex{-1, 0, 0}, VoxelIndex{0, 1, 0},
                                    VoxelIndex{0, -1, 0}, VoxelIndex{0, 0, 1}, VoxelIndex{0, 0, -1}}) {
        const VoxelIndex to = v + step;
        if (!grid.contains(to) || plain[grid.linear(to)] != 0) continue;
        const Eigen::Vector3d center_m = grid.center_of(to);
        if (!flight_box.contains(center_m) || !truth.sphere_free(center_m, radius_m)) continue;
        plain[grid.linear(to)] = 1;
        open.push_back(to);
      }
    }
    CHECK((found == plain));
    CHECK(std::accumulate(found.begin(), found.end(), 0) > 100);
  }
}

/// Two rooms side by side (walls 0.1 m, off the lattice), a closed box in the first, a niche in its wall.
TriangleMesh two_rooms() {
  TriangleMesh mesh = test::box_mesh({0.03, 0.03, 0.03}, {3.03, 3.03, 2.43});  // room A
  test::add(mesh, test::box_mesh({3.13, 0.03, 0.03}, {5.03, 3.03, 2.43}));     // room B
  test::add(mesh, test::box_mesh({1.03, 1.03, 0.03}, {1.73, 1.73, 0.83}));     // closed box in room A
  return mesh;
}

SensorModel wide_camera() {
  SensorModel model;
  model.azimuth_fov_rad = rad_from_deg(90.0);
  model.elevation_lo_rad = rad_from_deg(-36.87);
  model.elevation_hi_rad = rad_from_deg(36.87);
  return model;
}

TEST_CASE("A start on the ground, a start in a wall and a shut-off room") {
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5.1, 3.1, 2.5)}, 0.1);
  const GroundTruth truth(test::world_of(two_rooms()), grid);
  const Robot robot = robot_of(0.2);
  const auto flown = truth.reachable({{0.6, 0.6, 1.0}}, robot, grid.box());
  CHECK((truth.reachable({{0.6, 0.6, 0.03}}, robot, grid.box()) == flown));
  CHECK(flown[grid.linear(grid.index_of({2.5, 2.5, 1.0}))] == 1);
  CHECK(flown[grid.linear(grid.index_of({4.0, 1.5, 1.0}))] == 0);
  CHECK(flown[grid.linear(grid.index_of({1.4, 1.4, 0.4}))] == 0);
  const auto nothing = truth.reachable({{1.38, 1.38, 0.4}}, robot_of(0.4), grid.box());
  CHECK(std::accumulate(nothing.begin(), nothing.end(), 0) == 0);
  CHECK((truth.reachable({{900.0, 0.0, 0.0}}, robot, grid.box()) == nothing));
  CHECK((truth.reachable({{std::nan(""), 0.0, 0.0}}, robot, grid.box()) == nothing));
  CHECK((truth.reachable({}, robot, grid.box()) == nothing));
  const RayCaster caster(truth.mesh());
  CHECK((truth.explorable(nothing, caster, wide_camera(), grid.box()) == nothing));
}

TEST_CASE("Explorable: the room, its corners and walls and a niche; not the next room nor inside a closed box") {
  TriangleMesh mesh = two_rooms();
  // A box without its +x side: a niche too narrow to enter.
  TriangleMesh niche = test::box_mesh({0.03, 2.23, 0.83}, {0.73, 2.53, 1.13});
  std::erase_if(niche.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t c) { return niche.vertices_m[c].x() > 0.7f; });
  });
  REQUIRE(niche.triangles.size() == 10);
  test::add(mesh, niche);
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5.1, 3.1, 2.5)}, 0.1);
  const GroundTruth truth(test::world_of(mesh), grid);
  const RayCaster caster(mesh);
  const auto reachable = truth.reachable({{0.6, 0.6, 1.0}}, robot_of(0.2), grid.box());
  const auto explorable = truth.explorable(reachable, caster, wide_camera(), grid.box());
  const auto seen = [&](double x, double y, double z) {
    return explorable[grid.linear(grid.index_of({x, y, z}))] == 1;
  };
  for (std::size_t i = 0; i < reachable.size(); ++i) REQUIRE(explorable[i] >= reachable[i]);
  CHECK(seen(0.15, 0.15, 0.15));      // free corner
  CHECK(seen(1.5, 0.5, 0.05));        // floor
  CHECK(seen(3.05, 1.5, 1.0));        // wall
  CHECK(seen(1.4, 1.4, 0.85));        // top of the closed box
  CHECK(seen(0.55, 2.38, 0.98));      // in the niche
  CHECK(seen(0.05, 2.38, 0.98));      // its end
  CHECK_FALSE(seen(1.4, 1.4, 0.45));  // inside the closed box
  CHECK_FALSE(seen(4.0, 1.5, 1.0));   // the next room
  CHECK_FALSE(seen(3.15, 1.5, 1.0));  // its wall
  const Aabb half{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5.1, 1.5, 2.5)};
  const auto cut = truth.explorable(reachable, caster, wide_camera(), half);
  for (std::size_t i = 0; i < cut.size(); ++i) {
    REQUIRE(cut[i] == (half.contains(grid.center_of(grid.voxel(i))) ? explorable[i] : 0));
  }
}

TEST_CASE("Explorable: range and elevation limits count") {
  const TriangleMesh mesh = test::box_mesh({0.03, 0.03, 0.03}, {8.03, 2.03, 2.43});
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(8.1, 2.1, 2.5)}, 0.1);
  const GroundTruth truth(test::world_of(mesh), grid);
  const RayCaster caster(mesh);
  const Aabb near_end{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.0, 2.1, 1.2)};
  const auto reachable = truth.reachable({{0.6, 1.0, 1.0}}, robot_of(0.2), near_end);
  SensorModel model = wide_camera();
  model.max_range_m = 3.0;
  const auto at = [&](const std::vector<std::uint8_t>& marks, double x, double y, double z) {
    return marks[grid.linear(grid.index_of({x, y, z}))] == 1;
  };
  const auto explorable = truth.explorable(reachable, caster, model, grid.box());
  CHECK(at(explorable, 3.5, 1.0, 1.0));
  CHECK_FALSE(at(explorable, 4.2, 1.0, 1.0));
  CHECK(at(explorable, 2.5, 1.0, 2.15));
  model.elevation_hi_rad = rad_from_deg(5.0);
  const auto low = truth.explorable(reachable, caster, model, grid.box());
  CHECK(at(low, 3.5, 1.0, 1.0));
  CHECK_FALSE(at(low, 2.5, 1.0, 2.15));
}

TEST_CASE("Explorable: of a wall on a voxel face only the side that holds the returns counts") {
  const TriangleMesh mesh = test::box_mesh({0.5, 0.5, 0.5}, {2.5, 2.5, 2.5});
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3, 3, 3)}, 0.1);
  const GroundTruth truth(test::world_of(mesh), grid);
  const RayCaster caster(mesh);
  const auto reachable = truth.reachable({{1.5, 1.5, 0.5}}, robot_of(0.3), grid.box());
  CHECK(reachable[grid.linear({15, 15, 15})] == 1);
  const auto explorable = truth.explorable(reachable, caster, wide_camera(), grid.box());
  const auto seen = [&](const VoxelIndex& v) { return explorable[grid.linear(v)] == 1; };
  for (const int n : {8, 15, 21}) {
    CHECK(seen({4, n, n}));
    CHECK(seen({n, n, 25}));
    CHECK_FALSE(seen({5, n, n}));
    CHECK_FALSE(seen({n, n, 24}));
    CHECK(seen({6, n, n}));
    CHECK_FALSE(seen({3, n, n}));
  }
}

TEST_CASE("Explorable: open space that no pose has a line of sight to does not count") {
  TriangleMesh mesh = test::box_mesh({0.03, 0.03, 0.03}, {3.03, 3.03, 2.43});
  // Open towards the wall at x = 3.03 m, through a gap that the robot does not fit into.
  TriangleMesh pocket = test::box_mesh({1.23, 1.03, 0.83}, {2.83, 1.43, 1.23});
  std::erase_if(pocket.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t c) { return pocket.vertices_m[c].x() > 2.8f; });
  });
  test::add(mesh, pocket);
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3.1, 3.1, 2.5)}, 0.1);
  const GroundTruth truth(test::world_of(mesh), grid);
  const auto reachable = truth.reachable({{0.6, 0.6, 1.0}}, robot_of(0.2), grid.box());
  const auto explorable = truth.explorable(reachable, RayCaster(mesh), wide_camera(), grid.box());
  CHECK(explorable[grid.linear(grid.index_of({2.95, 1.25, 1.05}))] == 1);
  CHECK(explorable[grid.linear(grid.index_of({1.55, 1.25, 1.05}))] == 0);
  CHECK(explorable[grid.linear(grid.index_of({1.25, 1.25, 1.05}))] == 1);  // its back wall, from outside
}

TEST_CASE("What a sensor returns from reachable places is explorable") {
  const TriangleMesh mesh = two_rooms();
  const GridSpec grid({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5.1, 3.1, 2.5)}, 0.1);
  const GroundTruth truth(test::world_of(mesh), grid);
  const auto caster = std::make_shared<const RayCaster>(mesh);
  const auto reachable = truth.reachable({{0.6, 0.6, 1.0}}, robot_of(0.2), grid.box());
  const auto explorable = truth.explorable(reachable, *caster, wide_camera(), grid.box());
  SimulatedSensor sensor(caster, wide_camera(), {}, 1, "check");
  Rng rng = make_rng(7, "check");
  std::vector<std::uint8_t> hit(grid.voxel_count(), 0);
  for (std::size_t i = 0; i < reachable.size(); ++i) {
    if (reachable[i] == 0 || rng.uniform() > 0.03) continue;
    const Scan scan = sensor.capture(make_pose(grid.center_of(grid.voxel(i)), rng.uniform(-kPi, kPi)), 0.0);
    for (const auto& p : scan.points_m) {
      if (static_cast<double>(p.norm()) > scan.max_range_m) continue;
      hit[grid.linear(grid.index_of(scan.T_world_sensor * p.cast<double>()))] = 1;
    }
  }
  std::size_t hits = 0;
  std::size_t missing = 0;
  std::size_t surface = 0;
  for (std::size_t i = 0; i < hit.size(); ++i) {
    hits += hit[i];
    missing += hit[i] != 0 && explorable[i] == 0 ? 1 : 0;
    surface += explorable[i] != 0 && truth.at(i) == TruthClass::kSurface ? 1 : 0;
  }
  CHECK(static_cast<double>(missing) <= 0.002 * static_cast<double>(hits));
  CHECK(static_cast<double>(hits) >= 0.97 * static_cast<double>(surface));
}

}  // namespace
}  // namespace stairwell::sim3d
