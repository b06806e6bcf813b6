/// Acting in an environment and learning from it (Alg. 3.1, 5.1).
#pragma once

#include "learning/rl/actor_critic.hpp"
#include "learning/rl/environment.hpp"
#include "learning/rl/noise.hpp"
#include "learning/rl/replay_buffer.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace stairwell::rl {

struct TrainingConfig {
  std::uint64_t seed = 1;          ///< of exploration and batches
  std::uint64_t updates = 10'000;  ///< steps of gradient descent
  std::uint64_t warmup = 1'000;    ///< steps in the environment before the first update
  bool random_warmup = true;       ///< any action then; false: the agent's, with noise
  std::uint64_t critic_only = 0;   ///< of the updates: so many at first leave the actor as it is
  std::uint64_t steps_per_update = 1;
  std::size_t batch = 128;
  std::size_t capacity = 100'000;
  std::size_t n_step = 1;
  double discount = 0.95;
  NoiseConfig noise;                 ///< SAC explores by itself
  std::size_t demonstrations = 0;    ///< steps shown before anything else
  double demonstration_share = 0.0;  ///< of each batch

  std::vector<std::string> problems() const;
};

/// What happened in one episode. NaN where there is nothing to say.
struct EpisodeReport {
  std::uint64_t episode = 0;
  std::uint64_t steps = 0;    ///< in the environment, of all episodes so far
  std::uint64_t updates = 0;  ///< likewise
  double reward = 0.0;        ///< sum
  bool success = false;
  double critic_loss = 0.0, value = 0.0;  ///< means
};

/// Repeatable bit by bit (CPU) for a seed, also when it goes on from its state().
class Training {
 public:
  /// @param environment  must outlive it. @throws InputError for an unusable config
  Training(const TrainingConfig& config, const ActorCriticConfig& agent, Environment& environment);

  bool finished() const { return updates_ >= config_.updates; }
  /// One episode, with updates on the way.
  EpisodeReport episode();
  ActorCritic& agent() { return agent_; }
  const ActorCritic& agent() const { return agent_; }
  std::uint64_t updates() const { return updates_; }

  /// All that is needed to go on, between two episodes; demonstrations are shown again.
  std::string state() const;
  /// @throws InputError for another training's
  void set_state(std::string_view state);

 private:
  void show();
  void choose(const State& state, Noise& noise, Rng& rng, std::span<float> action) const;
  void learn(Rng& rng, EpisodeReport& report);

  TrainingConfig config_;
  Environment* environment_;
  ActorCritic agent_;
  ReplayBuffer own_, demonstrations_;
  std::uint64_t episodes_ = 0, steps_ = 0, updates_ = 0;
};

}  // namespace stairwell::rl
