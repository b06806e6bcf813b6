#include "planning3d/curve.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr double kNodeSpacing_m = 0.03;
constexpr double kLeastSpacing_m = 1e-3;
constexpr double kLeastReach_m = 0.03;
constexpr double kControlSpacing_m = 1.0;
constexpr double kRest_mps = 1e-3;

using Span = std::array<Eigen::Vector3d, 4>;

Eigen::Vector3d spline_point(const Span& c, double u) {
  const double u2 = u * u;
  const double u3 = u2 * u;
  const double v = 1.0 - u;
  return (v * v * v * c[0] + (3 * u3 - 6 * u2 + 4) * c[1] + (-3 * u3 + 3 * u2 + 3 * u + 1) * c[2] + u3 * c[3]) / 6.0;
}

Eigen::Vector3d spline_derivative(const Span& c, double u) {
  const double v = 1.0 - u;
  return 0.5 * (v * v * (c[1] - c[0]) + (1 + 2 * u - 2 * u * u) * (c[2] - c[1]) + u * u * (c[3] - c[2]));
}

void append_unless_repeated(std::vector<Eigen::Vector3d>& points_m, const Eigen::Vector3d& point_m) {
  if (points_m.empty() || (points_m.back() - point_m).norm() > 1e-6) points_m.push_back(point_m);
}

}  // namespace

void Curve::append(const Eigen::Vector3d& at_m, const Eigen::Vector3d& unit_tangent) {
  if (!point_m.empty()) {
    const double step_m = (at_m - point_m.back()).norm();
    if (step_m < kLeastSpacing_m) return;
    arc_m.push_back(arc_m.back() + step_m);
  } else {
    arc_m.push_back(0.0);
  }
  point_m.push_back(at_m);
  tangent.push_back(unit_tangent);
}

void Curve::append(const Curve& other) {
  for (std::size_t i = 0; i < other.size(); ++i) append(other.point_m[i], other.tangent[i]);
  if (!other.point_m.empty()) finish(other.point_m.back(), other.tangent.back());
}

void Curve::finish(const Eigen::Vector3d& at_m, const Eigen::Vector3d& unit_tangent) {
  append(at_m, unit_tangent);
  if (point_m.back() == at_m) return;
  if (size() > 1) {
    point_m.back() = at_m;
    tangent.back() = unit_tangent;
    arc_m.back() = arc_m[size() - 2] + (at_m - point_m[size() - 2]).norm();
  }
}

Curve clamped_spline(std::vector<Eigen::Vector3d> control_m) {
  const Eigen::Vector3d from_m = control_m.front();
  const Eigen::Vector3d to_m = control_m.back();
  const Eigen::Vector3d first = (control_m[1] - control_m[0]).normalized();
  const Eigen::Vector3d last = (control_m.back() - control_m[control_m.size() - 2]).normalized();
  control_m.insert(control_m.begin(), 2, from_m);  // clamped: the curve starts and ends on the path
  control_m.insert(control_m.end(), 2, to_m);
  Curve curve;
  curve.append(from_m, first);
  for (std::size_t i = 0; i + 3 < control_m.size(); ++i) {
    const Span span{control_m[i], control_m[i + 1], control_m[i + 2], control_m[i + 3]};
    const double longest_m =
        std::max({(span[1] - span[0]).norm(), (span[2] - span[1]).norm(), (span[3] - span[2]).norm()});
    const int pieces = std::max(6, static_cast<int>(std::ceil(longest_m / kNodeSpacing_m)));
    for (int k = 1; k <= pieces; ++k) {
      const double u = static_cast<double>(k) / pieces;
      const Eigen::Vector3d slope = spline_derivative(span, u);
      const double size = slope.norm();
      if (size > 1e-9) curve.append(spline_point(span, u), slope / size);
    }
  }
  curve.finish(to_m, last);
  return curve;
}

RoundedPath::RoundedPath(std::vector<Eigen::Vector3d> corners_m, double max_reach_m)
    : corners_m_(std::move(corners_m)), reach_m_(corners_m_.size(), 0.0) {
  for (std::size_t i = 1; i + 1 < corners_m_.size(); ++i) {
    const double before_m = (corners_m_[i] - corners_m_[i - 1]).norm() * (i == 1 ? 0.9 : 0.5);
    const double behind_m = (corners_m_[i + 1] - corners_m_[i]).norm() * (i + 2 == corners_m_.size() ? 0.9 : 0.5);
    reach_m_[i] = std::min({before_m, behind_m, max_reach_m});
  }
}

std::vector<Eigen::Vector3d> RoundedPath::control_points() const {
  std::vector<Eigen::Vector3d> control_m{corners_m_.front()};
  for (std::size_t i = 0; i + 1 < corners_m_.size(); ++i) {
    const Eigen::Vector3d leg_m = corners_m_[i + 1] - corners_m_[i];
    const double length_m = leg_m.norm();
    const Eigen::Vector3d along = leg_m / length_m;
    const double from_m = reach_m_[i];
    const double to_m = length_m - reach_m_[i + 1];
    const int pieces = std::max(1, static_cast<int>(std::ceil((to_m - from_m) / kControlSpacing_m)));
    for (int k = 0; k <= pieces; ++k) {
      append_unless_repeated(control_m, corners_m_[i] + (from_m + (to_m - from_m) * k / pieces) * along);
    }
    append_unless_repeated(control_m, corners_m_[i + 1]);
  }
  control_m.back() = corners_m_.back();  // to the last bit
  return control_m;
}

Curve RoundedPath::curve() const { return clamped_spline(control_points()); }

bool RoundedPath::tighten_near(const Eigen::Vector3d& at_m) {
  std::size_t nearest = 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < corners_m_.size(); ++i) {
    if (reach_m_[i] <= kLeastReach_m) continue;
    const double away_m = (corners_m_[i] - at_m).norm() - reach_m_[i];
    if (away_m >= nearest_m) continue;
    nearest_m = away_m;
    nearest = i;
  }
  if (nearest == 0 || nearest_m > kNodeSpacing_m) return false;
  reach_m_[nearest] = std::max(0.5 * kLeastReach_m, 0.45 * reach_m_[nearest]);
  return true;
}

FlownCurve flown_curve(const Trajectory& flying, double from_s) {
  FlownCurve flown;
  const double step_s = 0.5 * Trajectory::kStep_s;
  // On the grid of the states, so that a rest between two legs is met.
  double steps = std::floor((from_s - flying.start_time_s()) / step_s + 1e-6);
  for (double time_s = from_s;; time_s = flying.start_time_s() + ++steps * step_s) {
    const MotionState state = flying.sample(time_s);
    const double speed_mps = state.velocity_mps.norm();
    if (speed_mps < kRest_mps || time_s >= flying.end_time_s()) {
      if (flown.curve.size() < 2) return {};
      const Eigen::Vector3d last = flown.curve.tangent.back();
      flown.curve.finish(state.position_m, last);
      flown.squared_speed.resize(flown.curve.size());
      flown.squared_speed.back() = 0.0;
      return flown;
    }
    const std::size_t before = flown.curve.size();
    flown.curve.append(state.position_m, state.velocity_mps / speed_mps);
    if (flown.curve.size() > before) flown.squared_speed.push_back(speed_mps * speed_mps);
  }
}

Eigen::Vector3d point_between(const Curve& curve, std::size_t i, double u) {
  const double length_m = curve.arc_m[i + 1] - curve.arc_m[i];
  const double u2 = u * u;
  const double u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * curve.point_m[i] + (u3 - 2 * u2 + u) * length_m * curve.tangent[i] +
         (-2 * u3 + 3 * u2) * curve.point_m[i + 1] + (u3 - u2) * length_m * curve.tangent[i + 1];
}

Eigen::Vector3d tangent_between(const Curve& curve, std::size_t i, double u) {
  const Eigen::Vector3d blend = (1.0 - u) * curve.tangent[i] + u * curve.tangent[i + 1];
  const double size = blend.norm();
  return size > 1e-6 ? Eigen::Vector3d(blend / size) : curve.tangent[i];
}

Curve cut(const Curve& curve, double arc_m) {
  Curve part;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (curve.arc_m[i] >= arc_m) {
      if (i == 0) break;
      const double u = (arc_m - curve.arc_m[i - 1]) / (curve.arc_m[i] - curve.arc_m[i - 1]);
      part.finish(point_between(curve, i - 1, u), tangent_between(curve, i - 1, u));
      return part;
    }
    part.append(curve.point_m[i], curve.tangent[i]);
  }
  return part;
}

std::vector<Eigen::Vector3d> without_repeats(const std::vector<Eigen::Vector3d>& path_m) {
  std::vector<Eigen::Vector3d> kept_m;
  for (const Eigen::Vector3d& point_m : path_m) {
    if (kept_m.empty() || (point_m - kept_m.back()).norm() > 1e-4) kept_m.push_back(point_m);
  }
  if (kept_m.size() > 1) kept_m.back() = path_m.back();
  return kept_m;
}

double distance_to_polyline(const std::vector<Eigen::Vector3d>& path_m, const Eigen::Vector3d& p_m) {
  if (path_m.empty()) return std::numeric_limits<double>::infinity();
  double nearest_m = (path_m.front() - p_m).norm();
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    const Eigen::Vector3d leg_m = path_m[i + 1] - path_m[i];
    const double u = std::clamp((p_m - path_m[i]).dot(leg_m) / std::max(leg_m.squaredNorm(), 1e-12), 0.0, 1.0);
    nearest_m = std::min(nearest_m, (path_m[i] + u * leg_m - p_m).norm());
  }
  return nearest_m;
}

}  // namespace stairwell::planning3d
