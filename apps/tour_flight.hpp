#pragma once

#include "core/trajectory.hpp"
#include "planning3d/free_space.hpp"
#include "planning3d/yaw_turn.hpp"

#include <Eigen/Core>

#include <vector>

namespace stairwell::apps {

/// A stop of a flight along a known way.
struct FlightStop {
  std::vector<Eigen::Vector3d> way_m;  ///< from the stop before to this one, both included
  double yaw_rad = 0.0;                ///< wanted there
};

struct TourFlight {
  std::vector<MotionState> states;  ///< every Trajectory::kStep_s, from rest to rest
  std::vector<double> arrival_s;    ///< per stop
};

/// The turn from one stop's yaw to the next one's, the shorter way round.
planning3d::YawTurn tour_turn(const MotionLimits& limits, double from_rad, double to_rad);

/// The quickest flight along the ways within the limits: past the stops without braking where the way goes on, corners
/// rounded as far as the space allows, slower where the turn to the next stop's yaw takes longer than the way.
/// @param start_yaw_rad  @param turns whether the yaw matters (depth cameras)
/// @throws RunError where even tight corners do not fit
TourFlight fly_tour(const planning3d::FreeSpace& space, const MotionLimits& limits,
                    const std::vector<FlightStop>& stops, double start_yaw_rad, bool turns);

}  // namespace stairwell::apps
