#include "collision_scene.hpp"
#include "mapping/collision.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

TEST_CASE("a swept sphere hits what its capsule overlaps", "[collision][motion]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  const OccupancyMap map = scribbled_map();
  const GridSpec& grid = map.grid();
  const Views views(map, obstacles);
  Rng rng = make_rng(27, "collision capsule");
  std::size_t hits = 0, grazing = 0;
  const int rounds = 3000;
  for (int round = 0; round < rounds; ++round) {
    const double radius_m = rng.uniform(0.02, 0.3);
    const Pose from = random_pose(rng, grid.box().inflated(0.1));
    Pose to = random_pose(rng, grid.box().inflated(0.1));
    to.translation() = from.translation() + rng.uniform(0.0, 1.0) * (to.translation() - from.translation());
    if (round % 5 == 0) to.translation().tail<2>() = from.translation().tail<2>();
    // Nearest distance of the segment to any obstacle voxel, by ternary search: the distance is convex along it.
    const auto distance_m = [&](const Aabb& voxel, double u) {
      const Eigen::Vector3d p = (1.0 - u) * from.translation() + u * to.translation();
      return (p - p.cwiseMax(voxel.min_m).cwiseMin(voxel.max_m)).norm();
    };
    double nearest_m = std::numeric_limits<double>::infinity();
    for (int z = -5; z < grid.size()[2] + 5; ++z) {
      for (int y = -5; y < grid.size()[1] + 5; ++y) {
        for (int x = -5; x < grid.size()[0] + 5; ++x) {
          if (!views.words.at({x, y, z})) continue;
          const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(0.05);
          const Aabb voxel{grid.center_of({x, y, z}) - half_m, grid.center_of({x, y, z}) + half_m};
          const Aabb around = voxel.inflated(std::min(nearest_m, radius_m + 0.01));
          const Eigen::Vector3d lo = from.translation().cwiseMin(to.translation());
          const Eigen::Vector3d hi = from.translation().cwiseMax(to.translation());
          if (around.intersection({lo, hi}).empty()) continue;
          double begin = 0.0, end = 1.0;
          for (int i = 0; i < 90; ++i) {
            const double a = begin + (end - begin) / 3.0, b = end - (end - begin) / 3.0;
            (distance_m(voxel, a) < distance_m(voxel, b) ? end : begin) =
                distance_m(voxel, a) < distance_m(voxel, b) ? b : a;
          }
          nearest_m = std::min({nearest_m, distance_m(voxel, begin), distance_m(voxel, 0.0), distance_m(voxel, 1.0)});
        }
      }
    }
    if (std::abs(nearest_m - radius_m) < 1e-7) {
      ++grazing;
      continue;
    }
    INFO("radius " << radius_m << ", nearest " << nearest_m << ", from " << from.translation().transpose() << " to "
                   << to.translation().transpose());
    const bool hit = views.checker(SphereShape{radius_m}).collides_between(from, to);
    REQUIRE(hit == (nearest_m < radius_m));
    hits += hit ? 1 : 0;
  }
  CHECK(grazing < 10);
  CHECK(hits > rounds / 20);
  CHECK(hits < rounds - rounds / 20);
}

TEST_CASE("motions of other shapes never miss a hit and hardly ever make one up", "[collision][motion]") {
  const OccupancyMap map = true_map();
  const Views views(map, Obstacles::kBlocked);
  Rng rng = make_rng(28, "collision motion");
  const double tolerance_m = 0.002;
  std::size_t hits = 0, free = 0, made_up = 0;
  for (int round = 0; round < 1600; ++round) {
    const CollisionShape shape = random_shape(rng, round % 4, 0.3);
    const Pose from = random_pose(rng, map.grid().box().inflated(-0.4));
    Pose to = random_pose(rng, map.grid().box().inflated(-0.4));
    to.translation() = from.translation() + rng.uniform(0.0, 0.4) * (to.translation() - from.translation());
    if (round % 3 == 0) to.linear() = from.linear();
    const bool hit = views.checker(shape).collides_between(from, to, tolerance_m);
    const CollisionChecker checker = views.checker(shape);
    const CollisionChecker roomy = views.checker(grown(shape, 0.008));
    bool sampled = false, near = false;
    const Eigen::Quaterniond q_from(from.linear()), q_to(to.linear());
    for (int i = 0; i <= 600 && !sampled; ++i) {
      Pose at = Pose::Identity();
      at.translation() = from.translation() + i / 600.0 * (to.translation() - from.translation());
      at.linear() = q_from.slerp(i / 600.0, q_to).toRotationMatrix();
      sampled = checker.collides(at);
      near = near || roomy.collides(at);
    }
    INFO("from\n" << described(shape, from) << "\nto\n" << to.matrix());
    REQUIRE((hit || !sampled));
    REQUIRE((!hit || sampled || near));
    hits += hit ? 1 : 0;
    free += hit ? 0 : 1;
    made_up += hit && !sampled ? 1 : 0;
  }
  INFO(hits << " hit, " << free << " free, " << made_up << " of the hits between samples or made up");
  CHECK(hits > 100);
  CHECK(free > 100);
  CHECK(made_up < 20);
}

TEST_CASE("a thin ellipsoid's motions never miss a hit", "[collision][motion]") {
  const OccupancyMap map = true_map();
  const Views views(map, Obstacles::kOccupied);
  Rng rng = make_rng(29, "collision thin");
  std::size_t hits = 0;
  for (int round = 0; round < 3000; ++round) {
    Eigen::Vector3d semi_axes_m(0.03, 0.03, 0.03);
    semi_axes_m[round % 3] = rng.uniform(0.3, 0.9);
    const CollisionChecker checker = views.checker(EllipsoidShape{semi_axes_m});
    const Pose from = random_pose(rng, map.grid().box().inflated(-0.4));
    Pose to = random_pose(rng, map.grid().box().inflated(-0.4));
    to.translation() = from.translation() + rng.uniform(0.0, 0.2) * (to.translation() - from.translation());
    if (round % 2 == 0) to.linear() = from.linear();
    const double free = checker.free_fraction(from, to, 0.01);
    if (free == 0.0) continue;
    const Eigen::Quaterniond q_from(from.linear()), q_to(to.linear());
    for (int i = 0; i <= 300; ++i) {
      Pose at = Pose::Identity();
      at.translation() = from.translation() + free * i / 300.0 * (to.translation() - from.translation());
      at.linear() = q_from.slerp(free * i / 300.0, q_to).toRotationMatrix();
      hits += checker.collides(at) ? 1 : 0;
    }
  }
  CHECK(hits == 0);
}

TEST_CASE("a motion is free up to where it first comes near something", "[collision][motion]") {
  const OccupancyMap map = true_map();
  const Views views(map, Obstacles::kBlocked);
  Rng rng = make_rng(30, "collision fraction");
  const double tolerance_m = 0.002;
  std::size_t whole = 0, none = 0, part = 0;
  for (int round = 0; round < 1200; ++round) {
    const CollisionShape shape = random_shape(rng, round % 4, 0.3);
    const CollisionChecker checker = views.checker(shape);
    const Pose from = random_pose(rng, map.grid().box().inflated(-0.4));
    Pose to = random_pose(rng, map.grid().box().inflated(-0.4));
    if (round % 3 == 0) to.linear() = from.linear();
    if (round % 50 == 1) to = from;
    const auto at = [&](double u) {
      Pose T_world_body = Pose::Identity();
      T_world_body.translation() = from.translation() + u * (to.translation() - from.translation());
      T_world_body.linear() =
          Eigen::Quaterniond(from.linear()).slerp(u, Eigen::Quaterniond(to.linear())).toRotationMatrix();
      return T_world_body;
    };
    INFO(described(shape, from) << "\nto\n" << to.matrix());
    const double free = checker.free_fraction(from, to, tolerance_m);
    REQUIRE(free >= 0.0);
    REQUIRE(free <= 1.0);
    const CollisionChecker roomy = views.checker(grown(shape, 4.0 * tolerance_m));
    if (checker.collides(from)) REQUIRE(free == 0.0);
    if (free == 0.0) REQUIRE(roomy.collides(from));
    (free == 1.0 ? whole : free == 0.0 ? none : part) += 1;
    for (int i = 0; i <= 400 && free > 0.0; ++i) REQUIRE_FALSE(checker.collides(at(free * i / 400.0)));
    if (free == 1.0 || free == 0.0) continue;
    // Just beyond, something is within reach of the tolerance (the part in which it lies, and the bounds' slack).
    REQUIRE((roomy.collides(at(free)) || checker.collides(at(std::min(1.0, free + 1e-4)))));
    if (shape.index() == 0) {
      CHECK_FALSE(checker.collides_between(from, at(free)));
      const double length_m = (to.translation() - from.translation()).norm();
      CHECK(checker.collides_between(from, at(std::min(1.0, free + 1.01 * tolerance_m / length_m))));
    }
  }
  CHECK(whole > 20);
  CHECK(none > 100);
  CHECK(part > 100);
}
