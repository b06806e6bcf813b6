#include "planning3d/jerk_limit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace stairwell::planning3d {

namespace {

constexpr double kJerkShare = 0.97;
constexpr double kSwing = 2.0;    // from full acceleration to full braking within a window
constexpr double kSlower = 0.75;  // of the squared speed, where a limit was exceeded
constexpr int kRounds = 30;

/// Arc length over time with a constant acceleration between two nodes, and its integral.
class TimeLaw {
 public:
  /// @param history_mps2 acceleration before time 0, towards the first node's speed
  TimeLaw(const Curve& curve, const std::vector<double>& squared_speed, double from_arc_m, double history_mps2)
      : history_mps2_(history_mps2) {
    Node node{0.0, from_arc_m, std::sqrt(squared_speed.front()), 0.0, 0.0};
    for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
      const double then_mps = std::sqrt(squared_speed[i + 1]);
      const double duration_s = 2.0 * (curve.arc_m[i + 1] - curve.arc_m[i]) / (node.speed_mps + then_mps);
      node.mps2 = (then_mps - node.speed_mps) / duration_s;
      nodes_.push_back(node);
      node = after(node, duration_s);
      node.speed_mps = then_mps;
    }
    node.mps2 = 0.0;
    nodes_.push_back(node);
  }

  double end_s() const { return nodes_.back().time_s; }
  struct Value {
    double arc_m, speed_mps, sum_ms;  ///< the last one: integral of the arc length since time 0
  };
  Value at(double time_s) const {
    if (time_s < 0.0) {
      Node before = nodes_.front();
      before.mps2 = history_mps2_;
      return value(after(before, time_s));
    }
    const auto next = std::upper_bound(nodes_.begin(), nodes_.end(), time_s,
                                       [](double t_s, const Node& node) { return t_s < node.time_s; });
    const Node& node = *(next - 1);
    return value(after(node, time_s - node.time_s));
  }

 private:
  struct Node {
    double time_s, arc_m, speed_mps, mps2, sum_ms;
  };
  static Node after(const Node& n, double t_s) {
    return {n.time_s + t_s, n.arc_m + (n.speed_mps + 0.5 * n.mps2 * t_s) * t_s, n.speed_mps + n.mps2 * t_s, n.mps2,
            n.sum_ms + (n.arc_m + (0.5 * n.speed_mps + n.mps2 * t_s / 6.0) * t_s) * t_s};
  }
  static Value value(const Node& n) { return {n.arc_m, n.speed_mps, n.sum_ms}; }

  double history_mps2_;
  std::vector<Node> nodes_;
};

/// The curve from `arc_m` on.
Curve rest_of(const Curve& curve, double arc_m) {
  if (arc_m <= 0.0) return curve;
  Curve rest;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    if (curve.arc_m[i + 1] <= arc_m) continue;
    if (rest.size() == 0) {
      const double u = std::max(0.0, (arc_m - curve.arc_m[i]) / (curve.arc_m[i + 1] - curve.arc_m[i]));
      rest.append(point_between(curve, i, u), tangent_between(curve, i, u));
    }
    rest.append(curve.point_m[i + 1], curve.tangent[i + 1]);
  }
  if (rest.size() > 0) rest.finish(curve.point_m.back(), curve.tangent.back());
  return rest;
}

MotionState state_at(const Curve& curve, double arc_m, double speed_mps, double mps2) {
  const auto next = std::upper_bound(curve.arc_m.begin(), curve.arc_m.end() - 1, arc_m);
  const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, next - curve.arc_m.begin())) - 1;
  const double length_m = curve.arc_m[i + 1] - curve.arc_m[i];
  const double u = std::clamp((arc_m - curve.arc_m[i]) / length_m, 0.0, 1.0);
  const Eigen::Vector3d along = tangent_between(curve, i, u);
  MotionState state;
  state.position_m = point_between(curve, i, u);
  state.velocity_mps = speed_mps * along;
  state.acceleration_mps2 = mps2 * along + speed_mps * speed_mps / length_m * (curve.tangent[i + 1] - curve.tangent[i]);
  return state;
}

struct Sampled {
  std::vector<MotionState> states;
  std::vector<double> arc_m;
};

Sampled running_mean(const Curve& curve, const TimeLaw& law, double window_s, const MotionLimits& limits) {
  Sampled sampled;
  for (double time_s = 0.0; time_s < law.end_s() + window_s; time_s += Trajectory::kStep_s) {
    const TimeLaw::Value now = law.at(time_s);
    const TimeLaw::Value then = law.at(time_s - window_s);
    const double arc_m = (now.sum_ms - then.sum_ms) / window_s;
    sampled.arc_m.push_back(arc_m);
    sampled.states.push_back(state_at(curve, arc_m, std::max(0.0, (now.arc_m - then.arc_m) / window_s),
                                      (now.speed_mps - then.speed_mps) / window_s));
    Eigen::Vector3d& stored_mps2 = sampled.states.back().acceleration_mps2;
    const double asked = limits.size_of(stored_mps2) / limits.acceleration_mps2;
    if (asked > 1.0) stored_mps2 /= asked;
  }
  MotionState rest;
  rest.position_m = curve.point_m.back();
  sampled.states.push_back(rest);
  sampled.arc_m.push_back(curve.length_m());
  return sampled;
}

/// Allows less speed around every place where the samples exceed a limit. @return whether there was none
bool slow_down(const Sampled& sampled, const Curve& curve, const MotionLimits& limits, double window_s,
               std::vector<double>& share) {
  const double h_s = Trajectory::kStep_s;
  const auto change = [&](std::size_t i) -> Eigen::Vector3d {  // zero before and behind the motion
    if (i + 1 >= sampled.states.size()) return Eigen::Vector3d::Zero();
    return (sampled.states[i + 1].velocity_mps - sampled.states[i].velocity_mps) / h_s;
  };
  std::vector<char> slower(curve.size(), 0);
  bool fine = true;
  for (std::size_t i = 0; i < sampled.states.size(); ++i) {
    const bool kept = limits.size_of(sampled.states[i].velocity_mps) <= limits.speed_mps &&
                      limits.size_of(change(i)) <= 0.999 * limits.acceleration_mps2 &&
                      limits.size_of(change(i + 1) - change(i)) <= 0.999 * limits.jerk_mps3 * h_s;
    if (kept) continue;
    fine = false;
    const double around_m = 0.05 + 0.5 * window_s * sampled.states[i].velocity_mps.norm();
    const auto first = std::lower_bound(curve.arc_m.begin(), curve.arc_m.end(), sampled.arc_m[i] - around_m);
    for (auto node = first - curve.arc_m.begin(); node < static_cast<std::ptrdiff_t>(curve.size()); ++node) {
      const auto k = static_cast<std::size_t>(node);
      if (curve.arc_m[k] > sampled.arc_m[i] + around_m) break;
      slower[k] = 1;
    }
  }
  for (std::size_t k = 0; k < curve.size(); ++k) {
    if (slower[k] != 0) share[k] *= kSlower;
  }
  return fine;
}

}  // namespace

std::optional<std::vector<MotionState>> jerk_limited_states(const Curve& curve, const MotionLimits& limits,
                                                            double start_mps, double start_mps2,
                                                            const LimitShares& shares) {
  if (curve.size() < 3) return std::nullopt;
  const double window_s = std::max(
      Trajectory::kStep_s, kSwing * shares.acceleration * limits.acceleration_mps2 / (kJerkShare * limits.jerk_mps3));
  // The motion so far, seen as a mean of one with constant acceleration: that one is ahead.
  const double ahead_mps = start_mps + 0.5 * start_mps2 * window_s;
  const double ahead_m = 0.5 * ahead_mps * window_s - start_mps2 * window_s * window_s / 6.0;
  if (ahead_mps < 0.0 || ahead_m < 0.0) return std::nullopt;
  const Curve rest = rest_of(curve, ahead_m);
  if (rest.size() < 3) return std::nullopt;
  std::vector<double> share(rest.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    const auto speeds = squared_speeds(rest, limits, ahead_mps, shares, &share);
    if (!speeds) return std::nullopt;
    const TimeLaw law(rest, *speeds, curve.length_m() - rest.length_m(), start_mps2);
    Sampled sampled = running_mean(curve, law, window_s, limits);
    for (double& arc_m : sampled.arc_m) arc_m -= curve.length_m() - rest.length_m();
    if (slow_down(sampled, rest, limits, window_s, share)) return std::move(sampled.states);
  }
  return std::nullopt;
}

}  // namespace stairwell::planning3d
