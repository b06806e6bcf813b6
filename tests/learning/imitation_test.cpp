#include "learning/train/imitation.hpp"

#include "core/errors.hpp"
#include "learning/train/training_checkpoint.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::train;

namespace {

ImitationConfig small(ImitationConfig::Algorithm algorithm = ImitationConfig::Algorithm::kDagger) {
  ImitationConfig config = ImitationConfig::slice();
  config.algorithm = algorithm;
  config.steps = 180;
  config.steps_per_round = 60;
  config.looks_per_round = 150;
  config.capacity = 2000;
  config.batch = 64;
  return config;
}

}  // namespace

TEST_CASE("imitation learns, repeats by its seed and goes on from a checkpoint", "[imitation]") {
  Imitation one(small()), two(small());
  const RoundReport first = one.round();
  two.round();
  CHECK(first.looks >= 150);
  const RoundReport second = one.round();
  two.round();
  CHECK(second.loss < 0.3);  // one that knows nothing has 1
  CHECK(second.steps == 120);
  CHECK(one.state().parameters == two.state().parameters);

  const std::string bytes = checkpoint_bytes(one.state(), "settings");
  const ImitationState state = parse_checkpoint(bytes, "settings");
  Imitation resumed(small(), &state);
  CHECK(resumed.state().parameters == one.state().parameters);
  CHECK(resumed.round().round == 2);
  CHECK(resumed.finished());

  using Catch::Contains;
  CHECK_THROWS_WITH(parse_checkpoint(bytes, "others"), Contains("another training"));
  CHECK_THROWS_WITH(parse_checkpoint(bytes.substr(0, bytes.size() - 1), "settings"), Contains("truncated"));
  std::string damaged = bytes;
  damaged[bytes.size() / 2] = static_cast<char>(damaged[bytes.size() / 2] + 1);
  CHECK_THROWS_WITH(parse_checkpoint(damaged, "settings"), Contains("damaged"));
  CHECK_THROWS_AS(parse_checkpoint("", "settings"), InputError);
}

TEST_CASE("a mirrored look has the mirrored answer", "[imitation]") {
  planning3d::AgentInput input = planning3d::AgentInput::volume();
  Replay replay(input, nn::Head::kUnitVector, 3, 4);
  planning3d::Observation seen;
  std::size_t bytes = 0;
  for (const auto& window : input.windows()) bytes += window.values();
  seen.windows.assign(bytes, 128);
  const std::size_t z = 1, y = 3, x = 5;
  seen.windows[(z * 16 + y) * 16 + x] = 255;
  seen.features.assign(planning3d::AgentInput::kFeatures, 0.5F);
  const Eigen::Vector3d direction = Eigen::Vector3d(1.0, 2.0, -3.0).normalized();
  replay.add(seen, direction);
  Rng rng = make_rng(1, "draw");
  const nn::Batch batch = replay.draw(64, rng);
  bool turned = false, kept = false;
  for (std::size_t i = 0; i < batch.count; ++i) {
    const bool flip_y = batch.targets[3 * i + 1]<0.0F, flip_z = batch.targets[3 * i + 2]> 0.0F;
    const std::size_t at = ((flip_z ? 7 - z : z) * 16 + (flip_y ? 15 - y : y)) * 16 + x;
    CHECK(batch.windows[i * bytes + at] == 255);
    const float* f = batch.features.data() + i * planning3d::AgentInput::kFeatures;
    CHECK(f[0] == 0.5F);
    CHECK(f[1] == (flip_y ? -0.5F : 0.5F));
    CHECK(f[14] == (flip_z ? -0.5F : 0.5F));
    CHECK(f[15] == 0.5F);
    CHECK(f[17] == (flip_y ? -0.5F : 0.5F));
    CHECK(f[19] == 0.5F);
    turned = turned || (flip_y && flip_z);
    kept = kept || (!flip_y && !flip_z);
  }
  CHECK(turned);
  CHECK(kept);
}

TEST_CASE("training refuses what it cannot use", "[imitation]") {
  ImitationConfig config = small();
  config.capacity = 3;
  CHECK_THROWS_AS(Imitation(config), InputError);
  config = small();
  config.head = nn::Head::kValues;
  CHECK_THROWS_AS(Imitation(config), InputError);
}
