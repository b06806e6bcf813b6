/// Inference without a vendor's library.
#pragma once

#include "learning/nn/network_spec.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace stairwell::nn {

/// A network with its weights, ready to be asked. One thread at a time (working memory is its own); copy it for more.
/// Asking allocates nothing. Bitwise repeatable, also between processors with and without AVX2: sums are taken in one
/// order and multiplications are not fused.
class Network {
 public:
  /// @throws InputError for an unusable spec, another number of parameters, or parameters that are not finite.
  Network(const NetworkSpec& spec, std::span<const float> parameters);

  const NetworkSpec& spec() const { return spec_; }

  /// @param windows  the windows' bytes one after the other, each [channels, z, y, x]
  /// @param outputs  of kUnitVector normalised (0 stays 0), of kAngles within [-1, 1]
  /// @throws InputError for spans of other lengths
  void infer(std::span<const std::uint8_t> windows, std::span<const float> features, std::span<float> outputs);

  /// `count` inputs, each laid out as for infer(), one after the other.
  void infer_batch(std::size_t count, std::span<const std::uint8_t> windows, std::span<const float> features,
                   std::span<float> outputs);

 private:
  struct Layer {
    LayerShape shape;
    std::vector<float> weights;  ///< [z, y, x, in, out], outputs filled up with zeros to whole lanes
    std::vector<float> biases;   ///< likewise
    std::vector<float> norm;     ///< scales, then shifts
    std::vector<float> input;    ///< convolutions: [z, y, x, channels] with a border of zeros
  };
  void load_window(const WindowInput& window, const std::uint8_t* bytes, std::vector<float>& padded,
                   const LayerShape& shape) const;
  std::size_t run_trunk(std::size_t window, const std::uint8_t* bytes, float* flat);
  void run_dense(std::span<float> outputs);

  NetworkSpec spec_;
  std::vector<std::vector<Layer>> trunks_;
  std::vector<Layer> dense_;
  std::vector<float> last_;           ///< what a trunk puts out, [z, y, x, channels]
  std::vector<float> flat_, hidden_;  ///< between dense layers
};

}  // namespace stairwell::nn
