#include "sim3d/ray_caster.hpp"

#include "core/units.hpp"
#include "test_meshes.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <vector>

namespace stairwell::sim3d {
namespace {

/// Moeller & Trumbore 1997 over all triangles, double precision.
double plain_distance_m(const TriangleMesh& mesh, const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                        double max_range_m, double edge_slack) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto [a, b, c] = test::corners_of(mesh, i);
    const Eigen::Vector3d e1 = b - a;
    const Eigen::Vector3d e2 = c - a;
    const Eigen::Vector3d p = direction.cross(e2);
    const double determinant = e1.dot(p);
    if (std::abs(determinant) < 1e-12) continue;
    const Eigen::Vector3d s = origin_m - a;
    const double u = s.dot(p) / determinant;
    const Eigen::Vector3d q = s.cross(e1);
    const double v = direction.dot(q) / determinant;
    const double t = e2.dot(q) / determinant;
    if (u < -edge_slack || v < -edge_slack || u + v > 1.0 + edge_slack || t < 0.0 || t > max_range_m) continue;
    nearest_m = std::min(nearest_m, t);
  }
  return nearest_m;
}

bool agrees(double found_m, double expected_m) {
  if (std::isinf(found_m) || std::isinf(expected_m)) return std::isinf(found_m) && std::isinf(expected_m);
  return std::abs(found_m - expected_m) < 1e-4 * std::max(1.0, expected_m);
}

std::vector<Eigen::Vector3f> random_directions(Rng& rng, std::size_t count) {
  std::vector<Eigen::Vector3f> directions;
  while (directions.size() < count) {
    const Eigen::Vector3d d = test::random_point(rng, 1.0);
    if (d.norm() > 0.1 && d.norm() < 1.0) directions.push_back(d.normalized().cast<float>());
  }
  return directions;
}

TEST_CASE("Embree finds the distances that a plain search finds") {
  Rng rng = make_rng(1, "ray caster");
  std::size_t hits = 0;
  for (int round = 0; round < 20; ++round) {
    const TriangleMesh mesh = test::random_mesh(rng, 60, 5.0, 2.0);
    const RayCaster caster(mesh);
    const Eigen::Vector3f origin_m = test::random_point(rng, 5.0).cast<float>();
    const auto directions = random_directions(rng, 203);  // not a multiple of a packet
    std::vector<float> fan_m(directions.size());
    caster.cast_from(origin_m, directions, 6.0f, fan_m);
    const std::vector<Eigen::Vector3f> origins_m(directions.size(), origin_m);
    const std::vector<float> ranges_m(directions.size(), 6.0f);
    std::vector<float> many_m(directions.size());
    caster.cast_many(origins_m, directions, ranges_m, many_m);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const auto plain = [&](double edge_slack) {
        return plain_distance_m(mesh, origin_m.cast<double>(), directions[i].cast<double>(), 6.0, edge_slack);
      };
      const double expected_m = plain(0.0);
      if (!agrees(plain(1e-5), expected_m) || !agrees(plain(-1e-5), expected_m)) continue;  // grazes an edge
      if (expected_m > 5.999 && expected_m < 6.001) continue;
      const RayHit hit = caster.cast(origin_m, directions[i], 6.0f);
      CAPTURE(round, i, expected_m, hit.distance_m, fan_m[i], many_m[i]);
      REQUIRE(agrees(static_cast<double>(hit.distance_m), expected_m));
      REQUIRE(agrees(static_cast<double>(fan_m[i]), expected_m));
      REQUIRE(agrees(static_cast<double>(many_m[i]), expected_m));
      REQUIRE(caster.occluded(origin_m, directions[i], 6.0f) == std::isfinite(expected_m));
      hits += std::isfinite(expected_m) ? 1 : 0;
      if (std::isinf(expected_m)) continue;
      const auto [a, b, c] = test::corners_of(mesh, hit.triangle);
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      REQUIRE(hit.normal.cast<double>().cross(normal).norm() < 1e-3 * normal.squaredNorm());
    }
  }
  CHECK(hits > 500);
}

TEST_CASE("No ray slips out of a closed box, not even through edges and corners") {
  const RayCaster caster(test::box_mesh({-2.0, -1.0, 0.0}, {2.0, 1.0, 2.5}));
  std::vector<Eigen::Vector3f> directions;
  const Eigen::Vector3f origin_m(0.3f, 0.2f, 1.1f);
  for (int i = 0; i <= 400; ++i) {
    const float s = static_cast<float>(i) / 400.0f;
    directions.push_back((Eigen::Vector3f(2.0f, 1.0f, 2.5f * s) - origin_m).normalized());
    directions.push_back((Eigen::Vector3f(-2.0f + 4.0f * s, -1.0f, 0.0f) - origin_m).normalized());
    directions.push_back((Eigen::Vector3f(-2.0f + 4.0f * s, -1.0f + 2.0f * s, 0.0f) - origin_m).normalized());
  }
  std::vector<float> distances_m(directions.size());
  caster.cast_from(origin_m, directions, 10.0f, distances_m);
  CHECK(std::all_of(distances_m.begin(), distances_m.end(), [](float d) { return std::isfinite(d); }));
}

/// All round, one column every 2 degrees, from -60 to 60 degrees.
std::vector<Eigen::Vector3f> panorama(int columns, int rows, double turned_rad) {
  std::vector<Eigen::Vector3f> directions;
  for (int row = 0; row < rows; ++row) {
    const double up_rad = kPi / 3.0 * (2.0 * row / (rows - 1) - 1.0);
    for (int column = 0; column < columns; ++column) {
      const double round_rad = turned_rad + 2.0 * kPi * column / columns;
      directions.push_back(Eigen::Vector3d(std::cos(up_rad) * std::cos(round_rad),
                                           std::cos(up_rad) * std::sin(round_rad), std::sin(up_rad))
                               .cast<float>());
    }
  }
  return directions;
}

TEST_CASE("A lattice of rays finds what the same rays find one by one") {
  std::vector<float> plain_m(180 * 61), lattice_m(180 * 61);
  Rng rng = make_rng(3, "ray caster");
  std::size_t differ = 0;
  std::size_t rays = 0;
  for (int round = 0; round < 60; ++round) {
    TriangleMesh mesh = test::box_mesh({-6.0, -5.0, 0.0}, {6.0, 5.0, 2.5});
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d lo_m = test::random_point(rng, 4.0);
      mesh.append(test::box_mesh({lo_m.x(), lo_m.y(), 0.0}, {lo_m.x() + 0.6, lo_m.y() + 0.8, 1.0 + 0.1 * i}));
    }
    const RayCaster caster(mesh);
    const Eigen::Vector3f origin_m = test::random_point(rng, 3.0).cast<float>().cwiseAbs().cwiseMin(2.4f);
    const auto directions = panorama(180, 61, rng.uniform());
    caster.cast_from(origin_m, directions, 8.0f, plain_m);
    caster.cast_lattice(origin_m, directions, 180, 8.0f, lattice_m);
    for (std::size_t i = 0; i < plain_m.size(); ++i)
      differ += agrees(static_cast<double>(lattice_m[i]), static_cast<double>(plain_m[i])) ? 0 : 1;
    rays += plain_m.size();
  }
  CAPTURE(differ, rays);
  CHECK(differ <= rays / 100000);  // those that graze a rim
}

TEST_CASE("Rays of a lattice that meet an edge of triangles do not slip through") {
  Rng rng = make_rng(4, "ray caster");
  for (int round = 0; round < 20; ++round) {
    const TriangleMesh mesh = test::box_mesh(Eigen::Vector3d(-2.0, -1.0, -1.5) - test::random_point(rng, 0.5),
                                             Eigen::Vector3d(2.0, 1.5, 1.0) + test::random_point(rng, 0.5));
    const RayCaster caster(mesh);
    const Eigen::Vector3f origin_m = test::random_point(rng, 0.3).cast<float>();
    for (int ray = 0; ray < 300; ++ray) {
      const auto [a, b, c] = test::corners_of(mesh, static_cast<std::size_t>(ray) % mesh.triangles.size());
      const Eigen::Vector3f edge_m = (a + rng.uniform() * (b - a)).cast<float>();
      const Eigen::Vector3f ahead = (edge_m - origin_m).normalized();
      const Eigen::Vector3f right = ahead.cross(Eigen::Vector3f::UnitZ()).normalized();
      std::vector<Eigen::Vector3f> directions;
      for (const float up : {-0.02f, 0.0f, 0.02f})
        for (const float side : {-0.02f, 0.0f, 0.02f})
          directions.push_back((ahead + side * right + up * right.cross(ahead)).normalized());
      directions[4] = ahead;
      std::vector<float> distances_m(9), plain_m(9);
      caster.cast_lattice(origin_m, directions, 3, 10.0f, distances_m);
      caster.cast_from(origin_m, directions, 10.0f, plain_m);
      for (std::size_t i = 0; i < 9; ++i) {
        CAPTURE(round, ray, i, plain_m[i], distances_m[i]);
        REQUIRE(agrees(static_cast<double>(distances_m[i]), static_cast<double>(plain_m[i])));
      }
    }
  }
}

TEST_CASE("An empty world has nothing to hit; wrong meshes and sizes are refused") {
  const RayCaster empty{TriangleMesh{}};
  CHECK(std::isinf(empty.cast({0, 0, 0}, {1, 0, 0}, 10.0f).distance_m));
  CHECK_FALSE(empty.occluded({0, 0, 0}, {1, 0, 0}, 10.0f));
  std::vector<float> distances_m(2, 1.0f);
  const std::vector<Eigen::Vector3f> directions{{1, 0, 0}, {0, 1, 0}};
  empty.cast_from({0, 0, 0}, directions, 10.0f, distances_m);
  CHECK(std::isinf(distances_m[1]));
  distances_m.pop_back();
  CHECK_THROWS_AS(empty.cast_from({0, 0, 0}, directions, 10.0f, distances_m), std::invalid_argument);
  CHECK_THROWS_AS(empty.cast_lattice({0, 0, 0}, directions, 2, 10.0f, distances_m), std::invalid_argument);
  distances_m.push_back(1.0f);
  CHECK_THROWS_AS(empty.cast_lattice({0, 0, 0}, directions, 3, 10.0f, distances_m), std::invalid_argument);
  empty.cast_lattice({0, 0, 0}, directions, 2, 10.0f, distances_m);
  CHECK(std::isinf(distances_m[0]));
  CHECK(std::isinf(distances_m[1]));
  TriangleMesh broken = test::box_mesh({0, 0, 0}, {1, 1, 1});
  broken.triangles[3][1] = 8;
  CHECK_THROWS_AS(RayCaster(broken), std::invalid_argument);
}

TEST_CASE("Threads share one ray caster and get the same answers") {
  Rng rng = make_rng(2, "ray caster");
  const RayCaster caster(test::random_mesh(rng, 500, 5.0, 1.0));
  const auto directions = random_directions(rng, 4000);
  std::vector<std::vector<float>> answers_m(4, std::vector<float>(directions.size()));
  std::vector<std::thread> threads;
  for (auto& answer_m : answers_m) {
    threads.emplace_back([&] { caster.cast_from({0, 0, 0}, directions, 8.0f, answer_m); });
  }
  for (auto& thread : threads) thread.join();
  for (const auto& answer_m : answers_m) CHECK(answer_m == answers_m.front());
}

}  // namespace
}  // namespace stairwell::sim3d
