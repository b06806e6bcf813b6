/// Noise for exploration (SPEC A10, A17).
#pragma once

#include "core/rng.hpp"
#include "learning/nn/network_spec.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace stairwell::rl {

struct NoiseConfig {
  enum class Kind { kGaussian, kOrnsteinUhlenbeck };
  Kind kind = Kind::kGaussian;
  double sigma = 0.1;   ///< of each number; of kOrnsteinUhlenbeck the part that is new in each step
  double theta = 0.15;  ///< kOrnsteinUhlenbeck: what is forgotten in each step, so x <- (1 - theta) x + sigma n
};

/// One stream of noise. A Gaussian one has no memory; Ornstein and Uhlenbeck's (Lillicrap et al. 2016) drifts, and
/// comes to rest at a variance of sigma^2 / (1 - (1 - theta)^2).
class Noise {
 public:
  Noise(const NoiseConfig& config, std::size_t size) : config_(config), values_(size, 0.0) {}
  std::span<const double> next(Rng& rng);

 private:
  NoiseConfig config_;
  std::vector<double> values_;
};

/// Adds noise to an action: a unit vector is normalised again (the sum is in R^n: no seam, no poles), numbers are kept
/// within [-1, 1]. @param head  of the network that acts
void perturb(nn::Head head, std::span<const double> noise, std::span<float> action);

/// Any action, all as likely.
void random_action(nn::Head head, Rng& rng, std::span<float> action);

}  // namespace stairwell::rl
