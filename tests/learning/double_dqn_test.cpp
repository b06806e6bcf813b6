#include "learning/rl/double_dqn.hpp"

#include "core/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace stairwell;
using namespace stairwell::rl;

namespace {

constexpr int kStates = 7, kActions = 3;
constexpr double kDiscount = 0.9;

/// Random rewards and ways from state to state; some of them end.
struct SmallProcess {
  double reward[kStates][kActions];
  int next[kStates][kActions];  ///< -1: the end
  double best[kStates][kActions] = {};

  explicit SmallProcess(std::uint64_t seed) {
    Rng rng = make_rng(seed, "process");
    for (int s = 0; s < kStates; ++s) {
      for (int a = 0; a < kActions; ++a) {
        reward[s][a] = rng.uniform(-1.0, 1.0);
        next[s][a] = rng.uniform() < 0.15 ? -1 : rng.uniform_int(0, kStates - 1);
      }
    }
    for (int i = 0; i < 500; ++i) {  // value iteration
      for (int s = 0; s < kStates; ++s) {
        for (int a = 0; a < kActions; ++a) {
          const int n = next[s][a];
          best[s][a] = reward[s][a] + (n < 0 ? 0.0 : kDiscount * *std::max_element(best[n], best[n] + kActions));
        }
      }
    }
  }
};

/// Options are told apart by a 1 each.
std::vector<float> option(int s, int a) {
  std::vector<float> row(kStates * kActions, 0.0F);
  row[static_cast<std::size_t>(s * kActions + a)] = 1.0F;
  return row;
}

std::vector<float> options(int s) {
  std::vector<float> rows;
  for (int a = 0; a < kActions; ++a) {
    const std::vector<float> row = option(s, a);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  return rows;
}

DoubleDqnConfig config() {
  DoubleDqnConfig made;
  made.network.features = kStates * kActions;
  made.network.hidden = {};
  made.learning_rate = 5e-3;
  made.smoothing = 0.05;
  return made;
}

ChoiceReplay experience(const SmallProcess& process) {
  ChoiceReplay replay(1000);
  Rng rng = make_rng(1, "experience");
  for (int i = 0; i < 1500; ++i) {
    const int s = rng.uniform_int(0, kStates - 1), a = rng.uniform_int(0, kActions - 1), n = process.next[s][a];
    replay.add(
        {option(s, a), process.reward[s][a], n < 0 ? 0.0 : kDiscount, n < 0 ? std::vector<float>{} : options(n)});
  }
  return replay;
}

}  // namespace

TEST_CASE("Double DQN finds the values that value iteration finds", "[rl]") {
  for (const std::uint64_t seed : {1u, 2u}) {
    const SmallProcess process(seed);
    const ChoiceReplay replay = experience(process);
    CHECK(replay.size() == 1000);
    DoubleDqn agent(config());
    Rng rng = make_rng(2, "learn");
    for (int i = 0; i < 4000; ++i) agent.learn(replay.draw(64, rng));
    for (int s = 0; s < kStates; ++s) {
      const std::vector<float> values = agent.values(options(s));
      for (int a = 0; a < kActions; ++a) {
        CHECK(values[static_cast<std::size_t>(a)] == Approx(process.best[s][a]).margin(0.05));
      }
      const auto best = std::max_element(process.best[s], process.best[s] + kActions) - process.best[s];
      CHECK(agent.choose(options(s), 0.0, rng) == static_cast<std::size_t>(best));
    }
  }
}

TEST_CASE("Double DQN goes on from its bytes as if there had been no break", "[rl]") {
  const SmallProcess process(3);
  const ChoiceReplay replay = experience(process);
  DoubleDqn whole(config()), resumed(config());
  Rng rng = make_rng(4, "learn");
  for (int i = 0; i < 20; ++i) whole.learn(replay.draw(32, rng));
  nn::ByteWriter writer;
  whole.save(writer);
  replay.save(writer);
  nn::ByteReader reader(writer.bytes());
  resumed.load(reader);
  ChoiceReplay same(1000);
  same.load(reader);
  reader.finish();
  Rng one = make_rng(5, "learn"), two = make_rng(5, "learn");
  for (int i = 0; i < 20; ++i) {
    whole.learn(replay.draw(32, one));
    resumed.learn(same.draw(32, two));
  }
  CHECK((whole.parameters() == resumed.parameters()));
  ChoiceReplay smaller(10);
  nn::ByteWriter replay_only;
  replay.save(replay_only);
  nn::ByteReader again(replay_only.bytes());
  CHECK_THROWS_AS(smaller.load(again), InputError);
}

TEST_CASE("Double DQN with a chance of one chooses anything, and refuses other networks", "[rl]") {
  const DoubleDqn agent(config());
  Rng rng = make_rng(6, "choose");
  int seen[kActions] = {};
  for (int i = 0; i < 300; ++i) ++seen[agent.choose(options(0), 1.0, rng)];
  for (const int count : seen) CHECK(count > 60);
  DoubleDqnConfig wrong = config();
  wrong.network.outputs = 2;
  CHECK_THROWS_AS(DoubleDqn(wrong), InputError);
}
