#pragma once

#include "core/scan.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <functional>
#include <span>

namespace stairwell::explore {

/// Signed turn (radians, counter-clockwise positive) that lets a sensor looking along `yaw_rad` see every sector
/// around it in which a level ray of `reach_m` meets unknown space; 0 when all sectors are known (SPEC B3: "skip
/// sectors already known") or the sensor sees all round. At most one full turn.
/// @param wanted  azimuths (world frame, radians) that count; empty: all
double radial_scan_turn(const mapping::OccupancyMap& map, const Eigen::Vector3d& position_m, double yaw_rad,
                        const SensorModel& sensor, double reach_m, const std::function<bool(double)>& wanted = {});

/// Whether a direction is the own one's to look into, of those who stand side by side: each looks away from the middle
/// of them all, and every direction is one's.
bool own_side(std::span<const Eigen::Vector3d> places_m, std::size_t own, double azimuth_rad);

}  // namespace stairwell::explore
