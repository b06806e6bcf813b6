#include "learning/nn/network.hpp"

#include "core/errors.hpp"
#include "learning/random_network.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;
using namespace stairwell::nn;
using testing::random_parameters;
using testing::small_spec;

namespace {

/// The network, word for word.
std::vector<double> plain_forward(const NetworkSpec& spec, const std::vector<float>& p,
                                  const testing::RandomInputs& in) {
  std::vector<double> flat;
  const auto layers = layers_of(spec);
  std::size_t l = 0, byte = 0;
  for (const WindowInput& window : spec.windows) {
    std::vector<double> x;
    for (std::size_t i = 0; i < window.values(); ++i) x.push_back((in.windows[byte++] - 128) / 127.0);
    for (std::size_t c = 0; c < spec.trunk.size(); ++c) {
      const LayerShape& s = layers[l++];
      std::vector<double> y;
      for (int o = 0; o < s.out; ++o) {
        for (int z = 0; z < s.out_size[0]; ++z) {
          for (int row = 0; row < s.out_size[1]; ++row) {
            for (int col = 0; col < s.out_size[2]; ++col) {
              double sum = p[s.biases_at + static_cast<std::size_t>(o)];
              std::size_t w = s.weights_at + static_cast<std::size_t>(o) * s.weights / static_cast<std::size_t>(s.out);
              for (int i = 0; i < s.in; ++i) {
                for (int kz = 0; kz < s.kernel[0]; ++kz) {
                  for (int ky = 0; ky < s.kernel[1]; ++ky) {
                    for (int kx = 0; kx < s.kernel[2]; ++kx, ++w) {
                      const int iz = z * s.stride[0] + kz - s.kernel[0] / 2,
                                iy = row * s.stride[1] + ky - s.kernel[1] / 2,
                                ix = col * s.stride[2] + kx - s.kernel[2] / 2;
                      if (iz < 0 || iy < 0 || ix < 0 || iz >= s.in_size[0] || iy >= s.in_size[1] || ix >= s.in_size[2])
                        continue;
                      sum += p[w] * x[static_cast<std::size_t>(
                                        ((i * s.in_size[0] + iz) * s.in_size[1] + iy) * s.in_size[2] + ix)];
                    }
                  }
                }
              }
              y.push_back(std::max(0.0, sum));
            }
          }
        }
      }
      x = y;
    }
    flat.insert(flat.end(), x.begin(), x.end());
  }
  flat.insert(flat.end(), in.features.begin(), in.features.end());
  for (; l < layers.size(); ++l) {
    const LayerShape& s = layers[l];
    std::vector<double> y;
    for (std::size_t o = 0; o < static_cast<std::size_t>(s.out); ++o) {
      double sum = p[s.biases_at + o];
      for (std::size_t i = 0; i < flat.size(); ++i) sum += p[s.weights_at + o * flat.size() + i] * flat[i];
      y.push_back(s.relu ? std::max(0.0, sum) : sum);
    }
    flat = y;
  }
  double square = 0.0;
  for (const double v : flat) square += v * v;
  for (double& v : flat) v /= std::sqrt(square);
  return flat;
}

}  // namespace

TEST_CASE("inference equals the sums written out", "[nn]") {
  const NetworkSpec spec = small_spec();
  const auto parameters = random_parameters(spec, 3);
  Network network(spec, parameters);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const auto inputs = testing::random_inputs(spec, 1, seed);
    std::vector<float> outputs(3);
    network.infer(inputs.windows, inputs.features, outputs);
    const auto expected = plain_forward(spec, parameters, inputs);
    for (std::size_t i = 0; i < 3; ++i) CHECK(outputs[i] == Approx(expected[i]).margin(1e-5));
  }
}

TEST_CASE("a batch is its inputs one by one, and nothing stays from one to the next", "[nn]") {
  const NetworkSpec spec = small_spec();
  Network network(spec, random_parameters(spec, 4));
  const std::size_t count = 7;
  const auto inputs = testing::random_inputs(spec, count, 9);
  std::vector<float> together(3 * count), alone(3);
  network.infer_batch(count, inputs.windows, inputs.features, together);
  const std::size_t w = spec.window_values();
  for (std::size_t i = count; i-- > 0;) {
    network.infer(std::span(inputs.windows).subspan(i * w, w), std::span(inputs.features).subspan(i * 5, 5), alone);
    for (std::size_t k = 0; k < 3; ++k) CHECK(alone[k] == together[3 * i + k]);
  }
}

TEST_CASE("network descriptions are read as they are written", "[nn]") {
  NetworkSpec spec = small_spec();
  CHECK(NetworkSpec::parse(spec.text()) == spec);
  spec.layer_norm = true;
  spec.head = Head::kAngles;
  spec.outputs = 2;
  CHECK(NetworkSpec::parse(spec.text()) == spec);
  NetworkSpec dense;
  dense.features = 4;
  CHECK(NetworkSpec::parse(dense.text()) == dense);
  using Catch::Contains;
  CHECK_THROWS_WITH(NetworkSpec::parse("windows 3x8"), Contains("CHANNELSxZxYxX"));
  CHECK_THROWS_WITH(NetworkSpec::parse("features 4 head sideways"), Contains("sideways"));
  CHECK_THROWS_WITH(NetworkSpec::parse("features 4 conv 7k3s2"), Contains("multiple of 8"));
  CHECK_THROWS_WITH(NetworkSpec::parse("features"), Contains("no value"));
  CHECK_THROWS_WITH(NetworkSpec::parse("outputs 3"), Contains("no input"));
}

TEST_CASE("a network refuses what does not fit", "[nn]") {
  const NetworkSpec spec = small_spec();
  auto parameters = random_parameters(spec, 4);
  Network network(spec, parameters);
  const auto inputs = testing::random_inputs(spec, 1, 1);
  std::vector<float> outputs(2);
  CHECK_THROWS_AS(network.infer(inputs.windows, inputs.features, outputs), InputError);
  parameters[7] = std::nanf("");
  CHECK_THROWS_AS(Network(spec, parameters), InputError);
  parameters.pop_back();
  CHECK_THROWS_AS(Network(spec, parameters), InputError);
}
