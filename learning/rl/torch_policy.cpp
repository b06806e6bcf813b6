#include "learning/rl/torch_policy.hpp"

#include "core/units.hpp"

#include <cmath>

namespace stairwell::rl {

namespace {

constexpr double kLeastSpread = 0.05;
constexpr double kMostSpread = 2.0;

torch::Tensor normalised(const torch::Tensor& rows) { return rows / rows.norm(2, {1}, true).clamp_min(1e-6); }

torch::Tensor spread_of(const torch::Tensor& logarithm) {
  return logarithm.clamp(std::log(kLeastSpread), std::log(kMostSpread)).exp();
}

}  // namespace

torch::Tensor action_of(nn::Head head, const torch::Tensor& raw) {
  return head == nn::Head::kUnitVector ? normalised(raw) : torch::tanh(raw);
}

torch::Tensor moved_action(nn::Head head, const torch::Tensor& actions, const torch::Tensor& noise) {
  return head == nn::Head::kUnitVector ? normalised(actions + noise) : (actions + noise).clamp(-1.0, 1.0);
}

int spread_outputs(nn::Head head, int actions) { return head == nn::Head::kUnitVector ? 1 : actions; }

torch::Tensor log_projected_normal(int dimension, const torch::Tensor& cosine, const torch::Tensor& sigma) {
  // Integral over the length r of (2 pi)^(-d/2) sigma^-d r^(d-1) exp(-|r a - m|^2 / (2 sigma^2)), in s = r / sigma.
  const torch::Tensor c = (cosine / sigma).clamp_min(-6.0);
  const torch::Tensor below = 0.5 * torch::erfc(-c / std::sqrt(2.0));  // of the normal distribution
  const torch::Tensor edge = torch::exp(-0.5 * c * c);
  const double root = std::sqrt(2.0 * kPi);
  const torch::Tensor rest = dimension == 2 ? edge + c * root * below : c * edge + (1.0 + c * c) * root * below;
  const torch::Tensor sine = (1.0 - cosine * cosine) / (sigma * sigma);
  return -0.5 * dimension * std::log(2.0 * kPi) - 0.5 * sine + torch::log(rest.clamp_min(1e-30));
}

DrawnAction draw_action(nn::Head head, const torch::Tensor& raw, const torch::Tensor& noise) {
  const std::int64_t n = noise.size(1);
  const torch::Tensor middle = raw.slice(1, 0, n);
  const torch::Tensor spread = spread_of(raw.slice(1, n));
  if (head == nn::Head::kUnitVector) {
    const torch::Tensor mean = normalised(middle);
    const torch::Tensor action = normalised(mean + spread * noise);
    const torch::Tensor cosine = (action * mean).sum(1, true).to(torch::kFloat64);
    const torch::Tensor log_p = log_projected_normal(static_cast<int>(n), cosine, spread.to(torch::kFloat64));
    return {action, log_p.to(torch::kFloat32)};
  }
  const torch::Tensor numbers = middle + spread * noise;
  const torch::Tensor normal = -0.5 * noise * noise - torch::log(spread) - 0.5 * std::log(2.0 * kPi);
  // log(1 - tanh^2 u) = 2 (log 2 - u - softplus(-2 u)) (Haarnoja et al. 2018, appendix C)
  const torch::Tensor squashed = 2.0 * (std::log(2.0) - numbers - torch::softplus(-2.0 * numbers));
  return {torch::tanh(numbers), (normal - squashed).sum(1, true)};
}

}  // namespace stairwell::rl
