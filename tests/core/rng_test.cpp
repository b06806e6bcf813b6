#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;

TEST_CASE("streams repeat for a seed and name, and differ otherwise") {
  Rng a = make_rng(7, "sensor");
  Rng b = make_rng(7, "sensor");
  Rng other_name = make_rng(7, "planner");
  Rng other_seed = make_rng(8, "sensor");
  for (int i = 0; i < 100; ++i) {
    const auto value = a();
    CHECK(value == b());
    CHECK(value != other_name());
    CHECK(value != other_seed());
  }
}

TEST_CASE("the first numbers never change (golden)") {
  Rng rng(42);
  CHECK(rng() == 1546998764402558742ULL);
  CHECK(rng() == 6990951692964543102ULL);
}

TEST_CASE("distributions have their moments and bounds") {
  Rng rng = make_rng(3, "moments");
  double sum = 0.0;
  double square = 0.0;
  int low = 0;
  constexpr int kDraws = 200'000;
  for (int i = 0; i < kDraws; ++i) {
    const double u = rng.uniform();
    REQUIRE((u >= 0.0 && u < 1.0));
    const int k = rng.uniform_int(-2, 3);
    REQUIRE((k >= -2 && k <= 3));
    low += k == -2;
    const double n = rng.normal(1.0, 2.0);
    sum += n;
    square += (n - 1.0) * (n - 1.0);
  }
  CHECK(sum / kDraws == Approx(1.0).margin(0.02));
  CHECK(std::sqrt(square / kDraws) == Approx(2.0).margin(0.02));
  CHECK(low / double(kDraws) == Approx(1.0 / 6.0).margin(0.005));
}
