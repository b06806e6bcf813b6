#pragma once

#include "core/doors.hpp"
#include "coverage3d/strategy.hpp"
#include "planning3d/path_follower.hpp"
#include "planning3d/right_of_way.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace stairwell::explore {

/// States of SPEC B3, and the way home.
enum class Phase { kGrounded, kTakeoff, kRadialScan, kFindGoal, kTravel, kLand, kDone, kReturn };
const char* to_string(Phase phase);

/// What the fleet loop keeps about one UAV.
struct Uav {
  std::size_t id = 0;
  DepthSource* sensor = nullptr;
  Vehicle* vehicle = nullptr;
  struct Belief* belief = nullptr;  ///< of the group that it is in; owned by the fleet
  Phase phase = Phase::kGrounded;
  Eigen::Vector3d home_m = Eigen::Vector3d::Zero();  ///< in the air above its start
  double flying_since_s = 0.0;
  bool out_of_battery = false;                           ///< goes back for that reason
  double way_home_s = 0.0;                               ///< when last computed, with the reserve
  double way_home_due_s = 0.0;                           ///< when it is to be computed again
  int failed_returns = 0;                                ///< plans in a row for the way home that failed
  std::optional<double> lost_s;                          ///< not heard of since then; stays where it is
  std::optional<double> stalled_s;                       ///< gave its task back then, and has made no progress since
  Eigen::Vector3d progress_m = Eigen::Vector3d::Zero();  ///< where it was when it last made progress ...
  double progress_s = 0.0;                               ///< ... and when
  bool held = false;                                     ///< does not move, whatever it is commanded
  bool took_off = false;                                 ///< started from the ground, so it lands at the end
  std::optional<coverage3d::Goal> goal;
  double goal_given_s = 0.0;
  bool part_way = false;         ///< its motion ends before the goal, and is planned on before it ends
  double next_decision_s = 0.0;  ///< not before: computing (charged) or waiting after a failure
  double latency_s = 0.0;        ///< how far ahead of now its plans depart
  int waits = 0;                 ///< plans in a row that a fellow UAV was in the way of
  bool idle = false;             ///< the strategy had nothing for it when last asked
  // With reciprocal avoidance (fleet_avoid.cpp):
  bool avoiding = false;    ///< left its planned motion for the sake of a fellow
  bool on_segment = false;  ///< its motion is one of avoidance, which brakes to rest by itself
  double avoiding_since_s = 0.0;
  std::vector<Eigen::Vector3d> path_m;  ///< of the last plan
  std::optional<planning3d::PathFollower> follower;
  std::optional<planning3d::RightOfWay> way;
  Eigen::Vector3d scanned_at_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());

  const Trajectory& commanded() const { return vehicle->commanded(); }
  /// Has nothing to do with exploring any more.
  bool retired() const { return lost_s || phase == Phase::kReturn || phase == Phase::kLand || phase == Phase::kDone; }
  bool at_rest(double time_s) const { return time_s >= commanded().end_time_s() - 1e-9; }
};

}  // namespace stairwell::explore
