#include "planning3d/region_graph.hpp"

#include "mapping/worker_pool.hpp"
#include "planning3d/travel_costs.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

const MotionRule kVolume = MotionRule::volume();

TestWorld cluttered(Rng& rng, int round) {
  TestWorld world({6.3, 5.1, 3.1}, 0.1);
  world.clutter(rng, 20 + 8 * round, 1.8);
  return world;
}

}  // namespace

TEST_CASE("a region graph reaches what single moves reach", "[region_graph]") {
  Rng rng = make_rng(11, "regions");
  std::size_t apart = 0;
  RegionGraph kept;
  for (int round = 0; round < 12; ++round) {
    TestWorld world = cluttered(rng, round);
    const FreeSpace space = world.space();
    const int stride = 1 + round % 2;
    PassableLattice lattice(stride);
    lattice.update(space, kVolume);
    kept.update(lattice);  // brought from one world to the next
    const Eigen::Vector3d source_m = world.random_place(space, rng);
    TravelCosts costs(stride);
    costs.compute(space, source_m, kVolume);
    std::vector<float> lengths;
    kept.lengths_from(kept.part_of(space.grid().index_of(source_m)), lengths);
    const double block_m = RegionGraph::kEdge * costs.cell_m();
    int wrong = 0;
    int far_off = 0;
    for (std::size_t i = 0; i < space.grid().voxel_count(); ++i) {
      const VoxelIndex v = space.grid().voxel(i);
      if (!space.traversable(v)) continue;
      const std::uint32_t part = kept.part_of(v);
      REQUIRE(part != RegionGraph::kNone);
      const double way_m = static_cast<double>(costs.distance_m(v));
      const double about_m = static_cast<double>(lengths[part]) * costs.cell_m();
      if (std::isinf(way_m) != std::isinf(about_m)) ++wrong;
      if (std::isinf(way_m)) {
        ++apart;
      } else if (about_m > 1.5 * way_m + 2.0 * block_m || way_m > 3.0 * about_m + 3.0 * block_m) {
        ++far_off;
      }
    }
    CHECK(wrong == 0);
    CHECK(far_off == 0);
  }
  CHECK(apart > 0);
}

TEST_CASE("a region graph of several threads is that of one", "[region_graph]") {
  Rng rng = make_rng(14, "regions of threads");
  mapping::WorkerPool pool(3);
  RegionGraph shared;
  for (int round = 0; round < 8; ++round) {
    TestWorld world = cluttered(rng, round);
    const FreeSpace space = world.space();
    PassableLattice lattice(1 + round / 4);
    lattice.update(space, kVolume);
    RegionGraph alone;
    alone.update(lattice);
    shared.update(lattice, &pool);
    for (std::size_t i = 0; i < space.grid().voxel_count(); ++i) {
      const VoxelIndex v = space.grid().voxel(i);
      REQUIRE(shared.part_of(v) == alone.part_of(v));
    }
    std::vector<float> expected, lengths;
    const std::uint32_t from = alone.part_of(space.grid().index_of(world.random_place(space, rng)));
    alone.lengths_from(from, expected);
    shared.lengths_from(from, lengths);
    REQUIRE(lengths == expected);
  }
}

TEST_CASE("lengths up to a part are the full ones where short ways to it lead, and no shorter ones elsewhere",
          "[region_graph]") {
  Rng rng = make_rng(13, "until");
  int not_looked_at = 0;
  int apart = 0;
  for (int round = 0; round < 24; ++round) {
    TestWorld world = cluttered(rng, round % 8);
    const FreeSpace space = world.space();
    PassableLattice lattice(1);
    lattice.update(space, kVolume);
    RegionGraph regions;
    regions.update(lattice);
    const auto part_at = [&](const Eigen::Vector3d& at_m) { return regions.part_of(space.grid().index_of(at_m)); };
    const std::uint32_t from = part_at(world.random_place(space, rng));
    const std::uint32_t until = part_at(world.random_place(space, rng));
    std::vector<float> full, some;
    regions.lengths_from(from, full);
    regions.lengths_from(from, some, until);
    REQUIRE(some.size() == full.size());
    CHECK(some[until] == full[until]);
    if (full[until] == RegionGraph::kUnreachable) {
      ++apart;
      CHECK(some == full);
      continue;
    }
    std::vector<float> back;
    regions.lengths_from(until, back);
    std::size_t wrong = 0;
    for (std::size_t part = 0; part < full.size(); ++part) {
      const bool on_the_way = full[part] + back[part] <= full[until] + 1e-3F;
      wrong += on_the_way ? some[part] != full[part] : some[part] < std::min(full[part], full[until]);
      if (some[part] != full[part]) ++not_looked_at;
    }
    CHECK(wrong == 0);
  }
  CHECK(not_looked_at > 100);
  CHECK(apart > 0);
}

TEST_CASE("limited travel costs are the full ones within the limit and estimated beyond", "[region_graph]") {
  Rng rng = make_rng(12, "limited");
  int beyond = 0;
  for (int round = 0; round < 16; ++round) {
    TestWorld world = cluttered(rng, round % 8);
    const FreeSpace space = world.space();
    const int stride = 1 + round % 2;
    const double limit_m = rng.uniform(0.5, 3.0);
    PassableLattice lattice(stride);
    TravelCosts full(stride);
    TravelCosts limited(stride);
    RegionGraph regions;
    const Eigen::Vector3d source_m = world.random_place(space, rng);
    full.compute(space, source_m, kVolume);
    limited.compute(space, source_m, kVolume, limit_m, &lattice);
    regions.update(lattice);
    const auto lengths = limited.estimate_beyond(regions);
    if (round % 2 == 1) {  // kept for another that starts here
      TravelCosts another(stride);
      another.compute(space, source_m, kVolume, limit_m, &lattice);
      CHECK(another.estimate_beyond(regions, lengths) == lengths);
      limited = std::move(another);
    }
    const bool moved = round % 4 == 3;  // the estimates stay from one computation to the next
    if (moved) limited.compute(space, source_m, kVolume, limit_m, &lattice);
    for (std::size_t i = 0; i < space.grid().voxel_count(); ++i) {
      const VoxelIndex v = space.grid().voxel(i);
      if (!space.traversable(v)) continue;
      const float want_m = full.distance_m(v);
      const float got_m = limited.distance_m(v);
      const bool within = static_cast<double>(want_m) < limit_m - 1e-4;
      if (within && got_m != want_m) FAIL("within the limit " << got_m << " m, not " << want_m);
      if (std::isinf(want_m) != std::isinf(got_m)) FAIL("reachable: " << got_m << " m, in full " << want_m);
      if (!within && static_cast<double>(got_m) < limit_m - 1e-4) FAIL("beyond the limit, yet " << got_m << " m");
      if (!within && std::isfinite(want_m)) ++beyond;
    }
    const Eigen::Vector3d target_m = world.random_place(space, rng);
    if (static_cast<double>(full.distance_m(target_m)) < limit_m - 1e-4) {
      CHECK(limited.path_to(target_m) == full.path_to(target_m));
    }
    limited.compute(space, source_m, kVolume);  // without a limit nothing is estimated
    CHECK(limited.distance_m(target_m) == full.distance_m(target_m));
  }
  CHECK(beyond > 1000);
}
