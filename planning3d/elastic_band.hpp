#pragma once

#include "planning3d/curve.hpp"
#include "planning3d/free_space.hpp"
#include "planning3d/safety_check.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace stairwell::planning3d {

/// A cubic B-spline (C2) whose control points are drawn from a polyline to where the curve bends little and is short,
/// as far as the robot fits at every one of them (elastic band: Quinlan & Khatib 1993). Both ends stay, and the curve
/// leaves along the polyline's first leg. Where the polyline comes nearer to things than the room wanted (ways touch
/// the corners they lead round), it is moved aside first. What lies between the control points is for the caller to
/// check; `loosen_near` leads the band back to the polyline there. Deterministic.
class ElasticBand {
 public:
  /// @param way_m at least two points, consecutive ones apart
  /// @param radius_m room that is kept around the control points
  /// @param turn_m over about this much of the way a bend is spread: the radius that can be flown at full speed
  /// @param keeps_direction the first control point beside the start stays on the first leg
  ElasticBand(const FreeSpace& space, const std::vector<Eigen::Vector3d>& way_m, double radius_m, double turn_m,
              bool keeps_direction);

  Curve curve() const;
  /// False when the band already lies on the polyline there.
  bool loosen_near(const Eigen::Vector3d& at_m);

 private:
  void relax(const FreeSpace& space, double radius_m, double turn_m);
  std::size_t first_free() const { return keeps_direction_ ? 2 : 1; }

  bool keeps_direction_;
  double spacing_m_ = 0.0;
  std::vector<Eigen::Vector3d> on_way_m_;  ///< evenly along the polyline
  std::vector<Eigen::Vector3d> control_m_;
};

}  // namespace stairwell::planning3d
