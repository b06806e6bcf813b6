#include "planning3d/half_space_program.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <span>

namespace stairwell::planning3d {

namespace {

constexpr double kRounding = 1e-10;  // of velocities, m/s
constexpr double kParallel = 1e-12;  // squared sine between planes that have no line in common

/// What is sought: the point nearest to `vector`, or the point farthest along it.
struct Aim {
  enum class Kind { kNearest, kFarthest };
  Kind kind;
  Eigen::Vector3d vector;
};

struct Line {
  Eigen::Vector3d point;
  Eigen::Vector3d direction;  ///< unit length
};

/// The best point of a line inside the ball and the half-spaces; false when there is none.
bool best_on_line(std::span<const HalfSpace> constraints, double radius, const Line& line, const Aim& aim,
                  Eigen::Vector3d& best) {
  const double along = line.point.dot(line.direction);
  const double squared = along * along + radius * radius - line.point.squaredNorm();
  if (squared < 0.0) return false;
  double lo = -along - std::sqrt(squared);
  double hi = -along + std::sqrt(squared);
  for (const HalfSpace& constraint : constraints) {
    const double slope = constraint.normal.dot(line.direction);
    const double missing = constraint.violation_mps(line.point);
    if (std::abs(slope) < kRounding) {
      if (missing > kRounding) return false;
      continue;
    }
    (slope > 0.0 ? lo : hi) = slope > 0.0 ? std::max(lo, missing / slope) : std::min(hi, missing / slope);
    if (lo > hi + kRounding) return false;
  }
  hi = std::max(lo, hi);
  double at = line.direction.dot(aim.vector) > 0.0 ? hi : lo;
  if (aim.kind == Aim::Kind::kNearest) at = std::clamp(line.direction.dot(aim.vector - line.point), lo, hi);
  best = line.point + at * line.direction;
  return true;
}

/// The line that two planes share. @pre they are not parallel
Line common_line(const HalfSpace& a, const HalfSpace& b) {
  const double cosine = a.normal.dot(b.normal);
  const double sine2 = 1.0 - cosine * cosine;
  const double share_a = (a.offset_mps - cosine * b.offset_mps) / sine2;
  const double share_b = (b.offset_mps - cosine * a.offset_mps) / sine2;
  return {share_a * a.normal + share_b * b.normal, a.normal.cross(b.normal).normalized()};
}

/// The best point of the plane within the ball, without other constraints.
Eigen::Vector3d best_on_disc(const HalfSpace& plane, double disc_radius, const Aim& aim) {
  const Eigen::Vector3d center = plane.offset_mps * plane.normal;
  Eigen::Vector3d planar = aim.vector - center;
  if (aim.kind == Aim::Kind::kFarthest) planar = aim.vector;
  planar -= plane.normal.dot(planar) * plane.normal;
  const double length = planar.norm();
  if (length < kRounding) return center;
  if (aim.kind == Aim::Kind::kNearest && length <= disc_radius) return center + planar;
  return center + disc_radius / length * planar;
}

/// The best point of the plane of the last constraint inside the ball and the constraints before it.
bool best_on_plane(std::span<const HalfSpace> constraints, double radius, const Aim& aim, Eigen::Vector3d& best) {
  const HalfSpace& plane = constraints.back();
  const double squared = radius * radius - plane.offset_mps * plane.offset_mps;
  if (squared < 0.0) return false;
  best = best_on_disc(plane, std::sqrt(squared), aim);
  for (std::size_t i = 0; i + 1 < constraints.size(); ++i) {
    if (constraints[i].violation_mps(best) <= kRounding) continue;
    if (plane.normal.cross(constraints[i].normal).squaredNorm() < kParallel) return false;
    if (!best_on_line(constraints.first(i), radius, common_line(plane, constraints[i]), aim, best)) return false;
  }
  return true;
}

/// How many of the constraints, from the first on, could be kept; `best` is best for those.
std::size_t best_in_space(std::span<const HalfSpace> constraints, double radius, const Aim& aim,
                          Eigen::Vector3d& best) {
  const double length = aim.vector.norm();
  const bool on_ball = aim.kind == Aim::Kind::kFarthest || length > radius;
  best = on_ball && length > 0.0 ? Eigen::Vector3d(radius / length * aim.vector) : aim.vector;
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    if (constraints[i].violation_mps(best) <= kRounding) continue;
    Eigen::Vector3d moved;
    if (!best_on_plane(constraints.first(i + 1), radius, aim, moved)) return i;
    best = moved;
  }
  return constraints.size();
}

/// Velocities that violate `other` no more than `worst`.
bool no_worse_than(const HalfSpace& worst, const HalfSpace& other, HalfSpace& result) {
  const Eigen::Vector3d difference = other.normal - worst.normal;
  const double length = difference.norm();
  if (length * length < kParallel) return false;  // same normal: decided by the offsets alone
  result = {difference / length, (other.offset_mps - worst.offset_mps) / length};
  return true;
}

/// Raises the soft half-spaces' common allowance only as far as it must be; `best` keeps the hard ones.
double least_violation(std::span<const HalfSpace> half_spaces, std::size_t hard, std::size_t from, double radius,
                       Eigen::Vector3d& best) {
  double violation = 0.0;
  std::vector<HalfSpace> constraints;
  for (std::size_t i = from; i < half_spaces.size(); ++i) {
    const HalfSpace& worst = half_spaces[i];
    if (worst.violation_mps(best) <= violation + kRounding) continue;
    constraints.assign(half_spaces.begin(), half_spaces.begin() + static_cast<std::ptrdiff_t>(hard));
    for (std::size_t k = hard; k < i; ++k) {
      HalfSpace constraint;
      if (no_worse_than(worst, half_spaces[k], constraint)) constraints.push_back(constraint);
    }
    Eigen::Vector3d moved;
    const Aim aim{Aim::Kind::kFarthest, worst.normal};
    if (best_in_space(constraints, radius, aim, moved) == constraints.size()) best = moved;
    violation = std::max(violation, worst.violation_mps(best));
  }
  return violation;
}

}  // namespace

ProgramResult nearest_velocity(const std::vector<HalfSpace>& half_spaces, std::size_t hard, double max_speed_mps,
                               const Eigen::Vector3d& preferred_mps) {
  ProgramResult result;
  const Aim aim{Aim::Kind::kNearest, preferred_mps};
  const std::size_t kept = best_in_space(half_spaces, max_speed_mps, aim, result.velocity_mps);
  if (kept == half_spaces.size()) return result;
  if (kept < hard) {
    result.velocity_mps.setZero();
    for (std::size_t i = hard; i < half_spaces.size(); ++i) {
      result.violation_mps = std::max(result.violation_mps, half_spaces[i].violation_mps(result.velocity_mps));
    }
    return result;
  }
  result.violation_mps = least_violation(half_spaces, hard, kept, max_speed_mps, result.velocity_mps);
  return result;
}

}  // namespace stairwell::planning3d
