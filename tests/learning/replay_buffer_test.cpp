#include "learning/rl/replay_buffer.hpp"

#include "core/errors.hpp"

#include <catch2/catch.hpp>

#include <map>

using namespace stairwell;
using namespace stairwell::rl;

namespace {

/// One look of a life that is written down in full.
struct Written {
  State state;
  float action = 0.0F, reward = 0.0F;
  bool acted = false, terminal = false;
};

State numbered(int number) {
  State state;
  state.windows = {static_cast<std::uint8_t>(number % 251), static_cast<std::uint8_t>(number / 251)};
  state.features = {static_cast<float>(number)};
  return state;
}

/// Episodes of any length, some with an end and some broken off, each look with its number as its feature.
std::vector<Written> random_life(ReplayBuffer& replay, int looks, Rng& rng) {
  std::vector<Written> life;
  while (static_cast<int>(life.size()) < looks) {
    const int steps = rng.uniform_int(1, 9);
    const bool ends = rng.uniform() < 0.5;
    life.push_back({numbered(static_cast<int>(life.size())), 0.0F, 0.0F, false, false});
    replay.begin(life.back().state);
    for (int i = 0; i < steps; ++i) {
      Written& now = life.back();
      now.action = static_cast<float>(rng.uniform(-1.0, 1.0));
      now.reward = static_cast<float>(rng.uniform(-1.0, 1.0));
      now.acted = true;
      now.terminal = ends && i + 1 == steps;
      const Written next{numbered(static_cast<int>(life.size())), 0.0F, 0.0F, false, false};
      replay.step(std::span(&now.action, 1), static_cast<double>(now.reward), now.terminal, next.state);
      life.push_back(next);
    }
  }
  return life;
}

}  // namespace

TEST_CASE("n-step transitions are what a life written down in full says", "[rl]") {
  Rng rng = make_rng(1, "replay");
  constexpr std::size_t kCapacity = 60;
  ReplayBuffer replay({2, 1, 1}, kCapacity);
  const std::vector<Written> life = random_life(replay, 200, rng);
  std::size_t kept = 0;
  for (std::size_t i = life.size() - kCapacity; i < life.size(); ++i) kept += life[i].acted ? 1 : 0;
  CHECK(replay.transitions() == kept);
  for (const std::size_t n : {1u, 3u, 20u}) {
    constexpr double kDiscount = 0.9;
    TransitionBatch batch;
    replay.draw(500, {n, kDiscount, false}, rng, batch);
    std::map<std::size_t, int> drawn;
    for (std::size_t row = 0; row < batch.count; ++row) {
      const auto from = static_cast<std::size_t>(batch.features[row]);
      ++drawn[from];
      REQUIRE(from + kCapacity >= life.size());
      REQUIRE(life[from].acted);
      double sum = 0.0;
      std::size_t at = from;
      for (std::size_t k = 0; k < n && life[at].acted; ++k, ++at) {
        sum += std::pow(kDiscount, k) * static_cast<double>(life[at].reward);
      }
      const double left = life[at - 1].terminal ? 0.0 : std::pow(kDiscount, at - from);
      CHECK(batch.actions[row] == life[from].action);
      CHECK(batch.rewards[row] == Approx(sum).margin(1e-6));
      CHECK(batch.discounts[row] == Approx(left).margin(1e-6));
      CHECK(batch.next_features[row] == static_cast<float>(at));
      CHECK(batch.windows[2 * row] == life[from].state.windows[0]);
      CHECK(batch.next_windows[2 * row + 1] == life[at].state.windows[1]);
    }
    CHECK(drawn.size() == kept);
  }
}

TEST_CASE("a batch has its share of demonstrations", "[rl]") {
  Rng rng = make_rng(2, "replay");
  ReplayBuffer own({2, 1, 1}, 50), shown({2, 1, 1}, 50), none({2, 1, 1}, 50);
  random_life(own, 30, rng);
  random_life(shown, 30, rng);
  const auto demonstrated = [](const TransitionBatch& batch) { return std::ranges::count(batch.demonstrated, 1.0F); };
  CHECK(demonstrated(draw_mixed(own, shown, 64, 0.5, {}, rng)) == 32);
  CHECK(demonstrated(draw_mixed(own, shown, 64, 0.0, {}, rng)) == 0);
  CHECK(demonstrated(draw_mixed(own, none, 64, 0.5, {}, rng)) == 0);
  CHECK(demonstrated(draw_mixed(none, shown, 64, 0.5, {}, rng)) == 64);
}

TEST_CASE("a replay comes back from its bytes, and refuses those of another", "[rl]") {
  Rng rng = make_rng(3, "replay");
  ReplayBuffer replay({2, 1, 1}, 40), same({2, 1, 1}, 40), other({2, 3, 1}, 20);
  random_life(replay, 70, rng);
  nn::ByteWriter writer;
  replay.save(writer);
  nn::ByteReader reader(writer.bytes());
  same.load(reader);
  reader.finish();
  Rng one = make_rng(4, "draw"), two = make_rng(4, "draw");
  TransitionBatch a, b;
  replay.draw(50, {2, 0.9, false}, one, a);
  same.draw(50, {2, 0.9, false}, two, b);
  CHECK(a.features == b.features);
  CHECK(a.next_windows == b.next_windows);
  CHECK(a.rewards == b.rewards);
  nn::ByteReader again(writer.bytes());
  CHECK_THROWS_AS(other.load(again), InputError);
  nn::ByteReader part(std::string_view(writer.bytes()).substr(0, writer.bytes().size() - 1));
  CHECK_THROWS_WITH(same.load(part), "truncated");
  CHECK_THROWS_AS(ReplayBuffer({1, 1, 1}, 1), InputError);
  State wrong;
  CHECK_THROWS_AS(replay.begin(wrong), InputError);
}
