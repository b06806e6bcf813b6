#pragma once

#include "core/scan.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

namespace stairwell::explore {

/// Signed turn (radians, counter-clockwise positive) that lets a sensor looking along `yaw_rad` see every sector
/// around it in which a level ray of `reach_m` meets unknown space; 0 when all sectors are known (SPEC B3: "skip
/// sectors already known") or the sensor sees all round. At most one full turn.
double radial_scan_turn(const mapping::OccupancyMap& map, const Eigen::Vector3d& position_m, double yaw_rad,
                        const SensorModel& sensor, double reach_m);

}  // namespace stairwell::explore
