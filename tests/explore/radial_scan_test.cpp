#include "core/units.hpp"
#include "explore/radial_scan.hpp"

#include <catch2/catch.hpp>

#include <cmath>

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
