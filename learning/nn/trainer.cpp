#include "learning/nn/trainer.hpp"

#include "core/errors.hpp"

#include <torch/torch.h>

#include <cmath>
#include <sstream>

namespace stairwell::nn {

namespace {

/// The parameters of one layer.
struct LayerTensors {
  LayerShape shape;
  torch::Tensor weights, biases, scales, shifts;
};

std::vector<std::int64_t> weight_sizes(const LayerShape& s) {
  if (!s.conv) return {s.out, s.in};
  if (s.in_size[0] == 1 && s.kernel[0] == 1) return {s.out, s.in, s.kernel[1], s.kernel[2]};
  return {s.out, s.in, s.kernel[0], s.kernel[1], s.kernel[2]};
}

torch::Tensor convolve(const LayerTensors& layer, const torch::Tensor& x) {
  const LayerShape& s = layer.shape;
  const auto pad = [&](std::size_t a) { return static_cast<std::int64_t>(s.kernel[a] / 2); };
  if (layer.weights.dim() == 4) {
    return torch::relu(torch::conv2d(x, layer.weights, layer.biases, {s.stride[1], s.stride[2]}, {pad(1), pad(2)}));
  }
  return torch::relu(
      torch::conv3d(x, layer.weights, layer.biases, {s.stride[0], s.stride[1], s.stride[2]}, {pad(0), pad(1), pad(2)}));
}

torch::Device device_of(const std::string& name) {
  if (name == "cpu") return torch::kCPU;
  if (name != "cuda") throw InputError("device '" + name + "': choose cpu or cuda");
  if (!torch::cuda::is_available()) throw InputError("device 'cuda': this LibTorch or computer has none; use cpu");
  return torch::kCUDA;
}

}  // namespace

struct Trainer::Impl {
  NetworkSpec spec;
  TrainerConfig config;
  torch::Device device = torch::kCPU;
  std::vector<LayerTensors> layers;
  std::unique_ptr<torch::optim::AdamW> optimiser;

  std::vector<torch::Tensor> tensors() const {
    std::vector<torch::Tensor> all;
    for (const LayerTensors& layer : layers) {
      all.push_back(layer.weights);
      all.push_back(layer.biases);
      if (!layer.shape.norm) continue;
      all.push_back(layer.scales);
      all.push_back(layer.shifts);
    }
    return all;
  }

  torch::Tensor window(const Batch& batch, std::size_t index) const {
    std::int64_t before = 0;
    for (std::size_t w = 0; w < index; ++w) before += static_cast<std::int64_t>(spec.windows[w].values());
    const WindowInput& shape = spec.windows[index];
    const auto count = static_cast<std::int64_t>(batch.count);
    const auto all = torch::from_blob(const_cast<std::uint8_t*>(batch.windows.data()),
                                      {count, static_cast<std::int64_t>(spec.window_values())}, torch::kUInt8);
    const auto mine = all.slice(1, before, before + static_cast<std::int64_t>(shape.values())).to(device);
    const auto values = (mine.to(torch::kFloat32) - 128.0) / 127.0;
    if (shape.size[0] == 1) return values.reshape({count, shape.channels, shape.size[1], shape.size[2]});
    return values.reshape({count, shape.channels, shape.size[0], shape.size[1], shape.size[2]});
  }

  torch::Tensor floats(std::span<const float> values, std::size_t count) const {
    return torch::from_blob(const_cast<float*>(values.data()),
                            {static_cast<std::int64_t>(count), static_cast<std::int64_t>(values.size() / count)},
                            torch::kFloat32)
        .to(device);
  }

  /// Before the head.
  torch::Tensor raw(const Batch& batch) const {
    std::vector<torch::Tensor> flat;
    std::size_t l = 0;
    for (std::size_t w = 0; w < spec.windows.size(); ++w) {
      torch::Tensor x = window(batch, w);
      for (std::size_t i = 0; i < spec.trunk.size(); ++i) x = convolve(layers[l++], x);
      flat.push_back(x.flatten(1));
    }
    if (spec.features > 0) flat.push_back(floats(batch.features, batch.count));
    torch::Tensor x = torch::cat(flat, 1);
    for (; l < layers.size(); ++l) {
      const LayerTensors& layer = layers[l];
      x = torch::linear(x, layer.weights, layer.biases);
      if (layer.shape.norm) x = torch::layer_norm(x, {layer.shape.out}, layer.scales, layer.shifts, kNormEpsilon);
      if (layer.shape.relu) x = torch::relu(x);
    }
    return x;
  }

  torch::Tensor outputs(const Batch& batch) const {
    torch::Tensor x = raw(batch);
    if (spec.head == Head::kUnitVector) return x / x.norm(2, {1}, true).clamp_min(1e-12);
    return spec.head == Head::kAngles ? torch::tanh(x) : x;
  }
};

Trainer::Trainer(const NetworkSpec& spec, std::uint64_t seed, const TrainerConfig& config)
    : impl_(std::make_unique<Impl>()) {
  if (const auto list = spec.problems(); !list.empty()) throw InputError("network: " + list.front());
  torch::set_num_threads(1);
  torch::manual_seed(seed);
  impl_->spec = spec;
  impl_->config = config;
  impl_->device = device_of(config.device);
  for (const LayerShape& shape : layers_of(spec)) {
    LayerTensors layer{shape, {}, {}, {}, {}};
    const double fan_in = static_cast<double>(shape.weights) / shape.out;
    const double bound = std::sqrt((shape.relu ? 6.0 : 1.0) / fan_in);  // He et al. 2015, uniform
    layer.weights = torch::empty(weight_sizes(shape)).uniform_(-bound, bound).to(impl_->device).requires_grad_(true);
    layer.biases = torch::zeros({shape.out}).to(impl_->device).requires_grad_(true);
    if (shape.norm) {
      layer.scales = torch::ones({shape.out}).to(impl_->device).requires_grad_(true);
      layer.shifts = torch::zeros({shape.out}).to(impl_->device).requires_grad_(true);
    }
    impl_->layers.push_back(layer);
  }
  impl_->optimiser = std::make_unique<torch::optim::AdamW>(
      impl_->tensors(), torch::optim::AdamWOptions(config.learning_rate).weight_decay(config.weight_decay));
}

Trainer::~Trainer() = default;
Trainer::Trainer(Trainer&&) noexcept = default;
Trainer& Trainer::operator=(Trainer&&) noexcept = default;

double Trainer::step(const Batch& batch) {
  impl_->optimiser->zero_grad();
  const torch::Tensor targets = impl_->floats(batch.targets, batch.count);
  const torch::Tensor outputs = impl_->outputs(batch);
  const torch::Tensor loss = impl_->spec.head == Head::kUnitVector ? 1.0 - (outputs * targets).sum(1).mean()
                                                                   : (outputs - targets).square().sum(1).mean();
  loss.backward();
  torch::nn::utils::clip_grad_norm_(impl_->tensors(), impl_->config.max_gradient_norm);
  impl_->optimiser->step();
  return loss.item<double>();
}

void Trainer::set_learning_rate(double learning_rate) {
  for (auto& group : impl_->optimiser->param_groups()) {
    static_cast<torch::optim::AdamWOptions&>(group.options()).lr(learning_rate);
  }
}

std::vector<float> Trainer::forward(const Batch& batch) const {
  const torch::NoGradGuard no_gradients;
  const torch::Tensor outputs = impl_->outputs(batch).to(torch::kCPU).contiguous();
  return {outputs.data_ptr<float>(), outputs.data_ptr<float>() + outputs.numel()};
}

std::vector<float> Trainer::parameters() const {
  std::vector<float> all;
  for (const torch::Tensor& tensor : impl_->tensors()) {
    const torch::Tensor flat = tensor.detach().to(torch::kCPU).contiguous();
    all.insert(all.end(), flat.data_ptr<float>(), flat.data_ptr<float>() + flat.numel());
  }
  return all;
}

void Trainer::set_parameters(std::span<const float> parameters) {
  if (parameters.size() != impl_->spec.parameter_count()) throw InputError("network: another number of parameters");
  const torch::NoGradGuard no_gradients;
  const float* from = parameters.data();
  for (torch::Tensor& tensor : impl_->tensors()) {
    tensor.copy_(torch::from_blob(const_cast<float*>(from), tensor.sizes(), torch::kFloat32));
    from += tensor.numel();
  }
}

std::string Trainer::optimiser_state() const {
  std::ostringstream out;
  torch::serialize::OutputArchive archive;
  impl_->optimiser->save(archive);
  archive.save_to(out);
  return out.str();
}

void Trainer::set_optimiser_state(const std::string& state) {
  try {
    std::istringstream in(state);
    torch::serialize::InputArchive archive;
    archive.load_from(in, impl_->device);
    impl_->optimiser->load(archive);
  } catch (const c10::Error& error) {
    throw InputError(std::string("optimiser state: ") + error.what_without_backtrace());
  }
}

}  // namespace stairwell::nn
