#include "core/errors.hpp"
#include "core/rng.hpp"
#include "mapping/map_compare.hpp"
#include "mapping/potential_volume.hpp"
#include "mapping/slice_map.hpp"
#include "scribble.hpp"

#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

GridSpec two_metres() { return {{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(2.0)}, 0.1}; }

}  // namespace

TEST_CASE("a map compared with itself is all right", "[compare]") {
  Rng rng = make_rng(31, "compare");
  OccupancyMap map(two_metres());
  scribble(rng, map, 12);
  const MapComparison result = compare_maps(map, map);
  CHECK(result.observed_voxels == map.known_voxels());
  CHECK(result.correct_fraction == 1.0);
  CHECK(result.missing_fraction == 0.0);
  const MapComparison trees = compare_maps(map.octree(), map.octree());
  CHECK(trees.observed_voxels == map.known_voxels());
  CHECK(trees.correct_fraction == 1.0);
}

TEST_CASE("every kind of difference is counted once", "[compare]") {
  OccupancyMap map(two_metres());
  OccupancyMap reference(GridSpec({Eigen::Vector3d::Constant(1.0), Eigen::Vector3d::Constant(3.0)}, 0.1));
  const auto set = [](OccupancyMap& target, double at_m, bool occupied) {
    target.update(target.grid().index_of(Eigen::Vector3d::Constant(at_m)), occupied);
  };
  set(map, 0.05, false);  // unjudged: outside the reference
  set(map, 1.05, true);   // false occupied
  set(reference, 1.05, false);
  set(map, 1.15, false);  // false free
  set(reference, 1.15, true);
  set(map, 1.25, true);  // right
  set(reference, 1.25, true);
  set(reference, 2.55, true);  // missing: outside the map
  const MapComparison result = compare_maps(map, reference);
  CHECK(result.unjudged_voxels == 1);
  CHECK(result.expected_voxels == 4);
  CHECK(result.observed_voxels == 3);
  CHECK(result.false_occupied == 1);
  CHECK(result.false_free == 1);
  CHECK(result.correct_voxels == 1);
  CHECK(result.missing_voxels == 1);
  CHECK(result.correct_fraction == Approx(1.0 / 3.0));
  CHECK(result.missing_fraction == Approx(0.25));
  const MapComparison world = compare_map(map, [&](const VoxelIndex& v) {
    return v.x == 10 ? ExpectedOccupancy::kEither : v.x == 11 ? ExpectedOccupancy::kIgnore : ExpectedOccupancy::kFree;
  });
  CHECK(world.unjudged_voxels == 1);
  CHECK(world.observed_voxels == 3);
  CHECK(world.correct_voxels == 2);
  CHECK(world.false_occupied == 1);
  CHECK(world.expected_voxels == 20 * 20 * 19);
}

TEST_CASE("nothing in common gives no fractions", "[compare]") {
  const MapComparison result = compare_maps(OccupancyMap(two_metres()), OccupancyMap(two_metres()));
  CHECK(std::isnan(result.correct_fraction));
  CHECK(std::isnan(result.missing_fraction));
}

TEST_CASE("a slice says what its columns say", "[slice]") {
  Rng rng = make_rng(32, "slice");
  OccupancyMap map(two_metres());
  scribble(rng, map, 25);
  const SliceMap slice(map, {0.8, 1.2});
  CHECK(slice.lowest_layer() == 8);
  CHECK(slice.highest_layer() == 11);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) {
      int occupied = 0, free = 0;
      for (int z = 8; z <= 11; ++z) {
        occupied += map.at(VoxelIndex{x, y, z}) == Occupancy::kOccupied ? 1 : 0;
        free += map.at(VoxelIndex{x, y, z}) == Occupancy::kFree ? 1 : 0;
      }
      const Occupancy expected =
          occupied > 0 ? Occupancy::kOccupied : (free > 0 ? Occupancy::kFree : Occupancy::kUnknown);
      REQUIRE(slice.at(x, y) == expected);
    }
  }
  CHECK(slice.at(-1, 0) == Occupancy::kUnknown);
  CHECK_THROWS_AS(SliceMap(map, {5.0, 6.0}), InputError);
}

TEST_CASE("inflation is a layer of its own", "[slice]") {
  OccupancyMap map(two_metres());
  map.update({10, 10, 10}, true);
  SliceMap slice(map, {0.8, 1.2});
  CHECK_FALSE(slice.inflated(10, 10));
  slice.inflate(0.25);
  CHECK(slice.inflated(10, 10));
  CHECK(slice.inflated(12, 10));
  CHECK_FALSE(slice.inflated(13, 10));  // its centre is exactly 0.25 m from the occupied square
  CHECK(slice.inflated(12, 11));
  CHECK(slice.inflated(12, 12));  // 0.212 m from the corner
  CHECK(slice.at(12, 10) == Occupancy::kUnknown);
  slice.inflate(0.0);
  CHECK(slice.inflated(10, 10));
  CHECK_FALSE(slice.inflated(11, 10));
}

TEST_CASE("recovery forgets weak obstacles and keeps strong ones", "[slice]") {
  OccupancyMap map(two_metres());
  map.update({5, 5, 5}, true);
  for (int i = 0; i < 5; ++i) {
    map.update({6, 5, 5}, true);
  }
  map.update({15, 5, 5}, true);
  map.update({5, 6, 5}, false);
  const Aabb region{Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()};
  CHECK(clear_stale(map, region, 0.9) == 1);
  CHECK(map.at(VoxelIndex{5, 5, 5}) == Occupancy::kUnknown);
  CHECK(map.at(VoxelIndex{6, 5, 5}) == Occupancy::kOccupied);
  CHECK(map.at(VoxelIndex{15, 5, 5}) == Occupancy::kOccupied);
  CHECK(map.at(VoxelIndex{5, 6, 5}) == Occupancy::kFree);
  CHECK(clear_stale(map, {Eigen::Vector3d::Constant(7.0), Eigen::Vector3d::Constant(8.0)}, 0.9) == 0);
}

TEST_CASE("the potential is the sum of its layers at voxel centres", "[potential]") {
  Rng rng = make_rng(33, "potential");
  OccupancyMap map(two_metres());
  scribble(rng, map, 15);
  DistanceField field(map.grid(), 1.0, Obstacles::kOccupied);
  field.update(map);
  PotentialConfig config;
  config.k_exp = 0.7;
  PotentialVolume volume(map, field, config);
  volume.set_goal({1.5, 0.5, 0.5});
  volume.set_mobile({{0.3, 0.4, 0.5}});
  for (int i = 0; i < 500; ++i) {
    const VoxelIndex v = random_voxel(rng, map.grid());
    const Eigen::Vector3d at_m = map.grid().center_of(v);
    const double d_m = field.distance_m(v);
    const double ratio = d_m / config.sigma_m;
    const double repulsive =
        d_m < config.reach_m ? config.k_rep / (config.sigma_m * std::sqrt(2.0 * M_PI)) * std::exp(-0.5 * ratio * ratio)
                             : 0.0;
    CHECK(volume.repulsive(v) == Approx(repulsive).margin(1e-6));
    CHECK(volume.value(at_m) == Approx((at_m - Eigen::Vector3d(1.5, 0.5, 0.5)).norm() + volume.mobile(at_m) +
                                       volume.repulsive(v) + volume.exploration(v)));
  }
}

TEST_CASE("the potential's gradient is its slope", "[potential]") {
  Rng rng = make_rng(34, "gradient");
  OccupancyMap map(two_metres());
  scribble(rng, map, 15);
  DistanceField field(map.grid(), 1.0, Obstacles::kOccupied);
  field.update(map);
  PotentialVolume volume(map, field);
  volume.set_goal({1.52, 0.51, 0.53});
  volume.set_mobile({{0.3, 0.4, 0.5}, {1.0, 1.0, 1.0}});
  const double step_m = 1e-6;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d at_m(rng.uniform(-0.2, 2.2), rng.uniform(-0.2, 2.2), rng.uniform(-0.2, 2.2));
    const Eigen::Vector3d gradient = volume.gradient(at_m);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = step_m * Eigen::Vector3d::Unit(axis);
      const double slope = (volume.value(at_m + step) - volume.value(at_m - step)) / (2.0 * step_m);
      CHECK(gradient[axis] == Approx(slope).margin(1e-4));
    }
  }
  CHECK(volume.gradient({1.52, 0.51, 0.53}).allFinite());
}

TEST_CASE("unusable potentials are refused", "[potential]") {
  OccupancyMap map(two_metres());
  DistanceField field(map.grid(), 0.5, Obstacles::kOccupied);
  CHECK_THROWS_AS(PotentialVolume(map, field), InputError);  // reach beyond the field's truncation
  PotentialConfig config;
  config.reach_m = 0.5;
  CHECK_NOTHROW(PotentialVolume(map, field, config));
  config.sigma_m = 0.0;
  CHECK_THROWS_AS(PotentialVolume(map, field, config), InputError);
}
