#pragma once

#include "core/rng.hpp"
#include "learning/nn/model_file.hpp"
#include "planning3d/agent_view.hpp"

#include <cmath>

namespace stairwell::testing {

/// Weights as after initialisation, the same for the same seed.
inline std::vector<float> random_parameters(const nn::NetworkSpec& spec, std::uint64_t seed) {
  Rng rng = make_rng(seed, "random-network");
  std::vector<float> parameters(spec.parameter_count());
  for (const nn::LayerShape& layer : nn::layers_of(spec)) {
    const double scale = std::sqrt(2.0 * layer.out / static_cast<double>(layer.weights));
    for (std::size_t i = 0; i < layer.weights; ++i) {
      parameters[layer.weights_at + i] = static_cast<float>(rng.normal(0.0, scale));
    }
    const std::size_t rest = static_cast<std::size_t>(layer.out) * (layer.norm ? 3 : 1);
    for (std::size_t i = 0; i < rest; ++i) parameters[layer.biases_at + i] = static_cast<float>(rng.normal(0.2, 0.3));
  }
  return parameters;
}

inline nn::NetworkSpec small_spec() {
  nn::NetworkSpec spec;
  spec.windows = {{3, {6, 9, 8}}, {2, {1, 12, 15}}};
  spec.trunk = {{8, 3, 2}, {24, 3, 2}, {16, 1, 1}};
  spec.features = 5;
  spec.hidden = {33, 16};
  spec.outputs = 3;
  spec.head = nn::Head::kUnitVector;
  return spec;
}

struct RandomInputs {
  std::vector<std::uint8_t> windows;
  std::vector<float> features;
};

inline RandomInputs random_inputs(const nn::NetworkSpec& spec, std::size_t count, std::uint64_t seed) {
  Rng rng = make_rng(seed, "random-inputs");
  RandomInputs inputs;
  inputs.windows.resize(count * spec.window_values());
  for (auto& byte : inputs.windows) byte = static_cast<std::uint8_t>(rng.uniform_int(1, 255));
  inputs.features.resize(count * static_cast<std::size_t>(spec.features));
  for (auto& value : inputs.features) value = static_cast<float>(rng.uniform(-1.0, 1.0));
  return inputs;
}

/// A path agent with random weights: what it does is of no use, but it does it.
inline nn::Model random_agent(const planning3d::AgentInput& input, std::uint64_t seed = 1) {
  nn::Model model;
  model.agent = input.plane ? "path2d" : "path3d";
  model.input = input.text();
  model.network.windows = input.windows();
  model.network.trunk = {{8, 3, 2}, {8, 3, 2}};
  model.network.features = planning3d::AgentInput::kFeatures;
  model.network.hidden = {16};
  model.network.outputs = input.plane ? 2 : 3;
  model.network.head = nn::Head::kUnitVector;
  model.command = "none";
  model.commit = "none";
  model.parameters = random_parameters(model.network, seed);
  return model;
}

}  // namespace stairwell::testing
