#pragma once

#include "core/trajectory.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace stairwell::planning3d {

/// A curve as a dense table over arc length: points and unit tangents.
struct Curve {
  std::vector<Eigen::Vector3d> point_m;
  std::vector<Eigen::Vector3d> tangent;
  std::vector<double> arc_m;

  std::size_t size() const { return point_m.size(); }
  double length_m() const { return arc_m.empty() ? 0.0 : arc_m.back(); }
  /// Points closer than a millimetre to the last one are left out.
  void append(const Eigen::Vector3d& at_m, const Eigen::Vector3d& unit_tangent);
  void append(const Curve& other);
  /// The last node becomes exactly this one (a point within a millimetre of it, as a rule).
  void finish(const Eigen::Vector3d& at_m, const Eigen::Vector3d& unit_tangent);
};

/// The clamped uniform cubic B-spline (C2) of these control points: starts at the first one towards the second, ends at
/// the last one; the curve is straight (curvature 0) at both ends.
/// @pre at least two points, the first two and the last two apart
Curve clamped_spline(std::vector<Eigen::Vector3d> control_m);

/// Rounds the corners of a polyline by a clamped uniform cubic B-spline (C2): control points are the corners and
/// two points `reach` before and behind each, so that the curve leaves the polyline only there: by reach / 6 at most,
/// and not farther than (5 reach + 1 m) / 6 from a corner.
class RoundedPath {
 public:
  /// @pre at least two points, consecutive ones apart
  RoundedPath(std::vector<Eigen::Vector3d> corners_m, double max_reach_m);

  Curve curve() const;
  /// Tightens the corner nearest to `at_m` that still can be; false when none can.
  bool tighten_near(const Eigen::Vector3d& at_m);

 private:
  std::vector<Eigen::Vector3d> control_points() const;

  std::vector<Eigen::Vector3d> corners_m_;
  std::vector<double> reach_m_;
};

/// The curve that `flying` follows from `from_s` until it first rests, and the squared speed flown at each node.
/// Empty when it is at rest then.
struct FlownCurve {
  Curve curve;
  std::vector<double> squared_speed;
};
FlownCurve flown_curve(const Trajectory& flying, double from_s);

/// The part of a curve up to `arc_m`, the end interpolated.
Curve cut(const Curve& curve, double arc_m);

/// Point on segment [i, i + 1] of the table, by cubic Hermite interpolation; `u` in [0, 1].
Eigen::Vector3d point_between(const Curve& curve, std::size_t i, double u);
Eigen::Vector3d tangent_between(const Curve& curve, std::size_t i, double u);

/// Consecutive points less than 0.1 mm apart merged; the last point is kept exactly.
std::vector<Eigen::Vector3d> without_repeats(const std::vector<Eigen::Vector3d>& path_m);

/// From the nearest point of a polyline, which may be a single point; infinite when it has none.
double distance_to_polyline(const std::vector<Eigen::Vector3d>& path_m, const Eigen::Vector3d& p_m);

}  // namespace stairwell::planning3d
