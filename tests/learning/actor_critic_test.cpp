#include "learning/rl/actor_critic.hpp"

#include "core/errors.hpp"
#include "learning/rl/training.hpp"
#include "learning/toy_environments.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::rl;
using Algorithm = ActorCriticConfig::Algorithm;

namespace {

nn::NetworkSpec dense(int features, std::vector<int> hidden, int outputs, nn::Head head = nn::Head::kValues) {
  nn::NetworkSpec spec;
  spec.features = features;
  spec.hidden = std::move(hidden);
  spec.outputs = outputs;
  spec.head = head;
  return spec;
}

/// K of the u = -K x that is nearest to what the agent does where the cart is.
Eigen::RowVector2d gain_of(const ActorCritic& agent) {
  using testing::LineCart;
  Eigen::Matrix<double, 2, 2> xx = Eigen::Matrix2d::Zero();
  Eigen::RowVector2d ux = Eigen::RowVector2d::Zero();
  Rng rng = make_rng(3, "gain");
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector2d x(rng.uniform(-LineCart::kMostOff, LineCart::kMostOff),
                            rng.uniform(-LineCart::kMostOff, LineCart::kMostOff));
    std::vector<float> action(1);
    agent.act({{}, {static_cast<float>(x.x()), static_cast<float>(x.y())}}, action);
    ux -= LineCart::kMostPush * static_cast<double>(action[0]) * x.transpose();
    xx += x * x.transpose();
  }
  return ux * xx.inverse();
}

}  // namespace

TEST_CASE("actors and critics learn the gain that Riccati's equation gives", "[rl]") {
  const Eigen::RowVector2d best = testing::LineCart::best_gain(0.9);
  CHECK(best.norm() > 1.0);
  for (const Algorithm algorithm : {Algorithm::kDdpg, Algorithm::kTd3, Algorithm::kSac}) {
    ActorCriticConfig agent;
    agent.algorithm = algorithm;
    agent.actor = dense(2, {}, 1);
    agent.critic_hidden = {64, 64};
    agent.critic_layer_norm = false;
    agent.actor_learning_rate = 1e-3;
    agent.smoothing = 0.02;
    agent.target_noise = 0.05;
    agent.target_noise_clip = 0.1;
    agent.temperature = 0.001;
    agent.target_entropy = -2.5;
    TrainingConfig config;
    config.updates = 4000;
    config.warmup = 1000;
    config.batch = 128;
    config.discount = 0.9;
    config.noise = {NoiseConfig::Kind::kOrnsteinUhlenbeck, 0.2, 0.3};
    testing::LineCart cart;
    Training training(config, agent, cart);
    while (!training.finished()) training.episode();
    const Eigen::RowVector2d learned = gain_of(training.agent());
    INFO("algorithm " << static_cast<int>(algorithm) << ": " << learned << " for " << best);
    CHECK((learned - best).norm() < 0.15 * best.norm());
  }
}

TEST_CASE("TD3 and SAC swing a pendulum up", "[rl]") {
  for (const Algorithm algorithm : {Algorithm::kTd3, Algorithm::kSac}) {
    ActorCriticConfig agent;
    agent.algorithm = algorithm;
    agent.actor = dense(3, {64, 64}, 1);
    agent.critic_hidden = {64, 64};
    agent.actor_learning_rate = 1e-3;
    TrainingConfig config;
    config.updates = 3500;
    config.warmup = 500;
    config.discount = 0.97;
    config.batch = 128;
    testing::Pendulum pendulum(1);
    Training training(config, agent, pendulum);
    while (!training.finished()) training.episode();
    const double reached = testing::mean_return(training.agent(), pendulum, 20);
    INFO("algorithm " << static_cast<int>(algorithm));
    CHECK(reached > -250.0);  // -1200 hanging, -145 at best
  }
}
