#include "learning/train/path_environment.hpp"

#include "core/errors.hpp"
#include "learning/random_network.hpp"
#include "learning/train/path_reinforcement.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace stairwell;
using namespace stairwell::train;

namespace {

PathEnvironmentConfig config_of(bool plane, PathEnvironmentConfig::Reward reward) {
  PathEnvironmentConfig config;
  config.input = plane ? planning3d::AgentInput::slice() : planning3d::AgentInput::volume();
  config.reward = reward;
  return config;
}

struct Flown {
  double reward = 0.0, last_reward = 0.0;
  int steps = 0;
  bool success = false, terminal = false;
};

template <typename Choose>
Flown fly(PathEnvironment& environment, std::uint64_t episode, const Choose& choose) {
  rl::State state;
  Flown flown;
  environment.begin(episode, state);
  for (bool ended = false; !ended;) {
    const rl::StepResult result = environment.step(choose(environment), state);
    flown.reward += result.reward;
    flown.last_reward = result.reward;
    flown.success = result.success;
    flown.terminal = result.terminal;
    ended = result.ended;
    ++flown.steps;
  }
  return flown;
}

std::vector<float> taught(PathEnvironment& environment, std::size_t size) {
  std::vector<float> action(size, 0.0F);
  action[0] = 1.0F;
  environment.demonstrate(action);
  return action;
}

}  // namespace

TEST_CASE("an episode is the same whatever was flown before", "[rl]") {
  const auto config = config_of(true, PathEnvironmentConfig::Reward::kProgress);
  PathEnvironment one(config), two(config);
  rl::State a, b;
  for (const std::uint64_t episode : {41u, 0u, 12u, 5u}) one.begin(episode, a);
  two.begin(5, b);
  CHECK(a.windows == b.windows);
  CHECK(a.features == b.features);
  one.begin(6, a);
  CHECK(a.features != b.features);
}

TEST_CASE("rewards are finite, also where the sphere fits beside the field's last cell", "[rl]") {
  for (const auto reward : {PathEnvironmentConfig::Reward::kProgress, PathEnvironmentConfig::Reward::kThesis}) {
    PathEnvironment environment(config_of(true, reward));
    Rng rng = make_rng(2, "astray");
    for (std::uint64_t e = 0; e < 200; ++e) {
      const auto astray = [&](PathEnvironment&) {
        return std::vector<float>{static_cast<float>(rng.normal(0.3, 1.0)), static_cast<float>(rng.normal(0.0, 1.0))};
      };
      CHECK(std::isfinite(fly(environment, e, astray).reward));
    }
  }
}

TEST_CASE("who demonstrates arrives, and is paid for it", "[rl]") {
  for (const bool plane : {true, false}) {
    for (const auto reward : {PathEnvironmentConfig::Reward::kProgress, PathEnvironmentConfig::Reward::kThesis}) {
      PathEnvironment environment(config_of(plane, reward));
      int arrived = 0, paid = 0;
      constexpr int kFlights = 20;
      for (int e = 0; e < kFlights; ++e) {
        const Flown flown = fly(environment, static_cast<std::uint64_t>(10 * e),
                                [&](PathEnvironment& here) { return taught(here, plane ? 2 : 3); });
        arrived += flown.success ? 1 : 0;
        paid += flown.reward > 0.0 ? 1 : 0;
        if (!flown.success) continue;
        CHECK(flown.terminal);
        CHECK(flown.last_reward == (reward == PathEnvironmentConfig::Reward::kThesis ? 10.0 : 5.0));
      }
      CHECK(arrived >= kFlights - 2);
      CHECK(paid >= kFlights - 2);
    }
  }
}

TEST_CASE("who flies the wrong way loses, and hits something", "[rl]") {
  for (const auto reward : {PathEnvironmentConfig::Reward::kProgress, PathEnvironmentConfig::Reward::kThesis}) {
    PathEnvironment environment(config_of(true, reward));
    int hit = 0;
    for (std::uint64_t e = 0; e < 10; ++e) {
      const Flown flown = fly(environment, 7 * e, [](PathEnvironment&) { return std::vector<float>{-1.0F, 0.3F}; });
      CHECK(flown.reward < 0.0);
      CHECK_FALSE(flown.success);
      if (!flown.terminal) continue;
      ++hit;
      CHECK(flown.last_reward == (reward == PathEnvironmentConfig::Reward::kThesis ? -10.0 : -5.0));
    }
    CHECK(hit > 0);
  }
}

TEST_CASE("a path agent is trained from a model, and only from one that fits", "[rl]") {
  PathReinforcementConfig config;
  config.steps = 4;
  nn::Model from;
  from.agent = "path2d";
  from.input = config.environment.input.text();
  from.network = config.network();
  from.parameters = testing::random_parameters(from.network, 3);
  PathReinforcement learner(config, &from);
  CHECK((learner.model().parameters == from.parameters));
  CHECK(learner.model().network == from.network);
  from.network.hidden = {8};
  CHECK_THROWS_AS(PathReinforcement(config, &from), InputError);
}
