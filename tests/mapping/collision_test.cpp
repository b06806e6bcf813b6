#include "mapping/collision.hpp"

#include "checkers/fcl_world.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "exact_overlap.hpp"
#include "mapping/octomap_io.hpp"
#include "mapping/scan_integrator.hpp"
#include "scribble.hpp"
#include "sim3d/ground_truth.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/world.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

constexpr double kGrazing_m = 1e-9;

GridSpec odd_grid(double resolution_m) {
  return {Aabb{Eigen::Vector3d(-1.7, 0.3, -0.9), Eigen::Vector3d(2.4, 3.2, 2.2)}, resolution_m};
}

/// Free and occupied strokes in unknown space.
OccupancyMap scribbled_map() {
  OccupancyMap map(odd_grid(0.1));
  Rng rng = make_rng(21, "collision scribble");
  scribble(rng, map, 260);
  return map;
}

/// What is truly there in one of our buildings; all of it known.
OccupancyMap true_map() {
  const sim3d::World world = sim3d::load_world(std::filesystem::path(STAIRWELL_SOURCE_DIR) / "worlds/duplex.sdf");
  const sim3d::GroundTruth truth(world, GridSpec(world.bounds.inflated(0.1), 0.1));
  OccupancyMap map(truth.grid());
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    map.set_log_odds(map.grid().voxel(i), truth.at(i) == sim3d::TruthClass::kFree ? -1.0F : 2.0F);
  }
  return map;
}

/// What a few lidar scans of the atrium make known of it.
OccupancyMap scanned_map() {
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

Eigen::Matrix3d random_rotation(Rng& rng) {
  const Eigen::Quaterniond q(rng.normal(), rng.normal(), rng.normal(), rng.normal());
  return q.normalized().toRotationMatrix();
}

/// Half of the poses are level, as a UAV's mostly are, which puts edges and faces parallel to the voxels'.
Pose random_pose(Rng& rng, const Aabb& box) {
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

CollisionShape random_shape(Rng& rng, int kind, double largest_m = 0.5) {
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

bool sticks_out(const GridSpec& grid, const CollisionShape& shape, const Pose& T_world_body) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_m(shape));
  return !grid.box().contains(T_world_body.translation() - reach) ||
         !grid.box().contains(T_world_body.translation() + reach);
}

std::string described(const CollisionShape& shape, const Pose& T_world_body) {
  std::ostringstream text;
  text.precision(17);
  text << "shape " << shape.index() << ", reach " << reach_m(shape) << " m, pose\n" << T_world_body.matrix();
  return text.str();
}

}  // namespace

TEST_CASE("collision checks agree with FCL", "[collision]") {
  // 15 000 poses for each of 4 shapes on each of 3 maps: 180 000 in all.
  const int which = GENERATE(0, 1, 2);
  const OccupancyMap map = which == 0 ? scribbled_map() : which == 1 ? true_map() : scanned_map();
  const Obstacles obstacles = which == 0 ? Obstacles::kBlocked : Obstacles::kOccupied;
  const Views views(map, obstacles);
  const auto tree = obstacles == Obstacles::kBlocked
                        ? checkers::obstacle_tree(map, obstacles)
                        : std::shared_ptr<const octomap::OcTree>(std::shared_ptr<void>(), &map.octree());
  Rng rng = make_rng(22, "collision fcl");
  std::size_t grazing = 0, hits = 0, compared = 0, disagreements = 0;
  for (int kind = 0; kind < 4; ++kind) {
    for (int round = 0; round < 50; ++round) {
      const CollisionShape shape = random_shape(rng, kind);
      const CollisionChecker checker = views.checker(shape);
      const CollisionChecker larger = views.checker(grown(shape, kGrazing_m));
      const CollisionChecker smaller = views.checker(grown(shape, -kGrazing_m));
      const checkers::FclOctree fcl(tree, shape);
      for (int i = 0; i < 300; ++i) {
        const Pose T_world_body = random_pose(rng, map.grid().box());
        if (obstacles == Obstacles::kBlocked && sticks_out(map.grid(), shape, T_world_body)) continue;
        if (larger.collides(T_world_body) != smaller.collides(T_world_body)) {
          ++grazing;
          continue;
        }
        const bool hit = checker.collides(T_world_body);
        ++compared;
        hits += hit ? 1 : 0;
        if (hit != fcl.collides(T_world_body)) {
          ++disagreements;
          UNSCOPED_INFO("found " << hit << ": " << described(shape, T_world_body));
        }
      }
    }
  }
  INFO("map " << which << ": " << compared << " compared, " << hits << " collide, " << grazing << " grazing left out");
  CHECK(disagreements == 0);
  CHECK(grazing < 10);
  CHECK(compared > (which == 0 ? 20000U : 59000U));
  CHECK(hits > compared / 20);
  CHECK(hits < compared - compared / 20);
}

TEST_CASE("collision checks agree with plain geometry, voxel by voxel", "[collision]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  const double resolution_m = GENERATE(0.1, 0.07);
  Rng rng = make_rng(23, "collision search");
  OccupancyMap map(odd_grid(resolution_m));
  scribble(rng, map, 260);
  const Views views(map, obstacles);
  std::size_t grazing = 0;
  for (int kind = 0; kind < 4; ++kind) {
    for (int round = 0; round < 1500; ++round) {
      const CollisionShape shape = random_shape(rng, kind, 0.4);
      // Beyond the grid as well.
      const Pose T_world_body = random_pose(rng, map.grid().box().inflated(0.3));
      const bool may = collides_by_search(map, obstacles, grown(shape, kGrazing_m), T_world_body);
      if (may != collides_by_search(map, obstacles, grown(shape, -kGrazing_m), T_world_body)) {
        ++grazing;
        continue;
      }
      INFO(described(shape, T_world_body));
      REQUIRE(views.checker(shape).collides(T_world_body) == may);
    }
  }
  CHECK(grazing < 5);
}

TEST_CASE("the distance field's word never contradicts the voxels", "[collision]") {
  // With a field of one cell's reach nothing but "in an obstacle" can be told from it: the words decide.
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  const OccupancyMap map = scribbled_map();
  const Views views(map, obstacles);
  DistanceField near_sighted(map.grid(), 0.1, obstacles);
  near_sighted.update(map);
  Rng rng = make_rng(24, "collision distance");
  for (int i = 0; i < 40000; ++i) {
    const CollisionShape shape = random_shape(rng, i % 4, 0.8);
    const Pose T_world_body = random_pose(rng, map.grid().box().inflated(0.1));
    const bool hit = CollisionChecker(views.words, near_sighted, shape).collides(T_world_body);
    INFO(described(shape, T_world_body));
    REQUIRE(views.checker(shape).collides(T_world_body) == hit);
  }
}

TEST_CASE("occupancy words hold what the map says", "[collision][words]") {
  const Obstacles obstacles = GENERATE(Obstacles::kOccupied, Obstacles::kBlocked);
  Rng rng = make_rng(25, "collision words");
  for (int round = 0; round < 6; ++round) {
    OccupancyMap map(odd_grid(rng.uniform(0.09, 0.14)));
    OccupancyWords kept(map.grid(), obstacles);
    for (int change = 0; change < 12; ++change) {
      scribble(rng, map, change % 3);
      if (change == 5) map.assume_free(map.grid().box().center_m(), 0.7);
      if (change == 8) {
        for (int i = 0; i < 50; ++i) map.set_log_odds(random_voxel(rng, map.grid()), std::nanf(""));
      }
      kept.update(map);
      for (int z = -2; z < map.grid().size()[2] + 2; ++z) {
        for (int y = -2; y < map.grid().size()[1] + 2; ++y) {
          for (int x = -2; x < map.grid().size()[0] + 2; ++x) {
            const VoxelIndex v{x, y, z};
            const bool obstacle = obstacles == Obstacles::kBlocked ? map.blocked(v) : map.at(v) == Occupancy::kOccupied;
            if (kept.at(v) != obstacle) FAIL("voxel " << x << " " << y << " " << z << " after change " << change);
          }
        }
      }
    }
    OccupancyWords rebuilt(map.grid(), obstacles);
    rebuilt.update(map);
    REQUIRE(kept.word_count() == rebuilt.word_count());
    for (int z = 0; z < kept.word_count()[2]; ++z) {
      for (int y = 0; y < kept.word_count()[1]; ++y) {
        const auto words = static_cast<std::size_t>(kept.word_count()[0]);
        REQUIRE(std::equal(kept.row(y, z), kept.row(y, z) + words, rebuilt.row(y, z)));
      }
    }
    // A bit a voxel, and at most one layer of words that stick out of the grid on either side.
    CHECK(static_cast<double>(kept.memory_bytes()) < 1.6 * static_cast<double>(map.grid().voxel_count()) / 8.0);
  }
}

TEST_CASE("occupancy words count real changes only and know their map", "[collision][words]") {
  OccupancyMap map(odd_grid(0.1));
  OccupancyWords words(map.grid(), Obstacles::kOccupied);
  words.update(map);
  CHECK(words.revision() == 0);
  map.update({3, 3, 3}, false);
  words.update(map);
  CHECK(words.revision() == 0);
  map.update({4, 4, 4}, true);
  words.update(map);
  CHECK(words.revision() == 1);
  CHECK_THROWS_AS(words.update(OccupancyMap(odd_grid(0.2))), InputError);
}

TEST_CASE("outside the grid is an obstacle for blocked, free for occupied", "[collision]") {
  OccupancyMap map(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(2.0)}, 0.1));
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) map.set_log_odds(map.grid().voxel(i), -1.0F);
  const Views blocked(map, Obstacles::kBlocked), occupied(map, Obstacles::kOccupied);
  const CollisionShape box = BoxShape{{0.4, 0.3, 0.2}};
  const auto at = [](double x, double y, double z) { return make_pose({x, y, z}); };
  CHECK_FALSE(blocked.checker(box).collides(at(0.4, 0.3, 0.2)));  // rests in the corner
  CHECK_FALSE(blocked.checker(box).collides(at(1.6, 1.7, 1.8)));
  CHECK(blocked.checker(box).collides(at(0.4 - 1e-6, 0.3, 0.2)));
  CHECK(blocked.checker(box).collides(at(1.6, 1.7, 1.8 + 1e-6)));
  CHECK(blocked.checker(box).collides(make_pose({0.4, 0.3, 0.2}, 0.01)));
  CHECK(blocked.checker(box).collides(at(-5.0, 1.0, 1.0)));
  CHECK(blocked.checker(box).collides(at(1.0, 1.0, 1e6)));
  CHECK(blocked.checker(box).collides_between(at(1.0, 1.0, 1.0), at(1.0, 1.0, 2.5)));
  CHECK_FALSE(occupied.checker(box).collides(at(-5.0, 1.0, 1.0)));
  CHECK_FALSE(occupied.checker(box).collides(at(1.0, 1.0, 1e6)));
  map.set_log_odds({0, 10, 10}, 2.0F);
  const Views post(map, Obstacles::kOccupied);
  CHECK(post.checker(box).collides(at(-0.39, 1.0, 1.0)));  // reaches in from outside
  CHECK_FALSE(post.checker(box).collides(at(-0.4, 1.0, 1.0)));
  for (const CollisionShape& shape : {box, CollisionShape(SphereShape{0.3})}) {
    CHECK(post.checker(shape).collides_between(at(-1e6, 1.05, 1.05), at(1e6, 1.05, 1.05)));
    CHECK_FALSE(post.checker(shape).collides_between(at(-1e6, 0.5, 0.5), at(1e6, 0.5, 0.5)));
    CHECK(post.checker(shape).collides_between(at(-3.0, -2.0, -2.0), at(4.0, 5.0, 5.0)));
    CHECK_FALSE(post.checker(shape).collides_between(at(-3.0, 3.0, 3.0), at(4.0, 3.0, 3.0)));
  }
}

TEST_CASE("poses and shapes that cannot be used are refused", "[collision]") {
  const OccupancyMap map(odd_grid(0.1));
  const Views views(map, Obstacles::kBlocked);
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (int kind = 0; kind < 4; ++kind) {
    Rng rng = make_rng(26, "collision bad");
    const CollisionChecker checker = views.checker(random_shape(rng, kind));
    const Pose fine = make_pose({0.5, 1.0, 0.5});
    for (const double bad : {nan, infinity, -infinity, 1e8}) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        Pose moved = fine;
        moved.translation()[axis] = bad;
        CHECK_THROWS_AS(checker.collides(moved), InputError);
        CHECK_THROWS_AS(checker.collides_between(moved, fine), InputError);
        CHECK_THROWS_AS(checker.collides_between(fine, moved), InputError);
      }
    }
    Pose turned = fine;
    turned.linear()(1, 2) = nan;
    CHECK_THROWS_AS(checker.collides(turned), InputError);
    CHECK_THROWS_AS(checker.collides_between(fine, fine, 0.0), InputError);
    CHECK_THROWS_AS(checker.collides_between(fine, fine, nan), InputError);
    CHECK_THROWS_AS(checker.free_fraction(turned, fine), InputError);
    CHECK_THROWS_AS(checker.free_fraction(fine, fine, 0.0), InputError);
  }
  for (const double bad : {0.0, -0.3, 1e-7, nan, infinity}) {
    CHECK_THROWS_AS(views.checker(SphereShape{bad}), InputError);
    CHECK_THROWS_AS(views.checker(BoxShape{{0.3, bad, 0.3}}), InputError);
    CHECK_THROWS_AS(views.checker(EllipsoidShape{{0.3, 0.3, bad}}), InputError);
    CHECK_THROWS_AS(views.checker(CylinderShape{0.3, bad}), InputError);
    CHECK_THROWS_AS(views.checker(CylinderShape{bad, 0.3}), InputError);
  }
  const Views others(map, Obstacles::kOccupied);
  CHECK_THROWS_AS(CollisionChecker(views.words, others.distance, SphereShape{0.3}), InputError);
  const Views coarse(OccupancyMap(odd_grid(0.2)), Obstacles::kBlocked);
  CHECK_THROWS_AS(CollisionChecker(views.words, coarse.distance, SphereShape{0.3}), InputError);
}

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
