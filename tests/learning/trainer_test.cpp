#include "learning/nn/trainer.hpp"

#include "core/errors.hpp"
#include "learning/nn/network.hpp"
#include "learning/random_network.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::nn;

namespace {

/// Points on a line towards the features' own first three numbers: easy to learn.
struct Easy {
  testing::RandomInputs inputs;
  std::vector<float> targets;
  Batch batch;

  Easy(const NetworkSpec& spec, std::size_t count, std::uint64_t seed)
      : inputs(testing::random_inputs(spec, count, seed)) {
    const auto f = static_cast<std::size_t>(spec.features);
    for (std::size_t i = 0; i < count; ++i) {
      Eigen::Vector3d v(inputs.features[i * f], inputs.features[i * f + 1], inputs.features[i * f + 2]);
      v.normalize();
      for (Eigen::Index a = 0; a < spec.outputs; ++a) targets.push_back(static_cast<float>(v[a]));
    }
    batch = {count, inputs.windows, inputs.features, targets};
  }
};

}  // namespace

TEST_CASE("own inference equals LibTorch's of the same weights", "[trainer]") {
  for (const Head head : {Head::kValues, Head::kUnitVector, Head::kAngles}) {
    for (const bool norm : {false, true}) {
      NetworkSpec spec = testing::small_spec();
      spec.head = head;
      spec.outputs = head == Head::kAngles ? 2 : 3;
      spec.layer_norm = norm;
      Trainer trainer(spec, 5);
      trainer.set_parameters(testing::random_parameters(spec, 11));
      Network network(spec, trainer.parameters());
      const auto inputs = testing::random_inputs(spec, 16, 2);
      const auto expected = trainer.forward({16, inputs.windows, inputs.features, {}});
      std::vector<float> outputs(expected.size());
      network.infer_batch(16, inputs.windows, inputs.features, outputs);
      for (std::size_t i = 0; i < outputs.size(); ++i) CHECK(std::abs(outputs[i] - expected[i]) < 1e-4F);
    }
  }
}

TEST_CASE("steps lower the loss, and the same seed takes the same ones", "[trainer]") {
  const NetworkSpec spec = testing::small_spec();
  const Easy easy(spec, 64, 3);
  Trainer one(spec, 1), two(spec, 1), other(spec, 2);
  CHECK(one.parameters() == two.parameters());
  CHECK(one.parameters() != other.parameters());
  const double before = one.step(easy.batch);
  two.step(easy.batch);
  double after = before;
  for (int i = 0; i < 60; ++i) {
    after = one.step(easy.batch);
    two.step(easy.batch);
  }
  CHECK(after < 0.3 * before);
  CHECK(one.parameters() == two.parameters());
}

TEST_CASE("training goes on from its state as if there had been no break", "[trainer]") {
  const NetworkSpec spec = testing::small_spec();
  const Easy easy(spec, 32, 3);
  Trainer whole(spec, 1);
  for (int i = 0; i < 5; ++i) whole.step(easy.batch);
  Trainer resumed(spec, 99);
  resumed.set_parameters(whole.parameters());
  resumed.set_optimiser_state(whole.optimiser_state());
  for (int i = 0; i < 5; ++i) {
    whole.step(easy.batch);
    resumed.step(easy.batch);
  }
  CHECK(whole.parameters() == resumed.parameters());
  CHECK_THROWS_AS(resumed.set_optimiser_state("no such thing"), InputError);
  CHECK_THROWS_AS(resumed.set_parameters(std::vector<float>(3)), InputError);
}

TEST_CASE("a device that is not there is refused", "[trainer]") {
  CHECK_THROWS_AS(Trainer(testing::small_spec(), 1, {.device = "abacus"}), InputError);
}
