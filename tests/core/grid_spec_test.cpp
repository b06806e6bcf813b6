#include "core/errors.hpp"
#include "core/grid_spec.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <limits>

using namespace stairwell;

TEST_CASE("a grid covers its box and no more than a voxel beyond") {
  Rng rng = make_rng(1, "grid");
  for (int i = 0; i < 500; ++i) {
    const double resolution_m = rng.uniform(0.02, 0.5);
    const Eigen::Vector3d lo(rng.uniform(-20, 20), rng.uniform(-20, 20), rng.uniform(-20, 20));
    const Eigen::Vector3d size(rng.uniform(0.1, 5), rng.uniform(0.1, 5), rng.uniform(0.1, 5));
    const GridSpec grid({lo, lo + size}, resolution_m);
    const Aabb box = grid.box();
    const double slack_m = 1e-5 * resolution_m;
    CHECK((box.min_m.array() <= lo.array() + slack_m).all());
    CHECK((box.max_m.array() >= (lo + size).array() - slack_m).all());
    CHECK((box.min_m.array() > lo.array() - resolution_m - slack_m).all());
    CHECK((box.max_m.array() < (lo + size).array() + resolution_m + slack_m).all());
  }
}

TEST_CASE("voxel, centre and linear index belong together") {
  const GridSpec grid({{-1.3, 0.2, -0.05}, {2.0, 1.7, 0.9}}, 0.1);
  for (std::size_t i = 0; i < grid.voxel_count(); i += 7) {
    const VoxelIndex v = grid.voxel(i);
    REQUIRE(grid.contains(v));
    REQUIRE(grid.linear(v) == i);
    REQUIRE(grid.index_of(grid.center_of(v)) == v);
  }
  CHECK_FALSE(grid.contains(VoxelIndex{-1, 0, 0}));
  CHECK_FALSE(grid.contains(VoxelIndex{0, grid.size()[1], 0}));
}

TEST_CASE("faces on the lattice do not grow the grid") {
  const GridSpec grid({{-0.3, 0.0, 0.7}, {0.3, 0.1, 1.0}}, 0.1);
  CHECK(grid.size() == std::array<int, 3>{6, 1, 3});
  CHECK(grid.first_cell() == std::array<int, 3>{-3, 0, 7});
}

TEST_CASE("a grid refuses what it cannot hold") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(GridSpec({{0, 0, 0}, {1, 1, 1}}, 0.0), InputError);
  CHECK_THROWS_AS(GridSpec({{0, 0, 0}, {1, 1, 1}}, nan), InputError);
  CHECK_THROWS_AS(GridSpec({{0, 0, 0}, {1, nan, 1}}, 0.1), InputError);
  CHECK_THROWS_AS(GridSpec({{0, 0, 0}, {1, 0, 1}}, 0.1), InputError);
  CHECK_THROWS_AS(GridSpec(Aabb{}, 0.1), InputError);
  CHECK_THROWS_AS(GridSpec({{0, 0, 0}, {5000, 1, 1}}, 0.1), InputError);
}
