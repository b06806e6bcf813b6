#include "learning/train/path_environment.hpp"

#include "core/errors.hpp"
#include "learning/train/imitation.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::train {

using planning3d::RolloutEnd;

namespace {

constexpr std::uint64_t kFlightsPerGoal = 10, kFlightsPerWorld = 40;
constexpr int kMostAttempts = 100, kStartsPerAttempt = 20;
constexpr std::size_t kClearance = 15;  // its place among the features: 1 from 1 m on
constexpr double kStep_m = 0.12;
constexpr double kComfort = 0.6;

planning3d::ArrivalField::Config field_config(const PathEnvironmentConfig& config) {
  planning3d::ArrivalField::Config field;
  field.plane = config.input.plane;
  return field;
}

Teacher::Config teacher_config(const PathEnvironmentConfig& config) {
  Teacher::Config teacher;
  teacher.plane = config.input.plane;
  return teacher;
}

std::string stream(const char* what, std::uint64_t number, int attempt) {
  return std::string("path-") + what + "-" + std::to_string(number) + "-" + std::to_string(attempt);
}

}  // namespace

PathEnvironment::PathEnvironment(const PathEnvironmentConfig& config)
    : config_(config), field_(field_config(config)), view_(config.input), teacher_(teacher_config(config)) {}

void PathEnvironment::make_world(const Place& place) {
  if (place == world_place_) return;
  Rng rng = make_rng(config_.seed, stream("world", place.number, place.attempt));
  rollout_.reset();
  check_.reset();
  world_ = std::make_unique<TrainingWorld>(random_training_world(config_.input.plane, rng));
  space_.emplace(world_->space());
  const Aabb box = space_->grid().box();
  height_m_.reset();
  if (config_.input.plane) height_m_ = rng.uniform(0.3, 0.7) * (box.max_m.z() - box.min_m.z());
  world_place_ = place;
  goal_place_ = {};
}

bool PathEnvironment::make_goal(const Place& place) {
  if (place == goal_place_) return true;
  goal_place_ = {};
  rollout_.reset();
  Rng rng = make_rng(config_.seed, stream("goal", place.number, place.attempt));
  const auto goal = random_place(*space_, height_m_, rng);
  if (!goal) return false;
  check_.emplace(*space_, std::vector<planning3d::KeepOut>{}, *goal);
  const double none = std::numeric_limits<double>::quiet_NaN();
  field_.compute(*space_, *check_, *goal, Eigen::Vector3d::Constant(none));
  teacher_ready_ = false;
  goal_place_ = place;
  return true;
}

bool PathEnvironment::start(std::uint64_t episode, rl::State& state) {
  Rng rng = make_rng(config_.seed, stream("start", episode, goal_place_.attempt));
  for (int i = 0; i < kStartsPerAttempt; ++i) {
    const auto place = random_place(*space_, height_m_, rng);
    if (!place || !check_->voxel_free(space_->grid().index_of(*place))) continue;
    const float left_m = field_.value_m(*place);
    if (!(left_m > 0.8F && left_m < static_cast<float>(0.7 * kStep_m * config_.most_steps))) continue;
    view_.begin(*space_, {}, field_);
    planning3d::RolloutConfig alone;
    alone.slide = false;
    rollout_.emplace(*check_, view_, field_, alone, *place);
    last_.setZero();
    last_left_m_ = static_cast<double>(left_m);
    steps_ = 0;
    if (look(state)) return true;
  }
  return false;
}

void PathEnvironment::begin(std::uint64_t episode, rl::State& state) {
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    make_world({episode / kFlightsPerWorld, attempt});
    if (make_goal({episode / kFlightsPerGoal, attempt}) && start(episode, state)) return;
  }
  throw RunError("training: no world in which anything can fly");
}

/// False: the flight has ended.
bool PathEnvironment::look(rl::State& state) {
  if (!rollout_->look(seen_)) return false;
  state.windows = seen_.windows;
  state.features = seen_.features;
  clearance_ = static_cast<double>(seen_.features[kClearance]);
  return true;
}

/// At the edge of what may be flown in, where the field has no value, the last one.
double PathEnvironment::way_left_m(const Eigen::Vector3d& at_m) {
  const auto left_m = static_cast<double>(field_.value_m(at_m));
  if (std::isfinite(left_m)) last_left_m_ = left_m;
  return last_left_m_;
}

/// Of the thesis, in metres of way: attraction and a Gaussian of the clearance.
double PathEnvironment::potential(const Eigen::Vector3d& at_m, double clearance) {
  constexpr double kSigma = 0.3, kRepulsion = 0.5;
  const bool geodesic = config_.input.attraction == planning3d::AgentInput::Attraction::kGeodesic;
  const double attraction = geodesic ? way_left_m(at_m) : (at_m - field_.goal_m()).norm();
  const double off = std::max(0.0, clearance) / kSigma;
  return attraction + (clearance < 1.0 ? kRepulsion * std::exp(-0.5 * off * off) : 0.0);
}

double PathEnvironment::reward(const Eigen::Vector3d& from_m, double clearance_before) {
  const bool thesis = config_.reward == PathEnvironmentConfig::Reward::kThesis;
  if (rollout_->ended() && rollout_->end() == RolloutEnd::kCollision) return thesis ? -10.0 : -5.0;
  if (rollout_->ended() && rollout_->end() == RolloutEnd::kReached) return thesis ? 10.0 : 5.0;
  const Eigen::Vector3d& to_m = rollout_->path_m().back();
  const Eigen::Vector3d gone = (to_m - from_m).normalized();
  const double cosine = last_.isZero() ? 1.0 : std::clamp(last_.dot(gone), -1.0, 1.0);
  if (thesis) {
    constexpr double kDown = 5.0, kUp = 7.5, kTurn = 0.1, kTime = 0.05;
    const double before = potential(from_m, clearance_before);
    const double change = potential(to_m, clearance_) - before;
    return -(change > 0.0 ? kUp : kDown) * change - kTurn * std::acos(cosine) - kTime;
  }
  constexpr double kNear = 0.5, kTurn = 0.3, kTime = 0.1;
  const double left_before_m = way_left_m(from_m);
  const double nearer_m = left_before_m - way_left_m(to_m);
  const double nearness = std::max(0.0, 1.0 - clearance_ / kComfort);
  return std::clamp(nearer_m / kStep_m, -2.0, 2.0) - kNear * nearness * nearness - kTurn * (1.0 - cosine) - kTime;
}

rl::StepResult PathEnvironment::step(std::span<const float> action, rl::State& state) {
  const Eigen::Vector3d from_m = rollout_->path_m().back();
  const double clearance_before = clearance_;
  const Eigen::Vector3d direction = planning3d::direction_of(config_.head, config_.input.plane, action);
  rollout_->move(planning3d::turned(direction, seen_.yaw_rad));
  rl::StepResult result;
  look(state);
  result.reward = reward(from_m, clearance_before);
  last_ = (rollout_->path_m().back() - from_m).normalized();
  const bool over = rollout_->ended();
  result.success = over && rollout_->end() == RolloutEnd::kReached;
  result.terminal = result.success || (over && rollout_->end() == RolloutEnd::kCollision);
  result.ended = over || ++steps_ >= config_.most_steps;
  return result;
}

bool PathEnvironment::demonstrate(std::span<float> action) {
  if (!teacher_ready_) teacher_.begin(*space_, *check_, field_.goal_m());
  teacher_ready_ = true;
  Eigen::Vector3d right;
  if (!teacher_.direction(rollout_->path_m().back(), right)) return false;
  planning3d::outputs_of(config_.head, config_.input.plane, planning3d::turned(right, -seen_.yaw_rad), action);
  return true;
}

}  // namespace stairwell::train
