#include "learning/nn/trainer.hpp"

#include "core/errors.hpp"
#include "learning/nn/torch_network.hpp"

namespace stairwell::nn {

namespace {

/// Before the first random weight is drawn.
torch::Device begin_training(std::uint64_t seed, const std::string& device) {
  torch::set_num_threads(1);
  torch::manual_seed(seed);
  return torch_device(device);
}

}  // namespace

struct Trainer::Impl {
  Impl(const NetworkSpec& spec, std::uint64_t seed, const TrainerConfig& config)
      : device(begin_training(seed, config.device)),
        network(spec, device),
        optimiser(network.tensors(), config.learning_rate, config.weight_decay, config.max_gradient_norm) {}

  torch::Device device;
  TorchNetwork network;
  TorchOptimiser optimiser;

  torch::Tensor outputs(const Batch& batch) const {
    torch::Tensor windows, features;
    if (!network.spec().windows.empty()) windows = torch_rows(batch.windows, batch.count, device);
    if (network.spec().features > 0) features = torch_rows(batch.features, batch.count, device);
    return network.outputs(windows, features);
  }
};

Trainer::Trainer(const NetworkSpec& spec, std::uint64_t seed, const TrainerConfig& config)
    : impl_(std::make_unique<Impl>(spec, seed, config)) {}

Trainer::~Trainer() = default;
Trainer::Trainer(Trainer&&) noexcept = default;
Trainer& Trainer::operator=(Trainer&&) noexcept = default;

double Trainer::step(const Batch& batch) {
  const torch::Tensor targets = torch_rows(batch.targets, batch.count, impl_->device);
  const torch::Tensor outputs = impl_->outputs(batch);
  const torch::Tensor loss = impl_->network.spec().head == Head::kUnitVector
                                 ? 1.0 - (outputs * targets).sum(1).mean()
                                 : (outputs - targets).square().sum(1).mean();
  impl_->optimiser.step(loss);
  return loss.item<double>();
}

void Trainer::set_learning_rate(double learning_rate) { impl_->optimiser.set_learning_rate(learning_rate); }

std::vector<float> Trainer::forward(const Batch& batch) const {
  const torch::NoGradGuard no_gradients;
  return torch_values(impl_->outputs(batch));
}

std::vector<float> Trainer::parameters() const { return impl_->network.parameters(); }

void Trainer::set_parameters(std::span<const float> parameters) { impl_->network.set_parameters(parameters); }

std::string Trainer::optimiser_state() const { return impl_->optimiser.state(); }

void Trainer::set_optimiser_state(const std::string& state) { impl_->optimiser.set_state(state, impl_->device); }

}  // namespace stairwell::nn
