#include "flown_worlds.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;

// SPEC A18. All ten thousand worlds: benchmarks/flown_worlds.cpp.
TEST_CASE("no flown state is in collision or in unknown space, in random worlds", "[safety][flown]") {
  constexpr int kWorlds = 1000;
  const test::FlownTally tally = test::fly_worlds(0, kWorlds);
  CAPTURE(tally.first_problem);
  CHECK(tally.in_collision == 0);
  CHECK(tally.in_unknown == 0);
  CHECK(tally.missed == 0);
  CHECK(tally.beyond_limits == 0);
  CHECK(tally.flights > kWorlds);
  CHECK(tally.in_flight > kWorlds / 3);
  CHECK(tally.brakes > kWorlds / 20);
  CHECK(tally.refused < tally.flights / 20);
  WARN(tally.text());
}
