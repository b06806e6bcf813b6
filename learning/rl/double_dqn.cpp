#include "learning/rl/double_dqn.hpp"

#include "core/errors.hpp"
#include "learning/nn/torch_network.hpp"

#include <algorithm>
#include <limits>

namespace stairwell::rl {

namespace {

DoubleDqnConfig checked(const DoubleDqnConfig& config) {
  if (const auto list = config.problems(); !list.empty()) throw InputError("Double DQN: " + list.front());
  return config;
}

torch::Device begin(const DoubleDqnConfig& config) {
  torch::set_num_threads(1);
  torch::manual_seed(config.seed);
  return nn::torch_device(config.device);
}

std::size_t best_of(std::span<const float> values) {
  return static_cast<std::size_t>(std::ranges::max_element(values) - values.begin());
}

}  // namespace

void ChoiceReplay::add(Choice choice) {
  if (choices_.size() < capacity_) {
    choices_.push_back(std::move(choice));
  } else {
    choices_[count_ % capacity_] = std::move(choice);
  }
  ++count_;
}

std::vector<const Choice*> ChoiceReplay::draw(std::size_t count, Rng& rng) const {
  std::vector<const Choice*> drawn(count);
  for (const Choice*& choice : drawn) {
    choice = &choices_[static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(choices_.size()) - 1))];
  }
  return drawn;
}

void ChoiceReplay::save(nn::ByteWriter& writer) const {
  writer.number(count_);
  writer.number<std::uint64_t>(choices_.size());
  for (const Choice& choice : choices_) {
    writer.list(std::span<const float>(choice.chosen));
    writer.number(choice.reward);
    writer.number(choice.discount);
    writer.list(std::span<const float>(choice.next_options));
  }
}

void ChoiceReplay::load(nn::ByteReader& reader) {
  count_ = reader.number<std::uint64_t>();
  const auto size = reader.number<std::uint64_t>();
  if (size > capacity_) throw InputError("replay of another size");
  choices_.resize(static_cast<std::size_t>(size));
  for (Choice& choice : choices_) {
    choice.chosen = reader.list<float>();
    choice.reward = reader.number<double>();
    choice.discount = reader.number<double>();
    choice.next_options = reader.list<float>();
  }
}

std::vector<std::string> DoubleDqnConfig::problems() const {
  std::vector<std::string> list = network.problems();
  if (!network.windows.empty() || network.outputs != 1 || network.head != nn::Head::kValues) {
    list.emplace_back("the network must take features and put out one value");
  }
  if (!(learning_rate > 0.0)) list.emplace_back("learning_rate must be above 0");
  if (!(smoothing > 0.0 && smoothing <= 1.0)) list.emplace_back("smoothing must be above 0, at most 1");
  if (!(max_gradient_norm > 0.0)) list.emplace_back("max_gradient_norm must be above 0");
  return list;
}

struct DoubleDqn::Impl {
  explicit Impl(const DoubleDqnConfig& given)
      : config(given),
        device(begin(config)),
        network(config.network, device),
        target(config.network, device),
        steps(network.tensors(), config.learning_rate, 0.0, config.max_gradient_norm) {
    target.follow(network, 1.0);
  }

  DoubleDqnConfig config;
  torch::Device device;
  nn::TorchNetwork network, target;
  nn::TorchOptimiser steps;

  std::size_t features() const { return static_cast<std::size_t>(config.network.features); }

  std::vector<float> values(const nn::TorchNetwork& judge, std::span<const float> options) const {
    if (options.empty()) return {};
    const torch::NoGradGuard no_gradients;
    return nn::torch_values(judge.raw({}, nn::torch_rows(options, options.size() / features(), device)));
  }

  std::vector<float> targets(const std::vector<const Choice*>& batch) const {
    std::vector<float> options;
    for (const Choice* choice : batch) {
      options.insert(options.end(), choice->next_options.begin(), choice->next_options.end());
    }
    const std::vector<float> mine = values(network, options), theirs = values(target, options);
    std::vector<float> wanted;
    std::size_t at = 0;
    for (const Choice* choice : batch) {
      double value = choice->reward;
      const std::size_t count = choice->next_options.size() / features();
      if (count > 0) {
        value += choice->discount * static_cast<double>(theirs[at + best_of(std::span(mine).subspan(at, count))]);
      }
      wanted.push_back(static_cast<float>(value));
      at += count;
    }
    return wanted;
  }
};

DoubleDqn::DoubleDqn(const DoubleDqnConfig& config) : impl_(std::make_unique<Impl>(checked(config))) {}
DoubleDqn::~DoubleDqn() = default;
DoubleDqn::DoubleDqn(DoubleDqn&&) noexcept = default;
DoubleDqn& DoubleDqn::operator=(DoubleDqn&&) noexcept = default;

std::vector<float> DoubleDqn::values(std::span<const float> options) const {
  return impl_->values(impl_->network, options);
}

std::size_t DoubleDqn::choose(std::span<const float> options, double epsilon, Rng& rng) const {
  if (rng.uniform() < epsilon) {
    const auto count = static_cast<int>(options.size() / impl_->features());
    return static_cast<std::size_t>(rng.uniform_int(0, count - 1));
  }
  return best_of(values(options));
}

double DoubleDqn::learn(const std::vector<const Choice*>& batch) {
  std::vector<float> chosen;
  for (const Choice* choice : batch) chosen.insert(chosen.end(), choice->chosen.begin(), choice->chosen.end());
  const std::vector<float> wanted = impl_->targets(batch);
  const torch::Tensor rows = nn::torch_rows(std::span<const float>(chosen), batch.size(), impl_->device);
  const torch::Tensor targets = nn::torch_rows(std::span<const float>(wanted), batch.size(), impl_->device);
  const torch::Tensor loss = torch::smooth_l1_loss(impl_->network.raw({}, rows), targets);
  impl_->steps.step(loss);
  impl_->target.follow(impl_->network, impl_->config.smoothing);
  return loss.item<double>();
}

std::vector<float> DoubleDqn::parameters() const { return impl_->network.parameters(); }

void DoubleDqn::save(nn::ByteWriter& writer) const {
  writer.list(std::span<const float>(impl_->network.parameters()));
  writer.list(std::span<const float>(impl_->target.parameters()));
  writer.text(impl_->steps.state());
}

void DoubleDqn::load(nn::ByteReader& reader) {
  impl_->network.set_parameters(reader.list<float>());
  impl_->target.set_parameters(reader.list<float>());
  impl_->steps.set_state(reader.text(), impl_->device);
}

}  // namespace stairwell::rl
