#include "learning/nn/network.hpp"

#include "core/errors.hpp"
#include "learning/nn/network_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace stairwell::nn {

namespace {

std::size_t size_of(int n) { return static_cast<std::size_t>(n); }

/// Floats of a convolution's input with its border.
std::array<std::size_t, 3> padded_size(const LayerShape& shape) {
  std::array<std::size_t, 3> size{};
  for (std::size_t a = 0; a < 3; ++a) size[a] = size_of(shape.in_size[a] + shape.kernel[a] - 1);
  return size;
}

/// From [out, in, z, y, x] to [z, y, x, in, out], outputs filled up.
std::vector<float> repack(const LayerShape& shape, const float* weights) {
  const std::size_t in = size_of(shape.in), out = size_of(shape.out), lanes = padded_outputs(out);
  const std::size_t taps = shape.weights / (in * out);
  std::vector<float> packed(taps * in * lanes, 0.0F);
  for (std::size_t o = 0; o < out; ++o) {
    for (std::size_t i = 0; i < in; ++i) {
      for (std::size_t t = 0; t < taps; ++t) packed[(t * in + i) * lanes + o] = weights[(o * in + i) * taps + t];
    }
  }
  return packed;
}

/// What a byte of a window stands for.
const std::array<float, 256>& byte_values() {
  static const std::array<float, 256> values = [] {
    std::array<float, 256> all{};
    for (int byte = 0; byte < 256; ++byte) all[size_of(byte)] = static_cast<float>(byte - 128) / 127.0F;
    return all;
  }();
  return values;
}

void normalise_layer(std::span<float> values, const std::vector<float>& norm) {
  float mean = 0.0F, square = 0.0F;
  for (const float v : values) mean += v;
  mean /= static_cast<float>(values.size());
  for (const float v : values) square += (v - mean) * (v - mean);
  const float scale = 1.0F / std::sqrt(square / static_cast<float>(values.size()) + kNormEpsilon);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = (values[i] - mean) * scale * norm[i] + norm[values.size() + i];
  }
}

void finish(Head head, std::span<float> outputs) {
  if (head == Head::kAngles) {
    for (float& v : outputs) v = std::tanh(v);
  } else if (head == Head::kUnitVector) {
    float square = 0.0F;
    for (const float v : outputs) square += v * v;
    if (square <= 0.0F) return;
    for (float& v : outputs) v /= std::sqrt(square);
  }
}

}  // namespace

Network::Network(const NetworkSpec& spec, std::span<const float> parameters) : spec_(spec) {
  if (const auto list = spec.problems(); !list.empty()) throw InputError("network: " + list.front());
  if (parameters.size() != spec.parameter_count()) {
    throw InputError("network: " + std::to_string(parameters.size()) + " parameters where the layers have " +
                     std::to_string(spec.parameter_count()));
  }
  if (!std::ranges::all_of(parameters, [](float p) { return std::isfinite(p); })) {
    throw InputError("network: a parameter is not finite");
  }
  trunks_.resize(spec.windows.size());
  std::size_t widest = 0, last = 0, flat = size_of(spec.features);
  for (const LayerShape& shape : layers_of(spec)) {
    Layer layer{shape, repack(shape, parameters.data() + shape.weights_at), {}, {}, {}};
    layer.biases.assign(padded_outputs(size_of(shape.out)), 0.0F);
    std::copy_n(parameters.data() + shape.biases_at, shape.out, layer.biases.begin());
    if (shape.norm)
      layer.norm.assign(parameters.data() + shape.norm_at, parameters.data() + shape.norm_at + 2 * shape.out);
    if (!shape.conv) {
      widest = std::max(widest, layer.biases.size());
      dense_.push_back(std::move(layer));
      continue;
    }
    const auto size = padded_size(shape);
    layer.input.assign(size[0] * size[1] * size[2] * size_of(shape.in), 0.0F);
    last = std::max(last, WindowInput{shape.out, shape.out_size}.values());
    trunks_[size_of(shape.window)].push_back(std::move(layer));
  }
  flat = size_of(dense_.front().shape.in);
  last_.assign(last, 0.0F);
  flat_.assign(std::max(flat, widest), 0.0F);
  hidden_.assign(widest, 0.0F);
}

void Network::load_window(const WindowInput& window, const std::uint8_t* bytes, std::vector<float>& padded,
                          const LayerShape& shape) const {
  const auto size = padded_size(shape);
  const std::size_t channels = size_of(window.channels);
  const std::array<float, 256>& values = byte_values();
  for (std::size_t c = 0; c < channels; ++c) {
    for (int z = 0; z < window.size[0]; ++z) {
      for (int y = 0; y < window.size[1]; ++y) {
        const std::size_t row =
            (size_of(z + shape.kernel[0] / 2) * size[1] + size_of(y + shape.kernel[1] / 2)) * size[2];
        float* to = padded.data() + (row + size_of(shape.kernel[2] / 2)) * channels + c;
        for (int x = 0; x < window.size[2]; ++x, to += channels) *to = values[*bytes++];
      }
    }
  }
}

std::size_t Network::run_trunk(std::size_t window, const std::uint8_t* bytes, float* flat) {
  std::vector<Layer>& trunk = trunks_[window];
  if (trunk.empty()) {
    const std::size_t count = spec_.windows[window].values();
    for (std::size_t i = 0; i < count; ++i) flat[i] = byte_values()[bytes[i]];
    return count;
  }
  load_window(spec_.windows[window], bytes, trunk.front().input, trunk.front().shape);
  for (std::size_t l = 0; l < trunk.size(); ++l) {
    Layer& layer = trunk[l];
    const LayerShape& s = layer.shape;
    const auto size = padded_size(s);
    ConvPass pass;
    pass.input = layer.input.data();
    pass.in = size_of(s.in);
    pass.row = size[2] * pass.in;
    pass.slab = size[1] * pass.row;
    pass.weights = layer.weights.data();
    pass.biases = layer.biases.data();
    pass.out = size_of(s.out);
    for (std::size_t a = 0; a < 3; ++a) {
      pass.kernel[a] = size_of(s.kernel[a]);
      pass.stride[a] = size_of(s.stride[a]);
      pass.size[a] = size_of(s.out_size[a]);
    }
    std::array<std::size_t, 3> next = pass.size;
    std::size_t first = 0;
    pass.output = last_.data();
    if (l + 1 < trunk.size()) {
      const LayerShape& n = trunk[l + 1].shape;
      next = padded_size(n);
      first = (size_of(n.kernel[0] / 2) * next[1] + size_of(n.kernel[1] / 2)) * next[2] + size_of(n.kernel[2] / 2);
      pass.output = trunk[l + 1].input.data() + first * pass.out;
    }
    pass.out_row = next[2] * pass.out;
    pass.out_slab = next[1] * pass.out_row;
    convolve_relu(pass);
  }
  // The dense layers' weights are laid out for [channels, z, y, x].
  const LayerShape& s = trunk.back().shape;
  const std::size_t channels = size_of(s.out), cells = WindowInput{1, s.out_size}.values();
  for (std::size_t c = 0; c < channels; ++c) {
    for (std::size_t i = 0; i < cells; ++i) flat[c * cells + i] = last_[i * channels + c];
  }
  return channels * cells;
}

void Network::run_dense(std::span<float> outputs) {
  for (const Layer& layer : dense_) {
    const std::size_t out = size_of(layer.shape.out);
    multiply(flat_.data(), size_of(layer.shape.in), layer.weights.data(), layer.biases.data(), layer.biases.size(),
             hidden_.data());
    if (layer.shape.norm) normalise_layer(std::span(hidden_).first(out), layer.norm);
    for (std::size_t o = 0; o < out; ++o) flat_[o] = layer.shape.relu ? std::max(0.0F, hidden_[o]) : hidden_[o];
  }
  std::copy_n(flat_.begin(), outputs.size(), outputs.begin());
}

void Network::infer(std::span<const std::uint8_t> windows, std::span<const float> features, std::span<float> outputs) {
  if (windows.size() != spec_.window_values() || features.size() != size_of(spec_.features) ||
      outputs.size() != size_of(spec_.outputs)) {
    throw InputError("network: an input or output has another size than the network");
  }
  std::size_t flat = 0, byte = 0;
  for (std::size_t w = 0; w < spec_.windows.size(); ++w) {
    flat += run_trunk(w, windows.data() + byte, flat_.data() + flat);
    byte += spec_.windows[w].values();
  }
  std::ranges::copy(features, flat_.begin() + static_cast<std::ptrdiff_t>(flat));
  run_dense(outputs);
  finish(spec_.head, outputs);
}

void Network::infer_batch(std::size_t count, std::span<const std::uint8_t> windows, std::span<const float> features,
                          std::span<float> outputs) {
  const std::size_t w = spec_.window_values(), f = size_of(spec_.features), o = size_of(spec_.outputs);
  if (windows.size() != count * w || features.size() != count * f || outputs.size() != count * o) {
    throw InputError("network: an input or output has another size than the network");
  }
  for (std::size_t i = 0; i < count; ++i) {
    infer(windows.subspan(i * w, w), features.subspan(i * f, f), outputs.subspan(i * o, o));
  }
}

}  // namespace stairwell::nn
