#include "learning/train/path_reinforcement.hpp"

#include "core/errors.hpp"
#include "learning/train/imitation.hpp"

namespace stairwell::train {

namespace {

PathEnvironmentConfig seeded(PathEnvironmentConfig environment, std::uint64_t seed) {
  environment.seed = seed;
  return environment;
}

}  // namespace

nn::NetworkSpec PathReinforcementConfig::network() const {
  ImitationConfig same = environment.input.plane ? ImitationConfig::slice() : ImitationConfig::volume();
  same.input = environment.input;
  same.head = environment.head;
  return same.network();
}

rl::ActorCriticConfig PathReinforcementConfig::agent() const {
  rl::ActorCriticConfig agent =
      algorithm == Algorithm::kDdpg ? rl::ActorCriticConfig::ddpg(network()) : rl::ActorCriticConfig{};
  agent.algorithm = algorithm;
  agent.actor = network();
  agent.seed = seed;
  agent.device = device;
  return agent;
}

rl::TrainingConfig PathReinforcementConfig::training(bool from_model) const {
  constexpr std::size_t kShown = 6'000;
  rl::TrainingConfig training;
  training.seed = seed;
  training.updates = steps;
  training.capacity = 20'000;
  training.steps_per_update = 4;
  training.warmup = 2'000;
  training.random_warmup = !from_model;
  training.critic_only = from_model ? steps / 5 : 0;
  training.noise.sigma = 0.15;
  if (algorithm == Algorithm::kDdpg) {
    training.noise.kind = rl::NoiseConfig::Kind::kOrnsteinUhlenbeck;
  } else {
    training.n_step = 3;
  }
  training.demonstration_share = demonstration_share.value_or(algorithm == Algorithm::kTd3Bc ? 0.5 : 0.0);
  training.demonstrations = training.demonstration_share > 0.0 ? kShown : 0;
  return training;
}

PathReinforcement::PathReinforcement(const PathReinforcementConfig& config, const nn::Model* from)
    : config_(config),
      environment_(seeded(config.environment, config.seed)),
      training_(config.training(from != nullptr), config.agent(), environment_) {
  if (from == nullptr) return;
  if (from->network != config.network() || from->input != config.environment.input.text()) {
    throw InputError("another network or input than the one to be trained: " + from->network.text());
  }
  training_.agent().set_policy_parameters(from->parameters);
}

nn::Model PathReinforcement::model() const {
  return path_model(config_.environment.input, config_.network(), config_.seed, training_.updates(),
                    training_.agent().policy_parameters());
}

}  // namespace stairwell::train
