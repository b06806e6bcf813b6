/// Networks of this project as LibTorch sees them: with gradients. For what trains; flying does without.
#pragma once

#include "learning/nn/network_spec.hpp"

#include <torch/torch.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stairwell::nn {

/// `cpu` or `cuda`. @throws InputError for others, or where there is none
torch::Device torch_device(const std::string& name);

/// Bytes as rows on a device, [count, values / count]. `values` must last until the result is used on the CPU.
torch::Tensor torch_rows(std::span<const float> values, std::size_t count, torch::Device device);
torch::Tensor torch_rows(std::span<const std::uint8_t> values, std::size_t count, torch::Device device);

/// On the CPU, row by row.
std::vector<float> torch_values(const torch::Tensor& tensor);

/// The network as LibTorch trains it.
class TorchNetwork {
 public:
  /// Weights from LibTorch's generator as it stands (He et al. 2015, uniform), the last layer's without the factor 2.
  /// @throws InputError for an unusable spec
  TorchNetwork(const NetworkSpec& spec, torch::Device device);

  const NetworkSpec& spec() const { return spec_; }
  /// Before the head. @param windows  [count, window_values] uint8; @param features  [count, features]
  torch::Tensor raw(const torch::Tensor& windows, const torch::Tensor& features) const;
  /// Behind the head, as Network::infer_batch.
  torch::Tensor outputs(const torch::Tensor& windows, const torch::Tensor& features) const;

  /// In the order of layers_of().
  std::vector<torch::Tensor> tensors() const;
  std::vector<float> parameters() const;
  /// @throws InputError for another number of them
  void set_parameters(std::span<const float> parameters);
  /// Moves every parameter so far (0 to 1) towards another network's of the same spec.
  void follow(const TorchNetwork& other, double part);

 private:
  struct LayerTensors {
    LayerShape shape;
    torch::Tensor weights, biases, scales, shifts;
  };
  static torch::Tensor convolve(const LayerTensors& layer, const torch::Tensor& x);
  torch::Tensor window(const torch::Tensor& windows, std::size_t index) const;

  NetworkSpec spec_;
  std::vector<LayerTensors> layers_;
};

/// AdamW over some networks' parameters.
class TorchOptimiser {
 public:
  TorchOptimiser(std::vector<torch::Tensor> tensors, double learning_rate, double weight_decay,
                 double max_gradient_norm);
  /// One step down `loss`, with the gradient's norm limited.
  void step(const torch::Tensor& loss);
  void set_learning_rate(double learning_rate);
  std::string state() const;
  /// @throws InputError for a foreign one
  void set_state(const std::string& state, torch::Device device);

 private:
  std::vector<torch::Tensor> tensors_;
  double max_gradient_norm_;
  std::unique_ptr<torch::optim::AdamW> adam_;
};

}  // namespace stairwell::nn
