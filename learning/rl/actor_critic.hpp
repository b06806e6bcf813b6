/// DDPG, TD3, SAC and TD3+BC (SPEC A10, C5). LibTorch, behind this door.
#pragma once

#include "core/rng.hpp"
#include "learning/nn/network_spec.hpp"
#include "learning/nn/sealed_bytes.hpp"
#include "learning/rl/environment.hpp"
#include "learning/rl/replay_buffer.hpp"

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stairwell::rl {

struct ActorCriticConfig {
  enum class Algorithm { kDdpg, kTd3, kSac, kTd3Bc };

  Algorithm algorithm = Algorithm::kTd3;
  /// The actor as it is deployed. Its head says what an action is: kUnitVector a unit vector, else numbers in [-1, 1]
  /// (of kValues by tanh, outside the network).
  nn::NetworkSpec actor;
  std::vector<int> critic_hidden{128, 64};  ///< critics have the actor's windows and trunk, and see the action beside
  bool critic_layer_norm = true;            ///< keeps values from running away (RLPD, Ball et al. 2023)
  double actor_learning_rate = 3e-4;
  double critic_learning_rate = 1e-3;
  double smoothing = 0.01;         ///< tau of (3.19), (3.20)
  double target_noise = 0.2;       ///< TD3: of the target's action
  double target_noise_clip = 0.5;  ///< TD3
  std::uint64_t policy_delay = 2;  ///< TD3: critics' steps per step of the actor
  double cloning = 2.5;            ///< TD3+BC: alpha; the smaller, the closer to what was demonstrated
  double temperature = 0.1;        ///< SAC: alpha, at first
  double target_entropy = std::numeric_limits<double>::quiet_NaN();  ///< SAC; NaN: target_entropy_of()
  double max_gradient_norm = 10.0;
  std::uint64_t seed = 1;  ///< of the weights
  std::string device = "cpu";

  /// Numbers: -1 each (Haarnoja et al. 2018). Unit vectors: -0.5 for each way to turn.
  static double target_entropy_of(const nn::NetworkSpec& actor);
  /// DDPG as Alg. 3.1 with the rates of table 5.2.
  static ActorCriticConfig ddpg(const nn::NetworkSpec& actor);
  nn::NetworkSpec critic() const;
  std::vector<std::string> problems() const;
};

/// Of one step.
struct LearnReport {
  double critic_loss = 0.0;
  double value = 0.0;  ///< mean of what the first critic thinks of the batch's actions
};

/// Repeatable bit by bit on the CPU (one thread) for one seed: noise comes from the caller's generator.
class ActorCritic {
 public:
  /// @throws InputError for an unusable config or a device that is not there
  explicit ActorCritic(const ActorCriticConfig& config);
  ~ActorCritic();
  ActorCritic(ActorCritic&&) noexcept;
  ActorCritic& operator=(ActorCritic&&) noexcept;

  const ActorCriticConfig& config() const;
  /// What the agent does without noise.
  void act(const State& state, std::span<float> action) const;
  /// SAC: an action drawn from its policy. Else as act().
  void sample(const State& state, Rng& rng, std::span<float> action) const;
  /// One step of the critics and, when it is its turn, the actor. @param actor_too  false: leaves the actor alone
  LearnReport learn(const TransitionBatch& batch, Rng& rng, bool actor_too = true);

  /// Of `config().actor`: what is deployed.
  std::vector<float> policy_parameters() const;
  /// Starts from a trained actor. @throws InputError for another number of parameters
  void set_policy_parameters(std::span<const float> parameters);
  /// What the critics think of an action (the least of them).
  double value(const State& state, std::span<const float> action) const;

  void save(nn::ByteWriter& writer) const;
  /// @throws InputError for another network's
  void load(nn::ByteReader& reader);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// log of the density, on the unit circle (dimension 2) or sphere (3), of (m + sigma n) / |m + sigma n| where |m| = 1
/// and n is normal: the policy of SAC for directions. @param cosine  of the angle to m
double log_projected_normal(int dimension, double cosine, double sigma);

}  // namespace stairwell::rl
