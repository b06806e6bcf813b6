#include "core/errors.hpp"
#include "mapping/potential_volume.hpp"
#include "potential_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

GridSpec random_grid(Rng& rng, int max_cells) {
  const double resolution_m = 0.1;
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min_m[axis] = resolution_m * rng.uniform_int(-40, 20);
    box.max_m[axis] = box.min_m[axis] + resolution_m * rng.uniform_int(1, max_cells);
  }
  return {box, resolution_m};
}

GridSpec four_metres() { return {{Eigen::Vector3d(-2.0, -1.0, 0.0), Eigen::Vector3d(2.0, 3.0, 2.0)}, 0.1}; }

Eigen::Vector3d random_point(Rng& rng, const GridSpec& grid, double beyond_m) {
  const Aabb box = grid.box().inflated(beyond_m);
  Eigen::Vector3d point_m;
  for (int axis = 0; axis < 3; ++axis) point_m[axis] = rng.uniform(box.min_m[axis], box.max_m[axis]);
  return point_m;
}

PotentialModelConfig random_config(Rng& rng, RepulsionForm form) {
  PotentialModelConfig config;
  config.form = form;
  config.coarse_factor = rng.uniform_int(1, 5);
  config.window_m = {rng.uniform(0.1, 4.0), rng.uniform(0.1, 4.0), rng.uniform(0.1, 3.0)};
  config.potential.k_rep = rng.uniform(0.0, 50.0);
  config.potential.sigma_m = rng.uniform(0.1, 0.5);
  config.potential.reach_m = rng.uniform(0.05, 0.9);
  config.potential.k_exp = rng.uniform_int(0, 1) * 0.7;
  config.potential.reach_mobile_m = rng.uniform(0.3, 1.5);
  return config;
}

PotentialBump random_bump(Rng& rng, const GridSpec& grid) {
  return {random_point(rng, grid, 0.5), rng.uniform(-2.0, 5.0), rng.uniform(0.1, 0.5), rng.uniform(0.1, 1.0)};
}

/// One thing that may happen between two steps of Alg. 4.1.
void disturb(Rng& rng, PotentialScene& scene, std::vector<PotentialBump>& bumps) {
  const GridSpec& grid = scene.map.grid();
  switch (rng.uniform_int(0, 9)) {
    case 0:
      scene.goal_m = rng.uniform_int(0, 3) == 0 ? no_point() : random_point(rng, grid, 3.0);
      break;
    case 1:
      scene.center_m = random_point(rng, grid, 2.0);
      break;
    case 2:
    case 3:
    case 4:
      if (!scene.center_m.allFinite()) scene.center_m = grid.box().center_m();
      scene.center_m += Eigen::Vector3d(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-0.2, 0.2));
      break;
    case 5:
      scene.mobile_m.clear();
      for (int i = rng.uniform_int(0, 3); i > 0; --i) scene.mobile_m.push_back(random_point(rng, grid, 1.0));
      break;
    case 6:
      for (Eigen::Vector3d& at_m : scene.mobile_m) at_m += Eigen::Vector3d(0.07, -0.03, 0.01);
      break;
    case 7:
      for (int i = 0; i < 60; ++i) scene.map.set_log_odds(random_voxel(rng, grid), std::nanf(""));
      break;
    case 8:
      if (rng.uniform_int(0, 2) == 0) {
        bumps.clear();
        scene.model.clear_experience();
      } else {
        bumps.push_back(random_bump(rng, grid));
        scene.model.add_experience(bumps.back());
      }
      break;
    default:
      scribble(rng, scene.map, rng.uniform_int(1, 3));
  }
}

bool equal(const PotentialLayers& a, const PotentialLayers& b) {
  if (!(a.window().lo == b.window().lo) || !(a.window().hi == b.window().hi)) return false;
  bool same = true;
  for_each_cell(a.window(), [&](const VoxelIndex& v) {
    for (const PotentialLayer layer : kAllLayers) same = same && a.at(layer, v) == b.at(layer, v);
  });
  return same;
}

}  // namespace

TEST_CASE("potential layers kept up to date are bitwise those made afresh", "[potential]") {
  const RepulsionForm form = GENERATE(RepulsionForm::kSummed, RepulsionForm::kNearest);
  Rng rng = make_rng(form == RepulsionForm::kSummed ? 50 : 51, "potential-increments");
  for (int round = 0; round < 25; ++round) {
    PotentialScene kept(random_grid(rng, 45), random_config(rng, form));
    std::vector<PotentialBump> bumps;
    scribble(rng, kept.map, 20);
    for (int step = 0; step < 25; ++step) {
      for (int i = rng.uniform_int(0, 2); i > 0; --i) disturb(rng, kept, bumps);
      kept.update();
      PotentialScene fresh(kept.map.grid(), kept.config);
      fresh.obstacles.update(kept.map);
      for (const PotentialBump& bump : bumps) fresh.model.add_experience(bump);
      fresh.model.update(kept.map, fresh.obstacles, {kept.center_m, kept.goal_m, kept.mobile_m}, &kept.field);
      REQUIRE(equal(kept.model.fine(), fresh.model.fine()));
      REQUIRE(equal(kept.model.coarse(), fresh.model.coarse()));
    }
  }
}

TEST_CASE("potential layers follow their equations", "[potential]") {
  Rng rng = make_rng(52, "potential-equations");
  for (int round = 0; round < 6; ++round) {
    PotentialScene scene(random_grid(rng, 30), random_config(rng, RepulsionForm::kSummed));
    scribble(rng, scene.map, 15);
    scene.goal_m = random_point(rng, scene.map.grid(), 1.0);
    scene.center_m = random_point(rng, scene.map.grid(), 1.0);
    scene.mobile_m = {random_point(rng, scene.map.grid(), 0.5), no_point(), random_point(rng, scene.map.grid(), 0.5)};
    const PotentialBump bump = random_bump(rng, scene.map.grid());
    scene.model.add_experience(bump);
    scene.update();
    const PotentialConfig& config = scene.config.potential;
    for (const bool coarse : {false, true}) {
      const PotentialLayers& layers = coarse ? scene.model.coarse() : scene.model.fine();
      const ObstacleLattice& obstacles = coarse ? scene.obstacles.coarse() : scene.obstacles.fine();
      const GridSpec& lattice = layers.lattice();
      int count = 0;
      for_each_cell(layers.window(), [&](const VoxelIndex& v) {
        if (++count % 7 != 0) return;
        const Eigen::Vector3d at_m = lattice.center_of(v);
        double repulsive = 0.0;
        int in_reach = 0;
        for_each_cell(whole(lattice), [&](const VoxelIndex& o) {
          const VoxelIndex d = o - v;
          const double distance_m = lattice.resolution_m() * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
          if (!obstacles.at(o) || distance_m >= config.reach_m) return;
          repulsive += gauss(config.k_rep, config.sigma_m, config.reach_m, distance_m);
          ++in_reach;
        });
        REQUIRE(std::abs(layers.at(PotentialLayer::kRepulsive, v) - repulsive) <=
                0.5 * layers.repulsion_unit() * in_reach + 1e-12 * repulsive);
        const double attractive = config.k_attr * (at_m - scene.goal_m).norm();
        REQUIRE(layers.at(PotentialLayer::kAttractive, v) == Approx(attractive).margin(1e-5));
        const bool known = scene.map.at(at_m) != Occupancy::kUnknown;
        const double experience =
            (known ? config.k_exp : 0.0) + gauss(bump.gain, bump.sigma_m, bump.reach_m, (at_m - bump.center_m).norm());
        REQUIRE(layers.at(PotentialLayer::kExperience, v) == Approx(experience).margin(1e-5));
        double mobile = 0.0;
        for (const Eigen::Vector3d& other_m : {scene.mobile_m[0], scene.mobile_m[2]}) {
          mobile += gauss(config.k_mobile, config.sigma_mobile_m, config.reach_mobile_m, (at_m - other_m).norm());
        }
        REQUIRE(layers.at(PotentialLayer::kMobile, v) == Approx(mobile).margin(1e-5));
        REQUIRE(layers.at(PotentialLayer::kTotal, v) ==
                Approx(attractive + repulsive + experience + mobile).epsilon(1e-5).margin(1e-4));
      });
    }
  }
}

TEST_CASE("a coarse cell is an obstacle while one of its voxels is", "[potential]") {
  Rng rng = make_rng(53, "potential-coarse");
  for (int round = 0; round < 10; ++round) {
    OccupancyMap map(random_grid(rng, 30));
    const int factor = rng.uniform_int(1, 5);
    PotentialObstacles obstacles(map.grid(), factor);
    for (int step = 0; step < 4; ++step) {
      scribble(rng, map, 6);
      for (int i = 0; i < 200; ++i) map.set_log_odds(random_voxel(rng, map.grid()), std::nanf(""));
      obstacles.update(map);
      std::vector<int> expected(obstacles.coarse().grid().voxel_count(), 0);
      for_each_cell(whole(map.grid()), [&](const VoxelIndex& v) {
        const bool occupied = map.at(v) == Occupancy::kOccupied;
        REQUIRE(obstacles.fine().at(v) == occupied);
        const VoxelIndex cell = obstacles.coarse().grid().index_of(map.grid().center_of(v));
        expected[obstacles.coarse().grid().linear(cell)] |= occupied ? 1 : 0;
      });
      for (std::size_t i = 0; i < expected.size(); ++i) {
        REQUIRE(obstacles.coarse().at(obstacles.coarse().grid().voxel(i)) == (expected[i] != 0));
      }
    }
  }
}

TEST_CASE("both forms of repulsion are the same with one obstacle in reach", "[potential]") {
  PotentialModelConfig config;
  config.potential.reach_m = 0.8;
  config.window_m = {9.0, 9.0, 9.0};
  PotentialScene summed(four_metres(), config);
  config.form = RepulsionForm::kNearest;
  PotentialScene nearest(four_metres(), config);
  Rng rng = make_rng(54, "potential-forms");
  std::vector<VoxelIndex> placed;
  for (int i = 0; i < 6; ++i) {
    placed.push_back(random_voxel(rng, summed.map.grid()));
    summed.map.update(placed.back(), true);
    nearest.map.update(placed.back(), true);
  }
  summed.update();
  nearest.update();
  int alone = 0, shared = 0;
  for (const bool coarse : {false, true}) {
    const PotentialLayers& a = coarse ? summed.model.coarse() : summed.model.fine();
    const PotentialLayers& b = coarse ? nearest.model.coarse() : nearest.model.fine();
    const ObstacleLattice& obstacles = coarse ? summed.obstacles.coarse() : summed.obstacles.fine();
    const GridSpec& lattice = a.lattice();
    for_each_cell(a.window(), [&](const VoxelIndex& v) {
      int in_reach = 0;
      const int reach = 9;
      for_each_cell({v - VoxelIndex{reach, reach, reach}, v + VoxelIndex{reach, reach, reach}},
                    [&](const VoxelIndex& o) {
                      const VoxelIndex d = o - v;
                      const double distance_m = lattice.resolution_m() * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
                      in_reach += obstacles.at(o) && distance_m < config.potential.reach_m ? 1 : 0;
                    });
      const double one = a.at(PotentialLayer::kRepulsive, v);
      const double other = b.at(PotentialLayer::kRepulsive, v);
      if (in_reach <= 1) {
        REQUIRE(one == other);
        REQUIRE((in_reach == 0) == (one == 0.0));
        alone += in_reach;
      } else {
        REQUIRE(one > other);
        ++shared;
      }
    });
  }
  CHECK(alone > 1000);
  CHECK(shared > 100);
}

TEST_CASE("the nearest-obstacle layers are the potential volume at voxel centres", "[potential]") {
  Rng rng = make_rng(55, "potential-volume");
  PotentialModelConfig config;
  config.form = RepulsionForm::kNearest;
  config.potential.k_exp = 0.7;
  PotentialScene scene(four_metres(), config);
  scribble(rng, scene.map, 25);
  scene.goal_m = {1.0, 2.0, 1.0};
  scene.mobile_m = {{0.5, 0.5, 0.5}, {-1.0, 0.0, 1.5}};
  scene.update();
  PotentialVolume volume(scene.map, scene.field, config.potential);
  volume.set_goal(scene.goal_m);
  volume.set_mobile(scene.mobile_m);
  for_each_cell(scene.model.fine().window(), [&](const VoxelIndex& v) {
    const Eigen::Vector3d at_m = scene.map.grid().center_of(v);
    REQUIRE(scene.model.fine().at(PotentialLayer::kTotal, v) == Approx(volume.value(at_m)).margin(1e-5));
    REQUIRE(scene.model.fine().at(PotentialLayer::kRepulsive, v) == Approx(volume.repulsive(v)).margin(1e-6));
  });
}

TEST_CASE("a potential's window stays within the box", "[potential]") {
  PotentialModelConfig config;
  config.window_m = {2.0, 9.0, 0.5};
  PotentialScene scene(four_metres(), config);
  scene.update();  // an empty map, no position, no goal
  const PotentialLayers& fine = scene.model.fine();
  CHECK(fine.window_cells() == std::array<int, 3>{21, 40, 5});  // odd where the box allows it; cut to the box
  CHECK(fine.window().lo == VoxelIndex{0, 0, 0});
  for_each_cell(fine.window(), [&](const VoxelIndex& v) {
    for (const PotentialLayer layer : kAllLayers) REQUIRE(fine.at(layer, v) == 0.0);
  });
  scene.center_m = {0.05, 0.05, 1.05};
  scene.update();
  CHECK(fine.window().lo == VoxelIndex{10, 0, 8});
  scene.center_m = {0.05, 0.05, 1e300};
  scene.update();
  CHECK(fine.window().lo == VoxelIndex{10, 0, 15});
  scene.center_m = {-100.0, 0.05, 1.05};
  scene.update();
  CHECK(fine.window().lo == VoxelIndex{0, 0, 8});
  scene.center_m = no_point();
  scene.update();
  CHECK(fine.window().lo == VoxelIndex{0, 0, 8});
}

TEST_CASE("goals that are nowhere attract nobody", "[potential]") {
  PotentialScene scene(four_metres(), {});
  const auto attraction = [&] { return scene.model.fine().at(PotentialLayer::kAttractive, {3, 3, 3}); };
  scene.goal_m = {0.0, 0.0, 0.0};
  scene.update();
  CHECK(attraction() > 0.0);
  scene.goal_m.y() = std::numeric_limits<double>::infinity();
  scene.update();
  CHECK(attraction() == 0.0);
  scene.goal_m.y() = 1e5;
  scene.update();
  CHECK(attraction() == Approx(1e5).epsilon(1e-3));
  scene.goal_m.y() = 1e7;
  scene.update();
  CHECK(attraction() == 0.0);
}

TEST_CASE("a missed update of the obstacles is made up for", "[potential]") {
  PotentialScene scene(four_metres(), {});
  scene.update();
  scene.map.update({5, 5, 5}, true);
  scene.obstacles.update(scene.map);
  scene.map.update({25, 25, 10}, true);
  scene.update();
  CHECK(scene.model.fine().at(PotentialLayer::kRepulsive, {5, 5, 6}) > 0.0);
  CHECK(scene.model.fine().at(PotentialLayer::kRepulsive, {25, 25, 11}) > 0.0);
  CHECK(scene.model.coarse().at(PotentialLayer::kRepulsive, {1, 1, 1}) > 0.0);
}

TEST_CASE("more changes than are listed are made up for", "[potential]") {
  const GridSpec grid({Eigen::Vector3d::Zero(), Eigen::Vector3d(20.0, 20.0, 6.0)}, 0.1);
  PotentialModelConfig config;
  config.potential.reach_m = 0.15;
  config.potential.k_exp = 1.0;
  config.window_m = {1.5, 1.5, 0.9};
  PotentialScene scene(grid, config);
  scene.center_m = {10.0, 10.0, 3.0};
  scene.update();
  for (int z = 0; z < 60; ++z) {
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 200; x += 20) scene.map.update({x, y, z}, true);
    }
  }
  scene.update();
  CHECK(scene.obstacles.fine().too_many_changes());
  PotentialScene fresh(grid, config);
  fresh.obstacles.update(scene.map);
  fresh.model.update(scene.map, fresh.obstacles, {scene.center_m, scene.goal_m, {}});
  CHECK(equal(scene.model.fine(), fresh.model.fine()));
  CHECK(scene.model.fine().at(PotentialLayer::kRepulsive, {100, 100, 30}) > 0.0);
}

TEST_CASE("unusable potential layers are refused", "[potential]") {
  const GridSpec grid = four_metres();
  CHECK_THROWS_AS(PotentialLayers(grid, {0, 5, 5}, RepulsionForm::kSummed), InputError);
  PotentialConfig far;
  far.reach_m = 6.6;
  CHECK_THROWS_AS(PotentialLayers(grid, {5, 5, 5}, RepulsionForm::kSummed, far), InputError);
  PotentialConfig flat;
  flat.sigma_m = 0.0;
  CHECK_THROWS_AS(PotentialLayers(grid, {5, 5, 5}, RepulsionForm::kSummed, flat), InputError);
  PotentialModelConfig config;
  config.coarse_factor = 0;
  CHECK_THROWS_AS(PotentialModel(grid, config), InputError);
  CHECK_THROWS_AS(PotentialObstacles(grid, 0), InputError);
  config = {};
  config.window_m.x() = std::nan("");
  CHECK_THROWS_AS(PotentialModel(grid, config), InputError);

  config = {};
  config.form = RepulsionForm::kNearest;
  PotentialScene scene(grid, config);
  scene.update();
  CHECK_THROWS_AS(scene.model.update(scene.map, scene.obstacles, {}), InputError);  // no distances
  const DistanceField blocked(grid, 1.1, Obstacles::kBlocked);
  CHECK_THROWS_AS(scene.model.update(scene.map, scene.obstacles, {}, &blocked), InputError);
  const DistanceField brief(grid, 0.9, Obstacles::kOccupied);
  CHECK_THROWS_AS(scene.model.update(scene.map, scene.obstacles, {}, &brief), InputError);
  OccupancyMap other(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 0.1));
  CHECK_THROWS_AS(scene.obstacles.update(other), InputError);
  CHECK_THROWS_AS(scene.model.update(other, scene.obstacles, {}, &scene.field), InputError);
  const PotentialObstacles elsewhere(other.grid(), 4);
  CHECK_THROWS_AS(scene.model.update(scene.map, elsewhere, {}, &scene.field), InputError);
}
