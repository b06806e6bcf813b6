#include "core/scan.hpp"
#include "core/units.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;

namespace {
SensorModel camera() {
  SensorModel model;
  model.azimuth_fov_rad = rad_from_deg(90.0);
  model.elevation_lo_rad = rad_from_deg(-30.0);
  model.elevation_hi_rad = rad_from_deg(30.0);
  return model;
}
}  // namespace

TEST_CASE("a camera sees what lies in its frustum") {
  const SensorModel model = camera();
  CHECK(model.problems().empty());
  CHECK(model.sees({2.0, 0.0, 0.0}));
  CHECK(model.sees({2.0, 1.9, 0.0}));
  CHECK_FALSE(model.sees({2.0, 2.1, 0.0}));
  CHECK_FALSE(model.sees({-2.0, 0.0, 0.0}));
  CHECK_FALSE(model.sees({6.0, 0.0, 0.0}));
  CHECK_FALSE(model.sees({0.05, 0.0, 0.0}));
  // The upper edge of a pinhole image is straight: at the image's side a point of the same height over depth is seen.
  CHECK(model.sees({2.0, 1.9, 1.1}));
  CHECK_FALSE(model.sees({2.0, 0.0, 1.2}));
}

TEST_CASE("a lidar sees all round between its elevations") {
  SensorModel model = camera();
  model.kind = SensorKind::kLidar;
  model.azimuth_fov_rad = 2.0 * kPi;
  model.elevation_lo_rad = rad_from_deg(-7.0);
  CHECK(model.panoramic());
  CHECK(model.sees({-3.0, 0.1, 0.5}));
  CHECK_FALSE(model.sees({3.0, 0.0, -1.0}));
}

TEST_CASE("a sensor model lists every problem at once") {
  SensorModel model;
  model.azimuth_fov_rad = -1.0;
  model.rate_hz = 0.0;
  model.max_range_m = 0.0;
  CHECK(model.problems().size() >= 4);
}
