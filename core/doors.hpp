/// The only doors between a UAV's software and the world it flies in. A simulator implements them here; a real UAV
/// can implement the same ones. Nothing else crosses: no ground truth.
#pragma once

#include "core/pose.hpp"
#include "core/scan.hpp"
#include "core/trajectory.hpp"

namespace stairwell {

/// A range sensor: what a driver of a camera or lidar implements.
class DepthSource {
 public:
  virtual ~DepthSource() = default;
  virtual const SensorModel& model() const = 0;
  /// One sweep from the given sensor pose at the given time.
  virtual Scan capture(const Pose& T_world_sensor, double time_s) = 0;
};

/// A UAV as its planner sees it: it knows its own motion and follows trajectories.
class Vehicle {
 public:
  virtual ~Vehicle() = default;
  virtual const MotionLimits& limits() const = 0;
  /// The vehicle's own estimate of its motion at the time it was last advanced to.
  virtual MotionState state() const = 0;
  /// Whether it stands on the ground and has to take off first.
  virtual bool landed() const = 0;
  /// Follow `trajectory` from its start time on; replaces what was commanded before from that time on.
  /// @throws std::invalid_argument when the limits are exceeded or the motion is not continuous with the present one.
  virtual void command(const Trajectory& trajectory) = 0;
  /// Be in the middle of this motion, whatever was before (a resumed run); the next `advance` says when.
  virtual void resume(const Trajectory& flying) = 0;
  /// The motion commanded at present (for predictions and for broadcasting to fellow UAVs).
  virtual const Trajectory& commanded() const = 0;
  virtual void advance(double time_s) = 0;
};

/// Who can talk to whom.
class Radio {
 public:
  virtual ~Radio() = default;
  /// Whether UAVs a and b can exchange map updates at this moment, given where they are.
  virtual bool linked(const Eigen::Vector3d& position_a_m, const Eigen::Vector3d& position_b_m) const = 0;
};

}  // namespace stairwell
