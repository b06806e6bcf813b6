#include "learning/rl/noise.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::rl {

namespace {
constexpr double kLeastLength = 1e-6;
}

std::span<const double> Noise::next(Rng& rng) {
  const double kept = config_.kind == NoiseConfig::Kind::kOrnsteinUhlenbeck ? 1.0 - config_.theta : 0.0;
  for (double& value : values_) value = kept * value + rng.normal(0.0, config_.sigma);
  return values_;
}

void perturb(nn::Head head, std::span<const double> noise, std::span<float> action) {
  if (head != nn::Head::kUnitVector) {
    for (std::size_t i = 0; i < action.size(); ++i) {
      action[i] = static_cast<float>(std::clamp(static_cast<double>(action[i]) + noise[i], -1.0, 1.0));
    }
    return;
  }
  double squared = 0.0;
  for (std::size_t i = 0; i < action.size(); ++i) {
    const double sum = static_cast<double>(action[i]) + noise[i];
    squared += sum * sum;
  }
  const double length = std::sqrt(squared);
  if (length < kLeastLength) return;
  for (std::size_t i = 0; i < action.size(); ++i) {
    action[i] = static_cast<float>((static_cast<double>(action[i]) + noise[i]) / length);
  }
}

void random_action(nn::Head head, Rng& rng, std::span<float> action) {
  if (head != nn::Head::kUnitVector) {
    for (float& value : action) value = static_cast<float>(rng.uniform(-1.0, 1.0));
    return;
  }
  std::vector<double> direction(action.size());
  double squared = 0.0;
  while (squared < kLeastLength) {
    squared = 0.0;
    for (double& value : direction) {
      value = rng.normal();
      squared += value * value;
    }
  }
  for (std::size_t i = 0; i < action.size(); ++i) action[i] = static_cast<float>(direction[i] / std::sqrt(squared));
}

}  // namespace stairwell::rl
