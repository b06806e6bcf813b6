#include "explore/radial_scan.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

using namespace stairwell;

namespace {

SensorModel camera() {
  SensorModel model;
  model.azimuth_fov_rad = rad_from_deg(90.0);
  model.elevation_lo_rad = rad_from_deg(-35.0);
  model.elevation_hi_rad = rad_from_deg(35.0);
  return model;
}

/// Free where `is_known(azimuth)`, unknown elsewhere.
template <typename Predicate>
mapping::OccupancyMap map_known_where(Predicate is_known) {
  mapping::OccupancyMap map(GridSpec({{-3.0, -3.0, -0.2}, {3.0, 3.0, 0.2}}, 0.1));
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    const VoxelIndex v = map.grid().voxel(i);
    const Eigen::Vector3d p_m = map.grid().center_of(v);
    if (p_m.norm() < 0.4 || is_known(std::atan2(p_m.y(), p_m.x()))) map.set_log_odds(v, -1.0F);
  }
  return map;
}

}  // namespace

TEST_CASE("a radial scan turns once round when nothing is known, and not at all when everything is") {
  const auto nothing = map_known_where([](double) { return false; });
  const auto everything = map_known_where([](double) { return true; });
  CHECK(std::abs(explore::radial_scan_turn(nothing, {0, 0, 0}, 0.0, camera(), 2.0)) ==
        Approx(rad_from_deg(270.0)).margin(0.2));
  CHECK(explore::radial_scan_turn(everything, {0, 0, 0}, 0.0, camera(), 2.0) == 0.0);
}

TEST_CASE("a radial scan turns only to the side that is unknown") {
  const auto left_unknown = map_known_where([](double azimuth_rad) { return azimuth_rad < rad_from_deg(45.0); });
  const double turn_rad = explore::radial_scan_turn(left_unknown, {0, 0, 0}, 0.0, camera(), 2.0);
  CHECK(turn_rad > rad_from_deg(100.0));
  CHECK(turn_rad <= rad_from_deg(180.0));
}

TEST_CASE("a panoramic sensor never turns") {
  SensorModel lidar = camera();
  lidar.azimuth_fov_rad = 2.0 * kPi;
  const auto nothing = map_known_where([](double) { return false; });
  CHECK(explore::radial_scan_turn(nothing, {0, 0, 0}, 0.0, lidar, 2.0) == 0.0);
}

TEST_CASE("a radial scan turns the shorter way round, as far as is wanted") {
  const auto nothing = map_known_where([](double) { return false; });
  const auto turn_rad = [&](double from_deg, double to_deg) {
    return explore::radial_scan_turn(nothing, {0, 0, 0}, 0.0, camera(), 2.0, [&](double azimuth_rad) {
      const double leftwards_rad = azimuth_rad < 0.0 ? azimuth_rad + 2.0 * kPi : azimuth_rad;
      return leftwards_rad > rad_from_deg(from_deg) && leftwards_rad < rad_from_deg(to_deg);
    });
  };
  CHECK(turn_rad(-1.0, 44.0) == 0.0);  // in sight
  CHECK(turn_rad(60.0, 90.0) == Approx(rad_from_deg(82.5 - 45.0)));
  CHECK(turn_rad(270.0, 300.0) == Approx(rad_from_deg(-82.5 + 45.0)));
  CHECK(turn_rad(150.0, 240.0) == Approx(rad_from_deg(-(210.0 - 45.0))));  // on both sides: to 150 by the right is 210
  CHECK(turn_rad(120.0, 210.0) == Approx(rad_from_deg(210.0 - 45.0)));
}

TEST_CASE("those side by side look away from each other, and every direction is one's") {
  Rng rng = make_rng(3, "sides");
  for (int round = 0; round < 200; ++round) {
    std::vector<Eigen::Vector3d> places_m(static_cast<std::size_t>(rng.uniform_int(1, 8)));
    for (Eigen::Vector3d& place_m : places_m) {
      if (rng.uniform_int(0, 9) > 0)
        place_m = {rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), 1.0};  // or all the same
      else
        place_m = {0.0, 0.0, 1.0};
    }
    for (double azimuth_rad = -kPi; azimuth_rad < kPi; azimuth_rad += 0.1) {
      int owners = 0;
      for (std::size_t own = 0; own < places_m.size(); ++own) owners += explore::own_side(places_m, own, azimuth_rad);
      REQUIRE(owners == 1);
    }
  }
  const std::vector<Eigen::Vector3d> two_m{{-1.0, 0.0, 1.0}, {1.0, 0.0, 1.0}};
  CHECK(explore::own_side(two_m, 1, 0.3));
  CHECK(explore::own_side(two_m, 0, 3.0));
}
