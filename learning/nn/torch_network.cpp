#include "learning/nn/torch_network.hpp"

#include "core/errors.hpp"

#include <cmath>
#include <sstream>

namespace stairwell::nn {

namespace {

std::vector<std::int64_t> weight_sizes(const LayerShape& s) {
  if (!s.conv) return {s.out, s.in};
  if (s.in_size[0] == 1 && s.kernel[0] == 1) return {s.out, s.in, s.kernel[1], s.kernel[2]};
  return {s.out, s.in, s.kernel[0], s.kernel[1], s.kernel[2]};
}

template <typename T>
torch::Tensor rows(std::span<const T> values, std::size_t count, torch::Dtype type, torch::Device device) {
  return torch::from_blob(const_cast<T*>(values.data()),
                          {static_cast<std::int64_t>(count), static_cast<std::int64_t>(values.size() / count)}, type)
      .to(device);
}

}  // namespace

torch::Device torch_device(const std::string& name) {
  if (name == "cpu") return torch::kCPU;
  if (name != "cuda") throw InputError("device '" + name + "': choose cpu or cuda");
  if (!torch::cuda::is_available()) throw InputError("device 'cuda': this LibTorch or computer has none; use cpu");
  return torch::kCUDA;
}

torch::Tensor torch_rows(std::span<const float> values, std::size_t count, torch::Device device) {
  return rows(values, count, torch::kFloat32, device);
}

torch::Tensor torch_rows(std::span<const std::uint8_t> values, std::size_t count, torch::Device device) {
  return rows(values, count, torch::kUInt8, device);
}

std::vector<float> torch_values(const torch::Tensor& tensor) {
  const torch::Tensor flat = tensor.detach().to(torch::kCPU).contiguous();
  return {flat.data_ptr<float>(), flat.data_ptr<float>() + flat.numel()};
}

TorchNetwork::TorchNetwork(const NetworkSpec& spec, torch::Device device) : spec_(spec) {
  if (const auto list = spec.problems(); !list.empty()) throw InputError("network: " + list.front());
  for (const LayerShape& shape : layers_of(spec)) {
    LayerTensors layer{shape, {}, {}, {}, {}};
    const double fan_in = static_cast<double>(shape.weights) / shape.out;
    const double bound = std::sqrt((shape.relu ? 6.0 : 1.0) / fan_in);  // He et al. 2015, uniform
    layer.weights = torch::empty(weight_sizes(shape)).uniform_(-bound, bound).to(device).requires_grad_(true);
    layer.biases = torch::zeros({shape.out}).to(device).requires_grad_(true);
    if (shape.norm) {
      layer.scales = torch::ones({shape.out}).to(device).requires_grad_(true);
      layer.shifts = torch::zeros({shape.out}).to(device).requires_grad_(true);
    }
    layers_.push_back(layer);
  }
}

torch::Tensor TorchNetwork::convolve(const LayerTensors& layer, const torch::Tensor& x) {
  const LayerShape& s = layer.shape;
  const auto pad = [&](std::size_t a) { return static_cast<std::int64_t>(s.kernel[a] / 2); };
  if (layer.weights.dim() == 4) {
    return torch::relu(torch::conv2d(x, layer.weights, layer.biases, {s.stride[1], s.stride[2]}, {pad(1), pad(2)}));
  }
  return torch::relu(
      torch::conv3d(x, layer.weights, layer.biases, {s.stride[0], s.stride[1], s.stride[2]}, {pad(0), pad(1), pad(2)}));
}

torch::Tensor TorchNetwork::window(const torch::Tensor& windows, std::size_t index) const {
  std::int64_t before = 0;
  for (std::size_t w = 0; w < index; ++w) before += static_cast<std::int64_t>(spec_.windows[w].values());
  const WindowInput& shape = spec_.windows[index];
  const std::int64_t count = windows.size(0);
  const auto mine = windows.slice(1, before, before + static_cast<std::int64_t>(shape.values()));
  const auto values = (mine.to(torch::kFloat32) - 128.0) / 127.0;
  if (shape.size[0] == 1) return values.reshape({count, shape.channels, shape.size[1], shape.size[2]});
  return values.reshape({count, shape.channels, shape.size[0], shape.size[1], shape.size[2]});
}

torch::Tensor TorchNetwork::raw(const torch::Tensor& windows, const torch::Tensor& features) const {
  std::vector<torch::Tensor> flat;
  std::size_t l = 0;
  for (std::size_t w = 0; w < spec_.windows.size(); ++w) {
    torch::Tensor x = window(windows, w);
    for (std::size_t i = 0; i < spec_.trunk.size(); ++i) x = convolve(layers_[l++], x);
    flat.push_back(x.flatten(1));
  }
  if (spec_.features > 0) flat.push_back(features);
  torch::Tensor x = torch::cat(flat, 1);
  for (; l < layers_.size(); ++l) {
    const LayerTensors& layer = layers_[l];
    x = torch::linear(x, layer.weights, layer.biases);
    if (layer.shape.norm) x = torch::layer_norm(x, {layer.shape.out}, layer.scales, layer.shifts, kNormEpsilon);
    if (layer.shape.relu) x = torch::relu(x);
  }
  return x;
}

torch::Tensor TorchNetwork::outputs(const torch::Tensor& windows, const torch::Tensor& features) const {
  const torch::Tensor x = raw(windows, features);
  if (spec_.head == Head::kUnitVector) return x / x.norm(2, {1}, true).clamp_min(1e-12);
  return spec_.head == Head::kAngles ? torch::tanh(x) : x;
}

std::vector<torch::Tensor> TorchNetwork::tensors() const {
  std::vector<torch::Tensor> all;
  for (const LayerTensors& layer : layers_) {
    all.push_back(layer.weights);
    all.push_back(layer.biases);
    if (!layer.shape.norm) continue;
    all.push_back(layer.scales);
    all.push_back(layer.shifts);
  }
  return all;
}

std::vector<float> TorchNetwork::parameters() const {
  std::vector<float> all;
  for (const torch::Tensor& tensor : tensors()) {
    const std::vector<float> values = torch_values(tensor);
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

void TorchNetwork::set_parameters(std::span<const float> parameters) {
  if (parameters.size() != spec_.parameter_count()) throw InputError("network: another number of parameters");
  const torch::NoGradGuard no_gradients;
  const float* from = parameters.data();
  for (torch::Tensor& tensor : tensors()) {
    tensor.copy_(torch::from_blob(const_cast<float*>(from), tensor.sizes(), torch::kFloat32));
    from += tensor.numel();
  }
}

void TorchNetwork::follow(const TorchNetwork& other, double part) {
  const torch::NoGradGuard no_gradients;
  const std::vector<torch::Tensor> theirs = other.tensors();
  std::vector<torch::Tensor> mine = tensors();
  for (std::size_t i = 0; i < mine.size(); ++i) mine[i].lerp_(theirs[i], part);
}

TorchOptimiser::TorchOptimiser(std::vector<torch::Tensor> tensors, double learning_rate, double weight_decay,
                               double max_gradient_norm)
    : tensors_(std::move(tensors)),
      max_gradient_norm_(max_gradient_norm),
      adam_(std::make_unique<torch::optim::AdamW>(
          tensors_, torch::optim::AdamWOptions(learning_rate).weight_decay(weight_decay))) {}

void TorchOptimiser::step(const torch::Tensor& loss) {
  adam_->zero_grad();
  loss.backward();
  torch::nn::utils::clip_grad_norm_(tensors_, max_gradient_norm_);
  adam_->step();
}

void TorchOptimiser::set_learning_rate(double learning_rate) {
  for (auto& group : adam_->param_groups()) {
    static_cast<torch::optim::AdamWOptions&>(group.options()).lr(learning_rate);
  }
}

std::string TorchOptimiser::state() const {
  std::ostringstream out;
  torch::serialize::OutputArchive archive;
  adam_->save(archive);
  archive.save_to(out);
  return out.str();
}

void TorchOptimiser::set_state(const std::string& state, torch::Device device) {
  try {
    std::istringstream in(state);
    torch::serialize::InputArchive archive;
    archive.load_from(in, device);
    adam_->load(archive);
  } catch (const c10::Error& error) {
    throw InputError(std::string("optimiser state: ") + error.what_without_backtrace());
  }
}

}  // namespace stairwell::nn
