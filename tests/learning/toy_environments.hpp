/// Problems whose answers are known.
#pragma once

#include "core/rng.hpp"
#include "core/units.hpp"
#include "learning/rl/actor_critic.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <string>

namespace stairwell::testing {

/// A cart on a line, pushed: x' = A x + B u, cost x' Q x + r u^2. Actions are pushes by kMostPush.
class LineCart final : public rl::Environment {
 public:
  static constexpr double kMostPush = 4.0, kMostOff = 0.8;
  static Eigen::Matrix2d a() { return (Eigen::Matrix2d() << 1.0, 0.2, -0.1, 0.9).finished(); }
  static Eigen::Vector2d b() { return {0.02, 0.2}; }
  static Eigen::Matrix2d q() { return Eigen::Vector2d(1.0, 0.1).asDiagonal(); }
  static constexpr double kR = 0.1;

  void begin(std::uint64_t episode, rl::State& state) override {
    Rng rng = make_rng(5, "cart-" + std::to_string(episode));
    x_ = {rng.uniform(-kMostOff, kMostOff), rng.uniform(-kMostOff, kMostOff)};
    steps_ = 0;
    show(state);
  }
  rl::StepResult step(std::span<const float> action, rl::State& state) override {
    const double u = kMostPush * static_cast<double>(action[0]);
    const double cost = x_.dot(q() * x_) + kR * u * u;
    x_ = a() * x_ + b() * u;
    show(state);
    return {-cost, ++steps_ == 10, false, false};
  }

  /// Of u = -K x, by the Riccati recursion of the discounted problem.
  static Eigen::RowVector2d best_gain(double discount) {
    Eigen::Matrix2d p = q();
    Eigen::RowVector2d k;
    for (int i = 0; i < 2000; ++i) {
      const double s = kR + discount * b().dot(p * b());
      k = discount / s * (b().transpose() * p * a());
      p = q() + discount * a().transpose() * p * a() - k.transpose() * s * k;
    }
    return k;
  }

 private:
  void show(rl::State& state) const { state.features = {static_cast<float>(x_.x()), static_cast<float>(x_.y())}; }
  Eigen::Vector2d x_ = Eigen::Vector2d::Zero();
  int steps_ = 0;
};

/// The pendulum of many papers: it hangs, is too weak to be lifted at once, and must be swung up. Every action lasts
/// two steps of 0.05 s; 10 s in all.
class Pendulum final : public rl::Environment {
 public:
  explicit Pendulum(std::uint64_t seed) : seed_(seed) {}

  void begin(std::uint64_t episode, rl::State& state) override {
    Rng rng = make_rng(seed_, "pendulum-" + std::to_string(episode));
    angle_ = rng.uniform(-kPi, kPi);
    speed_ = rng.uniform(-1.0, 1.0);
    steps_ = 0;
    show(state);
  }
  rl::StepResult step(std::span<const float> action, rl::State& state) override {
    const double torque = 2.0 * static_cast<double>(action[0]);
    double cost = 0.0;
    for (int i = 0; i < 2; ++i) {
      const double off = std::remainder(angle_, 2.0 * kPi);
      cost += off * off + 0.1 * speed_ * speed_ + 0.001 * torque * torque;
      speed_ = std::clamp(speed_ + 0.05 * (15.0 * std::sin(angle_) + 3.0 * torque), -8.0, 8.0);
      angle_ += 0.05 * speed_;
    }
    show(state);
    return {-cost, ++steps_ == 100, false, false};
  }

 private:
  void show(rl::State& state) const {
    state.features = {static_cast<float>(std::cos(angle_)), static_cast<float>(std::sin(angle_)),
                      static_cast<float>(speed_ / 8.0)};
  }
  std::uint64_t seed_;
  double angle_ = 0.0, speed_ = 0.0;
  int steps_ = 0;
};

/// It is shown a direction, and should go another way, a quarter turn about z from it; steps of one. Somebody knows
/// how.
class Pointing final : public rl::Environment {
 public:
  void begin(std::uint64_t episode, rl::State& state) override {
    rng_ = make_rng(9, "pointing-" + std::to_string(episode));
    steps_ = 0;
    show(state);
  }
  rl::StepResult step(std::span<const float> action, rl::State& state) override {
    const double cosine = wanted().dot(Eigen::Vector3d(action[0], action[1], action[2]));
    const bool done = ++steps_ == 5;
    show(state);
    return {cosine, done, done, cosine > 0.9};
  }
  bool demonstrate(std::span<float> action) override {
    for (Eigen::Index a = 0; a < 3; ++a) action[static_cast<std::size_t>(a)] = static_cast<float>(wanted()[a]);
    return true;
  }

 private:
  Eigen::Vector3d wanted() const { return {-shown_.y(), shown_.x(), shown_.z()}; }
  void show(rl::State& state) {
    shown_ = Eigen::Vector3d(rng_.normal(), rng_.normal(), rng_.normal()).normalized();
    state.features = {static_cast<float>(shown_.x()), static_cast<float>(shown_.y()), static_cast<float>(shown_.z())};
  }
  Rng rng_ = make_rng(0, "pointing");
  Eigen::Vector3d shown_ = Eigen::Vector3d::UnitX();
  int steps_ = 0;
};

/// Mean reward of whole episodes without noise.
inline double mean_return(const rl::ActorCritic& agent, rl::Environment& environment, int episodes) {
  rl::State state;
  std::vector<float> action(static_cast<std::size_t>(agent.config().actor.outputs));
  double sum = 0.0;
  for (int e = 0; e < episodes; ++e) {
    environment.begin(1'000'000 + static_cast<std::uint64_t>(e), state);
    for (bool ended = false; !ended;) {
      agent.act(state, action);
      const rl::StepResult result = environment.step(action, state);
      sum += result.reward;
      ended = result.ended;
    }
  }
  return sum / episodes;
}

}  // namespace stairwell::testing
