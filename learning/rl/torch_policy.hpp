/// How an actor's numbers become actions, with gradients.
#pragma once

#include "learning/nn/network_spec.hpp"

#include <torch/torch.h>

namespace stairwell::rl {

/// Unit vectors for kUnitVector, else by tanh. @param raw  [count, n], before the head
torch::Tensor action_of(nn::Head head, const torch::Tensor& raw);

/// Actions moved by noise, and made actions again as perturb() does it.
torch::Tensor moved_action(nn::Head head, const torch::Tensor& actions, const torch::Tensor& noise);

struct DrawnAction {
  torch::Tensor action;           ///< [count, n]
  torch::Tensor log_probability;  ///< [count, 1]
};

/// Numbers by which SAC's actor says how sure it is: one for directions, one for each number else.
int spread_outputs(nn::Head head, int actions);
inline constexpr double kFirstSpread = 0.3;

/// SAC's policy. @param raw  [count, n + spread_outputs]: where to, then log sigma; @param noise  [count, n], normal.
/// Directions: mean direction plus noise, normalised. Numbers: a normal distribution, squashed by tanh.
DrawnAction draw_action(nn::Head head, const torch::Tensor& raw, const torch::Tensor& noise);

/// As log_projected_normal(), element by element.
torch::Tensor log_projected_normal(int dimension, const torch::Tensor& cosine, const torch::Tensor& sigma);

}  // namespace stairwell::rl
