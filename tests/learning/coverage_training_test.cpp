#include "learning/train/coverage_training.hpp"

#include "core/errors.hpp"
#include "coverage3d/agent_strategy.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace stairwell;
using namespace stairwell::train;
using coverage3d::kOptionFeatures;
using coverage3d::OptionChoice;

namespace {

CoverageEnvironmentConfig small() {
  CoverageEnvironmentConfig config;
  config.worlds.most_storeys = 1;
  config.worlds.least_size_m = 5.0;
  config.worlds.most_size_m = 8.0;
  config.most_uavs = 2;
  return config;
}

coverage3d::OptionChooser any_option(Rng& rng) {
  return [&rng](const OptionChoice& choice) {
    return static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(choice.count()) - 1));
  };
}

std::vector<float> row_at(const OptionChoice& choice, std::size_t option) {
  const auto begin = choice.rows.begin() + static_cast<std::ptrdiff_t>(option) * kOptionFeatures;
  return {begin, begin + kOptionFeatures};
}

}  // namespace

TEST_CASE("buildings have starts with room around them, near each other and not in each other's way") {
  Rng rng = make_rng(3, "buildings");
  for (int i = 0; i < 10; ++i) {
    const Building building = make_building(small().worlds, 3, rng);
    REQUIRE_FALSE(building.starts_m.empty());
    for (const Eigen::Vector3d& a_m : building.starts_m) {
      CHECK((a_m - building.starts_m[0]).norm() < 4.0);
      for (const Eigen::Vector3d& b_m : building.starts_m) CHECK((&a_m == &b_m || (a_m - b_m).norm() > 0.8));
      for (double angle = 0.0; angle < 6.2; angle += 0.1) {
        const Eigen::Vector3d beside_m = a_m + 0.3 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
        CHECK(building.scene.solid[building.scene.grid.linear(building.scene.grid.index_of(beside_m))] == 0);
      }
    }
  }
}

TEST_CASE("an exploration pays each choice for what came until the next one") {
  CoverageEnvironmentConfig config = small();
  config.most_uavs = 1;
  config.horizon_s = 1e9;  // no discount: rewards add up
  using Reward = CoverageEnvironmentConfig::Reward;
  for (const Reward reward : {Reward::kProgress, Reward::kThesis}) {
    config.reward = reward;
    const CoverageEnvironment environment(config);
    Rng rng = make_rng(4, "fly");
    std::vector<OptionChoice> asked;
    std::vector<std::size_t> answers;
    const ExplorationReport flown = environment.fly(2, [&](const OptionChoice& choice) {
      asked.push_back(choice);
      answers.push_back(any_option(rng)(choice));
      return answers.back();
    });
    REQUIRE(flown.choices.size() == asked.size());
    REQUIRE(asked.size() >= 2);
    double sum = 0.0;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      CHECK(flown.choices[i].chosen == row_at(asked[i], answers[i]));
      const bool last = i + 1 == asked.size();
      CHECK(flown.choices[i].discount == Approx(last ? 0.0 : 1.0).margin(1e-6));
      CHECK(flown.choices[i].next_options == (last ? std::vector<float>{} : asked[i + 1].rows));
      sum += flown.choices[i].reward;
    }
    // The first look around came before any choice, and is nobody's merit.
    CHECK(sum < flown.reward);
    CHECK(sum > (reward == Reward::kThesis ? 5.0 : 0.5));
    const double fines = reward == Reward::kThesis ? 5.0 * static_cast<double>(flown.failures) : 0.0;
    CHECK(flown.reward <= (reward == Reward::kThesis ? 100.0 : std::log(1.1 / 0.1)) + 1e-6);
    CHECK(flown.reward >= (reward == Reward::kThesis ? 100.0 : std::log(1.1 / 0.1)) - fines - 1e-6);
    CHECK(flown.t90_s <= flown.finish_s);

    Rng same = make_rng(4, "fly");
    const ExplorationReport again = environment.fly(2, any_option(same));
    CHECK(again.finish_s == flown.finish_s);
    CHECK(again.choices.back().reward == flown.choices.back().reward);
  }
  config.horizon_s = 0.0;
  CHECK_THROWS_AS(CoverageEnvironment(config), InputError);
}

TEST_CASE("a coverage training goes on from its bytes as if there had been no break") {
  CoverageTrainingConfig config;
  config.environment = small();
  config.steps = 60;
  config.batch = 16;
  config.updates_per_choice = 1.0;
  CoverageTraining whole(config), resumed(config);
  whole.episode();
  resumed.set_state(whole.state());
  while (!whole.finished()) {
    const CoverageEpisode one = whole.episode(), two = resumed.episode();
    CHECK(one.flown.finish_s == two.flown.finish_s);
    CHECK((one.loss == two.loss || std::isnan(one.loss)));
  }
  CHECK(resumed.finished());
  const nn::Model model = whole.model();
  CHECK(model.steps == 60);
  CHECK(model.parameters == resumed.model().parameters);
  CHECK_THROWS_AS(resumed.set_state(whole.state().substr(0, 100)), InputError);
}

TEST_CASE("the trained agent explores new buildings sooner than one that always flies to the nearest") {
  CoverageEnvironmentConfig config = small();
  config.worlds.least_size_m = 7.0;
  config.worlds.most_size_m = 10.0;
  config.seed = 77;
  const CoverageEnvironment environment(config);
  const coverage3d::OptionChooser agent = coverage3d::load_coverage_agent(STAIRWELL_SOURCE_DIR "/models");
  const auto soonest = [](const OptionChoice& choice) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < choice.count(); ++i) {
      const auto time = [&](std::size_t of) { return row_at(choice, of)[0]; };
      if (time(i) < time(best)) best = i;
    }
    return best;
  };
  double agent_reward = 0.0, nearest_reward = 0.0;
  for (std::uint64_t episode = 0; episode < 10; ++episode) {
    agent_reward += environment.fly(episode, agent).reward;
    nearest_reward += environment.fly(episode, soonest).reward;
  }
  CHECK(agent_reward > nearest_reward + 0.3);
}
