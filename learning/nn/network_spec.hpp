/// What a network of this project is made of: windows through strided convolutions, features beside them, dense layers.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::nn {

/// A window of cells, as a tensor [channels, z, y, x] of bytes: byte b is the value (b - 128) / 127.
struct WindowInput {
  int channels = 1;
  std::array<int, 3> size{1, 1, 1};  ///< z, y, x; z = 1: a window of a plane, with convolutions in the plane
  std::size_t values() const;
  friend bool operator==(const WindowInput&, const WindowInput&) = default;
};

/// Followed by ReLU; zeros beyond the border.
struct ConvLayer {
  int channels = 16;  ///< a multiple of 8
  int kernel = 3;     ///< odd; along z it is 1 where a window is a plane
  int stride = 2;
  friend bool operator==(const ConvLayer&, const ConvLayer&) = default;
};

/// What the outputs mean.
enum class Head {
  kValues,      ///< numbers
  kUnitVector,  ///< a direction as a vector that is normalised: 3 outputs, or 2 in the plane
  kAngles       ///< azimuth / pi and elevation / (pi / 2), each bounded by tanh: 2 outputs, or 1 in the plane
};

/// Every window has a trunk of its own of the same layers; what comes out of the trunks and the features go through
/// the hidden layers (ReLU after each) into the outputs.
struct NetworkSpec {
  std::vector<WindowInput> windows;
  std::vector<ConvLayer> trunk;
  int features = 0;
  std::vector<int> hidden;
  bool layer_norm = false;  ///< before the ReLU of every hidden layer
  int outputs = 1;
  Head head = Head::kValues;

  std::vector<std::string> problems() const;  ///< empty: usable
  std::size_t window_values() const;          ///< bytes of all windows, one after the other
  std::size_t parameter_count() const;

  /// One line, as `windows 3x8x16x16,3x8x16x16 conv 8k3s2,16k3s2 features 21 hidden 128,64 norm 0 outputs 3 head
  /// unit_vector`; parse() reads it again. @throws InputError saying what is wrong.
  std::string text() const;
  static NetworkSpec parse(std::string_view text);

  friend bool operator==(const NetworkSpec&, const NetworkSpec&) = default;
};

/// One layer's place among the parameters, which are stored in this order: of each window its convolutions, then the
/// dense layers; of each layer the weights [out, in, z, y, x] or [out, in], then the biases [out], then with layer
/// norm the scales and shifts [out].
struct LayerShape {
  bool conv = false;
  int window = -1;  ///< of a convolution
  int in = 0, out = 0;
  std::array<int, 3> kernel{1, 1, 1}, stride{1, 1, 1}, in_size{1, 1, 1}, out_size{1, 1, 1};
  bool relu = true;
  bool norm = false;
  std::size_t weights_at = 0, weights = 0, biases_at = 0, norm_at = 0;
};

/// @pre spec.problems().empty()
std::vector<LayerShape> layers_of(const NetworkSpec& spec);

/// Layer norm adds this to the variance.
inline constexpr float kNormEpsilon = 1e-5F;

}  // namespace stairwell::nn
