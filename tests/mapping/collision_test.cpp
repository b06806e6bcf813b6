#include "mapping/collision.hpp"

#include "checkers/fcl_world.hpp"
#include "collision_scene.hpp"
#include "core/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

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
