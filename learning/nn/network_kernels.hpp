/// The sums of a network's layers. Vectors run over output channels, so that every sum has one order on every
/// processor.
#pragma once

#include <array>
#include <cstddef>

namespace stairwell::nn {

inline constexpr std::size_t kLanes = 8;  ///< outputs are stored in whole multiples of this

/// Number of floats that hold `count` outputs.
constexpr std::size_t padded_outputs(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

/// A convolution over an input with a border already around it.
struct ConvPass {
  const float* input = nullptr;    ///< [z, y, x, in]
  std::size_t in = 0;              ///< channels
  std::size_t row = 0, slab = 0;   ///< floats from one y, one z to the next
  const float* weights = nullptr;  ///< [z, y, x, in, out]
  const float* biases = nullptr;
  std::size_t out = 0;  ///< a multiple of kLanes
  std::array<std::size_t, 3> kernel{}, stride{}, size{};
  float* output = nullptr;                ///< [z, y, x, out]
  std::size_t out_row = 0, out_slab = 0;  ///< floats
};
void convolve_relu(const ConvPass& pass);

/// outputs[o] = biases[o] + sum over i of inputs[i] * weights[i, o]. @param out a multiple of kLanes
void multiply(const float* inputs, std::size_t in, const float* weights, const float* biases, std::size_t out,
              float* outputs);

}  // namespace stairwell::nn
