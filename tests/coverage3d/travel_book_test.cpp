#include "coverage3d/travel_book.hpp"

#include "core/rng.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/worker_pool.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::coverage3d;

namespace {

const planning3d::MotionRule kVolume = planning3d::MotionRule::volume();

/// A known box, walls with a gap across it.
mapping::OccupancyMap walled(double length_m) {
  const GridSpec grid({Eigen::Vector3d::Zero(), Eigen::Vector3d(length_m, 6.0, 3.0)}, 0.2);
  mapping::OccupancyMap map(grid);
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const bool gap = v.x / 12 % 2 == 0 ? v.y < 6 : v.y > 24;
    map.set_log_odds(v, v.x % 12 == 6 && !gap ? 2.0F : -1.0F);
  }
  return map;
}

}  // namespace

TEST_CASE("many ways asked for at once are those asked for one by one", "[travel_book]") {
  Rng rng = make_rng(21, "travel book");
  const double length_m = 40.0;
  const mapping::OccupancyMap map = walled(length_m);
  mapping::DistanceField distance(map.grid(), 1.0, mapping::Obstacles::kBlocked);
  distance.update(map);
  const Aabb box = map.grid().box();
  const planning3d::FreeSpace space(map, distance, {0.2, 0.0}, box);
  mapping::WorkerPool pool(2);
  TravelBook one_by_one, at_once;
  std::size_t guessed = 0;
  std::size_t long_ways = 0;
  for (int round = 0; round < 60; ++round) {  // more fields than are kept, and than are kept for long
    std::vector<TravelBook::Pair> pairs;
    const auto place_m = [&] {
      for (;;) {
        const Eigen::Vector3d at_m(rng.uniform(0.5, length_m - 0.5), rng.uniform(0.5, 5.5), rng.uniform(0.5, 2.5));
        if (space.traversable(map.grid().index_of(at_m))) return at_m;
      }
    };
    for (int i = 0; i < 60; ++i) pairs.emplace_back(place_m(), place_m());
    one_by_one.begin(space, kVolume, 5);
    at_once.begin(space, kVolume, 5);
    std::vector<double> expected_m;
    for (const auto& [a_m, b_m] : pairs) expected_m.push_back(one_by_one.distance_m(space, a_m, b_m));
    REQUIRE(at_once.distances_m(space, pairs, round % 2 == 0 ? &pool : nullptr) == expected_m);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double straight_m = (pairs[i].first - pairs[i].second).norm();
      if (expected_m[i] == 1.6 * straight_m + 1.0) ++guessed;
      if (expected_m[i] > straight_m) ++long_ways;
    }
  }
  CHECK(guessed > 100);
  CHECK(long_ways > guessed + 100);
}
