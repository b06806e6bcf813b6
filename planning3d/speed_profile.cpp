#include "planning3d/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr double kLeastSquaredSpeed = 1e-6;  // inner nodes; keeps travel times finite

constexpr double kSharpCosine = 0.9;    // sharper turns between two nodes are cusps that the table cannot hold
constexpr double kStoredShare = 0.999;  // between nodes the stored value may round above the limit

/// One piece of the curve between two nodes.
struct Piece {
  double length_m;
  Eigen::Vector3d along[3];    ///< unit tangents at its start, middle and end
  Eigen::Vector3d bend_per_m;  ///< curvature vector: change of the unit tangent per metre
};

Piece piece_of(const Curve& curve, std::size_t i) {
  const double length_m = curve.arc_m[i + 1] - curve.arc_m[i];
  return {length_m,
          {curve.tangent[i], tangent_between(curve, i, 0.5), curve.tangent[i + 1]},
          (curve.tangent[i + 1] - curve.tangent[i]) / length_m};
}

/// Most tangential acceleration in direction `sign` while turning at squared speed `u`.
double spare_acceleration(const Piece& piece, double u, double sign, const MotionLimits& limits, double share) {
  const double most = share * limits.acceleration_mps2;
  if (limits.norm == MotionLimits::Norm::kEuclidean) {
    const double across = u * piece.bend_per_m.norm();
    return across >= most ? 0.0 : std::sqrt(most * most - across * across);
  }
  double spare = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& along : piece.along) {
    for (int axis = 0; axis < 3; ++axis) {
      const double share_of_axis = sign * along[axis];
      if (std::abs(share_of_axis) < 1e-9) continue;
      const double across = u * piece.bend_per_m[axis];
      spare = std::min(spare, (most - (share_of_axis > 0.0 ? across : -across)) / std::abs(share_of_axis));
    }
  }
  return std::max(0.0, spare);
}

double bend_size(const Piece& piece, const MotionLimits& limits) { return limits.size_of(piece.bend_per_m); }

/// Largest squared speed at the far node, at most `ceiling`, when leaving the near one with `u` (the same holds
/// backwards in time).
double reachable(const Piece& piece, double u, double ceiling, double sign, const MotionLimits& limits, double share) {
  double acceleration = spare_acceleration(piece, u, sign, limits, share);
  for (int pass = 0; pass < 3; ++pass) {  // the turn takes its part at the faster end too
    const double then = std::min(ceiling, u + 2.0 * acceleration * piece.length_m);
    acceleration = std::min(acceleration, spare_acceleration(piece, then, sign, limits, share));
  }
  return std::min(ceiling, u + 2.0 * acceleration * piece.length_m);
}

std::vector<double> ceilings(const Curve& curve, const std::vector<Piece>& pieces, const MotionLimits& limits,
                             const LimitShares& shares) {
  std::vector<double> most(curve.size());
  const double fastest_mps = shares.speed * limits.speed_mps;
  const double turning = shares.bend * shares.acceleration * limits.acceleration_mps2;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    double speed_mps = fastest_mps;
    if (limits.norm == MotionLimits::Norm::kPerAxis) speed_mps /= curve.tangent[i].cwiseAbs().maxCoeff();
    most[i] = speed_mps * speed_mps;
    if (i > 0) most[i] = std::min(most[i], turning / std::max(1e-9, bend_size(pieces[i - 1], limits)));
    if (i < pieces.size()) most[i] = std::min(most[i], turning / std::max(1e-9, bend_size(pieces[i], limits)));
    most[i] = std::max(most[i], kLeastSquaredSpeed);
  }
  return most;
}

}  // namespace

std::optional<std::vector<double>> squared_speeds(const Curve& curve, const MotionLimits& limits, double start_mps,
                                                  const LimitShares& shares, const std::vector<double>* share) {
  if (curve.size() < 3) return std::nullopt;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    if (curve.tangent[i].dot(curve.tangent[i + 1]) < kSharpCosine) return std::nullopt;
  }
  std::vector<Piece> pieces;
  pieces.reserve(curve.size());
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) pieces.push_back(piece_of(curve, i));
  std::vector<double> u = ceilings(curve, pieces, limits, shares);
  for (std::size_t i = 0; share != nullptr && i < u.size(); ++i) {
    u[i] = std::max(u[i] * (*share)[i], kLeastSquaredSpeed);
  }
  const double start = start_mps * start_mps;
  u.back() = 0.0;
  u.front() = std::max(u.front(), start);  // the speed is a fact; the bend behind it is judged just below
  for (std::size_t i = pieces.size(); i-- > 0;) {
    u[i] = reachable(pieces[i], u[i + 1], u[i], -1.0, limits, shares.acceleration);
  }
  const double turn = start * bend_size(pieces.front(), limits);
  if (u.front() < start * (1.0 - 1e-9) || turn > shares.acceleration * limits.acceleration_mps2) return std::nullopt;
  u.front() = start;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    u[i + 1] = reachable(pieces[i], u[i], u[i + 1], 1.0, limits, shares.acceleration);
  }
  return u;
}

FlownCurve hardest_stop(const FlownCurve& flown, const MotionLimits& limits, const LimitShares& shares) {
  FlownCurve stop;
  if (flown.curve.size() < 2) return stop;
  stop.squared_speed.push_back(flown.squared_speed.front());
  double stop_arc_m = flown.curve.length_m();
  for (std::size_t i = 0; i + 1 < flown.curve.size(); ++i) {
    const Piece piece = piece_of(flown.curve, i);
    const double u = stop.squared_speed.back();
    const double brake = spare_acceleration(piece, u, -1.0, limits, shares.acceleration);
    const double then = u - 2.0 * brake * piece.length_m;
    if (then <= 0.0) {
      stop_arc_m = flown.curve.arc_m[i] + u / (2.0 * brake);
      break;
    }
    stop.squared_speed.push_back(std::min(then, flown.squared_speed[i + 1]));
  }
  stop.curve = cut(flown.curve, stop_arc_m);
  stop.squared_speed.resize(stop.curve.size(), 0.0);
  stop.squared_speed.back() = 0.0;
  return stop;
}

double travel_time_s(const Curve& curve, const std::vector<double>& squared_speed) {
  double time_s = 0.0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    time_s +=
        2.0 * (curve.arc_m[i + 1] - curve.arc_m[i]) / (std::sqrt(squared_speed[i]) + std::sqrt(squared_speed[i + 1]));
  }
  return time_s;
}

std::vector<MotionState> timed_states(const Curve& curve, const std::vector<double>& squared_speed,
                                      const MotionLimits& limits) {
  std::vector<MotionState> states;
  double node_s = 0.0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    const double length_m = curve.arc_m[i + 1] - curve.arc_m[i];
    const double from_mps = std::sqrt(squared_speed[i]);
    const double to_mps = std::sqrt(squared_speed[i + 1]);
    const double duration_s = 2.0 * length_m / (from_mps + to_mps);
    const double acceleration = (to_mps - from_mps) / duration_s;
    const Eigen::Vector3d bend_per_m = (curve.tangent[i + 1] - curve.tangent[i]) / length_m;
    for (;;) {
      const double since_s = Trajectory::kStep_s * static_cast<double>(states.size()) - node_s;
      if (!(since_s < duration_s) || !std::isfinite(duration_s)) break;
      const double u = std::clamp((from_mps + 0.5 * acceleration * since_s) * since_s / length_m, 0.0, 1.0);
      const double speed_mps = from_mps + acceleration * since_s;
      MotionState state;
      const Eigen::Vector3d along = tangent_between(curve, i, u);
      state.position_m = point_between(curve, i, u);
      state.velocity_mps = speed_mps * along;
      state.acceleration_mps2 = acceleration * along + speed_mps * speed_mps * bend_per_m;
      const double asked = limits.size_of(state.acceleration_mps2) / (kStoredShare * limits.acceleration_mps2);
      if (asked > 1.0) state.acceleration_mps2 /= asked;
      states.push_back(state);
    }
    node_s += duration_s;
  }
  MotionState rest;
  rest.position_m = curve.point_m.back();
  states.push_back(rest);
  return states;
}

}  // namespace stairwell::planning3d
