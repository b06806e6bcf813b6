#include "sim3d/vehicles.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace stairwell::sim3d {

namespace {

// Room for rounding and for sampling at Trajectory::kStep_s, far below what moves a UAV by a voxel.
constexpr double kLimitSlack = 1e-3;  // relative
constexpr double kJoinPosition_m = 1e-3;
constexpr double kJoinSpeed_mps = 5e-3;
constexpr double kJoinYaw_rad = 1e-3;
constexpr double kJoinYawRate_radps = 5e-3;
constexpr double kSameTime_s = 1e-9;
constexpr double kAirborne_m = 0.01;

double size_of(const Eigen::Vector3d& v, MotionLimits::Norm norm) {
  return norm == MotionLimits::Norm::kEuclidean ? v.norm() : v.lpNorm<Eigen::Infinity>();
}

[[noreturn]] void refuse(double time_s, const char* what, double value, double limit, const char* unit) {
  std::ostringstream text;
  text << "trajectory refused: at " << time_s << " s " << what << " is " << value << " " << unit << ", limit " << limit
       << " " << unit;
  throw std::invalid_argument(text.str());
}

/// NaN is refused as well.
void require_within(double time_s, const char* what, double value, double limit, const char* unit) {
  if (!(value <= limit * (1.0 + kLimitSlack) + 1e-6)) refuse(time_s, what, value, limit, unit);
}

bool finite(const MotionState& s) {
  return s.position_m.allFinite() && s.velocity_mps.allFinite() && s.acceleration_mps2.allFinite() &&
         std::isfinite(s.yaw_rad) && std::isfinite(s.yaw_rate_radps);
}

/// `latest` from its start on, led in by `before` on the same time steps from `now_s` to there.
Trajectory splice(const Trajectory& before, const Trajectory& latest, double now_s) {
  const double gap_s = latest.start_time_s() - now_s;
  if (gap_s <= kSameTime_s) return latest;
  const auto steps = static_cast<std::size_t>(std::ceil(gap_s / Trajectory::kStep_s - kSameTime_s));
  const double start_s = latest.start_time_s() - static_cast<double>(steps) * Trajectory::kStep_s;
  std::vector<MotionState> states;
  states.reserve(steps + latest.states().size());
  for (std::size_t i = 0; i < steps; ++i) {
    states.push_back(before.sample(start_s + static_cast<double>(i) * Trajectory::kStep_s));
  }
  states.insert(states.end(), latest.states().begin(), latest.states().end());
  return {start_s, std::move(states)};
}

/// Follows what it was told exactly; models differ in what they accept.
class FollowingVehicle : public Vehicle {
 public:
  FollowingVehicle(const MotionLimits& limits, const MotionState& start, bool landed)
      : limits_(limits),
        ground_z_m_(start.position_m.z()),
        landed_(landed),
        commanded_(Trajectory::hover(0.0, start.position_m, start.yaw_rad)) {}

  const MotionLimits& limits() const override { return limits_; }
  MotionState state() const override { return commanded_.sample(now_s_); }
  bool landed() const override { return landed_; }
  const Trajectory& commanded() const override { return commanded_; }

  void command(const Trajectory& trajectory) override {
    if (trajectory.empty()) throw std::invalid_argument("trajectory refused: it has no states");
    if (!std::isfinite(trajectory.start_time_s())) {
      throw std::invalid_argument("trajectory refused: its start time is not finite");
    }
    for (const MotionState& s : trajectory.states()) {
      if (!finite(s)) throw std::invalid_argument("trajectory refused: a state is not finite");
    }
    const double join_s = std::max(trajectory.start_time_s(), now_s_);
    require_joins(join_s, commanded_.sample(join_s), trajectory.sample(join_s));
    require_limits(trajectory);
    commanded_ = splice(commanded_, trajectory, now_s_);
  }

  void resume(const Trajectory& flying) override {
    if (flying.empty()) throw std::invalid_argument("a vehicle cannot resume a trajectory without states");
    commanded_ = flying;
    landed_ = false;
  }

  void advance(double time_s) override {
    if (!(time_s >= now_s_ - kSameTime_s)) {
      throw std::invalid_argument("a vehicle cannot go back in time, to " + std::to_string(time_s) + " s");
    }
    now_s_ = std::max(now_s_, time_s);
    if (landed_ && state().position_m.z() > ground_z_m_ + kAirborne_m) landed_ = false;
  }

 protected:
  virtual void require_joins(double time_s, const MotionState& present, const MotionState& next) const = 0;
  virtual void require_limits(const Trajectory& trajectory) const = 0;

  MotionLimits limits_;

 private:
  double now_s_ = 0.0;
  double ground_z_m_;
  bool landed_;
  Trajectory commanded_;
};

class LimitedVehicle final : public FollowingVehicle {
 public:
  using FollowingVehicle::FollowingVehicle;

 private:
  void require_joins(double time_s, const MotionState& present, const MotionState& next) const override {
    require_within(time_s, "the jump in position", (next.position_m - present.position_m).norm(), kJoinPosition_m, "m");
    require_within(time_s, "the jump in velocity", (next.velocity_mps - present.velocity_mps).norm(), kJoinSpeed_mps,
                   "m/s");
    require_within(time_s, "the jump in yaw", std::abs(wrap_angle(next.yaw_rad - present.yaw_rad)), kJoinYaw_rad,
                   "rad");
    require_within(time_s, "the jump in yaw rate", std::abs(next.yaw_rate_radps - present.yaw_rate_radps),
                   kJoinYawRate_radps, "rad/s");
  }

  void require_limits(const Trajectory& trajectory) const override {
    const auto& states = trajectory.states();
    for (std::size_t i = 0; i < states.size(); ++i) {
      const double time_s = trajectory.start_time_s() + static_cast<double>(i) * Trajectory::kStep_s;
      require_state(time_s, states[i]);
      if (i > 0) require_step(time_s, states[i - 1], states[i]);
    }
    // After its end a trajectory holds at rest.
    require_within(trajectory.end_time_s(), "the speed at the end", states.back().velocity_mps.norm(), kJoinSpeed_mps,
                   "m/s");
    require_within(trajectory.end_time_s(), "the yaw rate at the end", std::abs(states.back().yaw_rate_radps),
                   kJoinYawRate_radps, "rad/s");
  }

  void require_state(double time_s, const MotionState& s) const {
    require_within(time_s, "the speed", size_of(s.velocity_mps, limits_.norm), limits_.speed_mps, "m/s");
    require_within(time_s, "the acceleration", size_of(s.acceleration_mps2, limits_.norm), limits_.acceleration_mps2,
                   "m/s2");
    require_within(time_s, "the yaw rate", std::abs(s.yaw_rate_radps), limits_.yaw_rate_radps, "rad/s");
  }

  /// What the states say must also be what they do from one to the next.
  void require_step(double time_s, const MotionState& a, const MotionState& b) const {
    constexpr double h = Trajectory::kStep_s;
    const Eigen::Vector3d moved_m = b.position_m - a.position_m;
    const double turned_rad = wrap_angle(b.yaw_rad - a.yaw_rad);
    require_within(time_s, "the change of speed", size_of(b.velocity_mps - a.velocity_mps, limits_.norm) / h,
                   limits_.acceleration_mps2, "m/s2");
    require_within(time_s, "the speed of the position", size_of(moved_m, limits_.norm) / h, limits_.speed_mps, "m/s");
    require_within(time_s, "the difference between velocity and movement",
                   (moved_m - 0.5 * h * (a.velocity_mps + b.velocity_mps)).norm(), kJoinPosition_m, "m");
    require_within(time_s, "the change of yaw rate", std::abs(b.yaw_rate_radps - a.yaw_rate_radps) / h,
                   limits_.yaw_acceleration_radps2, "rad/s2");
    require_within(time_s, "the speed of the yaw", std::abs(turned_rad) / h, limits_.yaw_rate_radps, "rad/s");
    require_within(time_s, "the difference between yaw rate and turn",
                   std::abs(turned_rad - 0.5 * h * (a.yaw_rate_radps + b.yaw_rate_radps)), kJoinYaw_rad, "rad");
  }
};

class StepVehicle final : public FollowingVehicle {
 public:
  using FollowingVehicle::FollowingVehicle;

 private:
  double step_m() const { return limits_.speed_mps * Trajectory::kStep_s; }

  void require_joins(double time_s, const MotionState& present, const MotionState& next) const override {
    require_within(time_s, "the first step", size_of(next.position_m - present.position_m, limits_.norm), step_m(),
                   "m");
  }

  void require_limits(const Trajectory& trajectory) const override {
    const auto& states = trajectory.states();
    for (std::size_t i = 1; i < states.size(); ++i) {
      require_within(trajectory.start_time_s() + static_cast<double>(i) * Trajectory::kStep_s, "the step",
                     size_of(states[i].position_m - states[i - 1].position_m, limits_.norm), step_m(), "m");
    }
  }
};

using Maker = std::unique_ptr<Vehicle> (*)(const MotionLimits&, const MotionState&, bool);

template <typename Model>
std::unique_ptr<Vehicle> make(const MotionLimits& limits, const MotionState& start, bool landed) {
  return std::make_unique<Model>(limits, start, landed);
}

struct Entry {
  std::string_view name;
  Maker maker;
};

constexpr std::array<Entry, 2> kModels{{{"limited", &make<LimitedVehicle>}, {"step", &make<StepVehicle>}}};

}  // namespace

std::unique_ptr<Vehicle> make_vehicle(std::string_view model, const MotionLimits& limits, const MotionState& start,
                                      bool landed) {
  if (const auto found = limits.problems(); !found.empty()) throw InputError("motion limits: " + found.front());
  if (!finite(start)) throw InputError("the start of a vehicle is not finite");
  std::string names;
  for (const Entry& entry : kModels) {
    if (entry.name == model) return entry.maker(limits, start, landed);
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError("unknown vehicle model '" + std::string(model) + "' (known: " + names + ")");
}

}  // namespace stairwell::sim3d
