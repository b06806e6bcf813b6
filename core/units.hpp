/// Angles are radians and lengths metres everywhere inside the libraries; degrees exist only at the
/// command line and in YAML, where names end in `_deg`.
#pragma once

#include <cmath>
#include <numbers>

namespace stairwell {

inline constexpr double kPi = std::numbers::pi;

constexpr double rad_from_deg(double angle_deg) { return angle_deg * kPi / 180.0; }
constexpr double deg_from_rad(double angle_rad) { return angle_rad * 180.0 / kPi; }

/// The same direction within (-pi, pi].
inline double wrap_angle(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2.0 * kPi);
  return wrapped <= -kPi ? wrapped + 2.0 * kPi : wrapped;
}

}  // namespace stairwell
