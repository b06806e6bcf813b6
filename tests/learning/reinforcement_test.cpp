#include "core/errors.hpp"
#include "learning/nn/network.hpp"
#include "learning/rl/training.hpp"
#include "learning/toy_environments.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::rl;
using Algorithm = ActorCriticConfig::Algorithm;

namespace {

ActorCriticConfig pointing_agent(Algorithm algorithm) {
  ActorCriticConfig agent;
  agent.algorithm = algorithm;
  agent.actor.features = 3;
  agent.actor.hidden = {32};
  agent.actor.outputs = 3;
  agent.actor.head = nn::Head::kUnitVector;
  agent.critic_hidden = {64, 64};
  agent.actor_learning_rate = 1e-3;
  return agent;
}

TrainingConfig short_training() {
  TrainingConfig config;
  config.updates = 60;
  config.warmup = 40;
  config.batch = 16;
  config.capacity = 70;
  config.n_step = 2;
  config.demonstrations = 20;
  config.demonstration_share = 0.25;
  config.noise = {NoiseConfig::Kind::kOrnsteinUhlenbeck, 0.2, 0.15};
  return config;
}

}  // namespace

TEST_CASE("a resumed training is the one that went on, to the bit", "[rl]") {
  for (const Algorithm algorithm : {Algorithm::kDdpg, Algorithm::kTd3, Algorithm::kSac, Algorithm::kTd3Bc}) {
    testing::Pointing first, second;
    Training whole(short_training(), pointing_agent(algorithm), first);
    while (whole.updates() < 25) whole.episode();
    const std::string kept = whole.state();
    Training resumed(short_training(), pointing_agent(algorithm), second);
    CHECK((resumed.agent().policy_parameters() != whole.agent().policy_parameters()));
    resumed.set_state(kept);
    while (!whole.finished()) {
      const EpisodeReport a = whole.episode(), b = resumed.episode();
      CHECK(a.reward == b.reward);
      CHECK(a.updates == b.updates);
    }
    CHECK(resumed.finished());
    CHECK((whole.agent().policy_parameters() == resumed.agent().policy_parameters()));
    const State state{{}, {0.6F, 0.0F, 0.8F}};
    const std::vector<float> action{0.0F, 0.6F, 0.8F};
    CHECK(whole.agent().value(state, action) == resumed.agent().value(state, action));
    CHECK_THROWS_AS(resumed.set_state(kept.substr(0, kept.size() - 1)), InputError);
    CHECK_THROWS_AS(resumed.set_state(kept + "x"), InputError);
    Training other(short_training(), pointing_agent(Algorithm::kDdpg), second);
    if (algorithm != Algorithm::kDdpg) CHECK_THROWS_AS(other.set_state(kept), InputError);
  }
}

TEST_CASE("what is deployed does what the agent does, and an agent can start from it", "[rl]") {
  for (const Algorithm algorithm : {Algorithm::kTd3, Algorithm::kSac}) {
    const ActorCriticConfig config = pointing_agent(algorithm);
    testing::Pointing pointing;
    Training training(short_training(), config, pointing);
    while (!training.finished()) training.episode();
    nn::Network deployed(config.actor, training.agent().policy_parameters());
    ActorCritic started(config);
    started.set_policy_parameters(training.agent().policy_parameters());
    Rng rng = make_rng(1, "compare");
    for (int i = 0; i < 20; ++i) {
      State state;
      for (int k = 0; k < 3; ++k) state.features.push_back(static_cast<float>(rng.normal()));
      std::vector<float> mine(3), theirs(3), third(3);
      training.agent().act(state, mine);
      started.act(state, third);
      deployed.infer({}, state.features, theirs);
      for (std::size_t k = 0; k < 3; ++k) {
        CHECK(mine[k] == Approx(theirs[k]).margin(1e-4));
        CHECK(mine[k] == Approx(third[k]).margin(1e-4));
      }
    }
    CHECK_THROWS_AS(started.set_policy_parameters(std::vector<float>(3)), InputError);
  }
}

TEST_CASE("directions are learned by trial and error, and with TD3+BC from what is shown", "[rl]") {
  for (const Algorithm algorithm : {Algorithm::kTd3, Algorithm::kSac, Algorithm::kTd3Bc}) {
    TrainingConfig config;
    config.updates = 1500;
    config.warmup = 300;
    config.batch = 64;
    config.noise.sigma = 0.3;
    if (algorithm == Algorithm::kTd3Bc) {  // nothing else is seen
      config.demonstrations = 500;
      config.demonstration_share = 1.0;
    }
    testing::Pointing pointing;
    ActorCriticConfig agent = pointing_agent(algorithm);
    agent.target_entropy = -3.0;
    Training training(config, agent, pointing);
    while (!training.finished()) training.episode();
    INFO(static_cast<int>(algorithm));
    CHECK(testing::mean_return(training.agent(), pointing, 40) > 4.0);  // 5 is all, 0 without learning
  }
}

TEST_CASE("a trained actor stays as it is while its critics learn", "[rl]") {
  TrainingConfig config = short_training();
  config.critic_only = 60;
  testing::Pointing pointing;
  Training training(config, pointing_agent(Algorithm::kTd3), pointing);
  const std::vector<float> before = training.agent().policy_parameters();
  while (!training.finished()) training.episode();
  CHECK((training.agent().policy_parameters() == before));
}

TEST_CASE("learning refuses what it cannot use", "[rl]") {
  testing::Pointing pointing;
  testing::Pendulum pendulum(1);
  TrainingConfig config = short_training();
  config.discount = 1.5;
  CHECK_THROWS_AS(Training(config, pointing_agent(Algorithm::kTd3), pointing), InputError);
  ActorCriticConfig agent = pointing_agent(Algorithm::kTd3);
  agent.smoothing = 0.0;
  CHECK_THROWS_AS(ActorCritic(agent), InputError);
  CHECK_THROWS_WITH(Training(short_training(), pointing_agent(Algorithm::kTd3), pendulum),
                    Catch::Contains("nobody demonstrates"));
}
