#include "learning/rl/actor_critic.hpp"

#include "core/errors.hpp"
#include "learning/nn/torch_network.hpp"
#include "learning/rl/torch_policy.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::rl {

using Algorithm = ActorCriticConfig::Algorithm;

namespace {

ActorCriticConfig checked(const ActorCriticConfig& config) {
  if (const auto list = config.problems(); !list.empty()) throw InputError("actor and critic: " + list.front());
  return config;
}

/// SAC's actor also says how sure it is; its mean is what is deployed.
nn::NetworkSpec trained_actor(const ActorCriticConfig& config) {
  nn::NetworkSpec spec = config.actor;
  if (config.algorithm != Algorithm::kSac) return spec;
  spec.head = nn::Head::kValues;
  spec.outputs += spread_outputs(config.actor.head, config.actor.outputs);
  return spec;
}

int critic_count(const ActorCriticConfig& config) { return config.algorithm == Algorithm::kDdpg ? 1 : 2; }

bool td3(const ActorCriticConfig& config) {
  return config.algorithm == Algorithm::kTd3 || config.algorithm == Algorithm::kTd3Bc;
}

/// The last layer's place in the parameters: its weights and biases end them.
const nn::LayerShape last_layer(const nn::NetworkSpec& spec) { return nn::layers_of(spec).back(); }

torch::Device begin(const ActorCriticConfig& config) {
  torch::set_num_threads(1);
  torch::manual_seed(config.seed);
  return nn::torch_device(config.device);
}

std::vector<nn::TorchNetwork> make_critics(const ActorCriticConfig& config, torch::Device device) {
  std::vector<nn::TorchNetwork> critics;
  for (int i = 0; i < critic_count(config); ++i) critics.emplace_back(config.critic(), device);
  return critics;
}

std::vector<torch::Tensor> tensors_of(const std::vector<nn::TorchNetwork>& networks) {
  std::vector<torch::Tensor> all;
  for (const nn::TorchNetwork& network : networks) {
    const auto mine = network.tensors();
    all.insert(all.end(), mine.begin(), mine.end());
  }
  return all;
}

void save_network(nn::ByteWriter& writer, const nn::TorchNetwork& network) {
  writer.list(std::span<const float>(network.parameters()));
}

void load_network(nn::ByteReader& reader, nn::TorchNetwork& network) { network.set_parameters(reader.list<float>()); }

}  // namespace

double ActorCriticConfig::target_entropy_of(const nn::NetworkSpec& actor) {
  return actor.head == nn::Head::kUnitVector ? -0.5 * (actor.outputs - 1) : -1.0 * actor.outputs;
}

ActorCriticConfig ActorCriticConfig::ddpg(const nn::NetworkSpec& actor) {
  ActorCriticConfig config;
  config.algorithm = Algorithm::kDdpg;
  config.actor = actor;
  config.critic_layer_norm = false;
  config.actor_learning_rate = 2e-4;
  config.critic_learning_rate = 1e-3;
  config.smoothing = 0.1;
  return config;
}

nn::NetworkSpec ActorCriticConfig::critic() const {
  nn::NetworkSpec spec = actor;
  spec.features += actor.outputs;
  spec.hidden = critic_hidden;
  spec.layer_norm = critic_layer_norm;
  spec.outputs = 1;
  spec.head = nn::Head::kValues;
  return spec;
}

std::vector<std::string> ActorCriticConfig::problems() const {
  std::vector<std::string> list = actor.problems();
  const auto require = [&](bool usable, const char* what) {
    if (!usable) list.emplace_back(what);
  };
  require(actor_learning_rate > 0.0 && critic_learning_rate > 0.0, "learning rates must be above 0");
  require(smoothing > 0.0 && smoothing <= 1.0, "smoothing must be above 0, at most 1");
  require(target_noise >= 0.0 && target_noise_clip >= 0.0, "noise must not be negative");
  require(policy_delay >= 1, "policy_delay must be 1 or more");
  require(cloning > 0.0, "cloning must be above 0");
  require(temperature > 0.0, "temperature must be above 0");
  require(max_gradient_norm > 0.0, "max_gradient_norm must be above 0");
  if (list.empty()) {
    const auto more = critic().problems();
    list.insert(list.end(), more.begin(), more.end());
  }
  return list;
}

struct ActorCritic::Impl {
  explicit Impl(const ActorCriticConfig& given)
      : config(given),
        device(begin(config)),
        head(config.actor.head),
        actor(trained_actor(config), device),
        critics(make_critics(config, device)),
        target_actor(trained_actor(config), device),
        target_critics(make_critics(config, device)),
        log_temperature(
            torch::full({1}, std::log(config.temperature), torch::kFloat32).to(device).requires_grad_(true)),
        actor_steps(actor.tensors(), config.actor_learning_rate, 0.0, config.max_gradient_norm),
        critic_steps(tensors_of(critics), config.critic_learning_rate, 0.0, config.max_gradient_norm),
        temperature_steps({log_temperature}, config.actor_learning_rate, 0.0, config.max_gradient_norm) {
    if (config.algorithm == Algorithm::kSac) start_spread();
    follow(1.0);
  }

  ActorCriticConfig config;
  torch::Device device;
  nn::Head head;
  nn::TorchNetwork actor;
  std::vector<nn::TorchNetwork> critics;
  nn::TorchNetwork target_actor;
  std::vector<nn::TorchNetwork> target_critics;
  torch::Tensor log_temperature;
  nn::TorchOptimiser actor_steps, critic_steps, temperature_steps;
  std::uint64_t steps = 0;

  struct Rows {
    torch::Tensor windows, features;
  };

  Rows rows(std::span<const std::uint8_t> windows, std::span<const float> features, std::size_t count) const {
    Rows made;
    if (!config.actor.windows.empty()) made.windows = nn::torch_rows(windows, count, device);
    made.features = config.actor.features > 0
                        ? nn::torch_rows(features, count, device)
                        : torch::zeros({static_cast<std::int64_t>(count), 0}, torch::kFloat32).to(device);
    return made;
  }

  torch::Tensor q(const nn::TorchNetwork& critic, const Rows& seen, const torch::Tensor& actions) const {
    return critic.raw(seen.windows, torch::cat({seen.features, actions}, 1));
  }

  torch::Tensor least_q(const std::vector<nn::TorchNetwork>& networks, const Rows& seen,
                        const torch::Tensor& actions) const {
    torch::Tensor least = q(networks.front(), seen, actions);
    for (std::size_t i = 1; i < networks.size(); ++i) least = torch::min(least, q(networks[i], seen, actions));
    return least;
  }

  /// [count, actions], from the caller's generator.
  torch::Tensor normal(std::size_t count, Rng& rng) const {
    std::vector<float> values(count * static_cast<std::size_t>(config.actor.outputs));
    for (float& value : values) value = static_cast<float>(rng.normal());
    return nn::torch_rows(std::span<const float>(values), count, device).clone();
  }

  torch::Tensor policy(const nn::TorchNetwork& network, const Rows& seen) const {
    const torch::Tensor raw = network.raw(seen.windows, seen.features);
    return action_of(head, raw.slice(1, 0, config.actor.outputs));
  }

  /// What the rest of the episode is worth, by the targets' judgement (3.16).
  torch::Tensor next_value(const Rows& next, std::size_t count, Rng& rng) const {
    if (config.algorithm == Algorithm::kSac) {
      const DrawnAction drawn = draw_action(head, actor.raw(next.windows, next.features), normal(count, rng));
      return least_q(target_critics, next, drawn.action) - log_temperature.exp() * drawn.log_probability;
    }
    torch::Tensor actions = policy(target_actor, next);
    if (td3(config)) {  // Fujimoto et al. 2018: targets are smoothed over neighbouring actions
      const torch::Tensor noise =
          (config.target_noise * normal(count, rng)).clamp(-config.target_noise_clip, config.target_noise_clip);
      actions = moved_action(head, actions, noise);
    }
    return least_q(target_critics, next, actions);
  }

  LearnReport learn_critics(const TransitionBatch& batch, const Rows& seen, const torch::Tensor& actions, Rng& rng) {
    torch::Tensor targets;
    {
      const torch::NoGradGuard no_gradients;
      const Rows next = rows(batch.next_windows, batch.next_features, batch.count);
      const std::span<const float> rewards(batch.rewards), discounts(batch.discounts);
      targets = nn::torch_rows(rewards, batch.count, device) +
                nn::torch_rows(discounts, batch.count, device) * next_value(next, batch.count, rng);
    }
    torch::Tensor loss = torch::zeros({1}).to(device);
    LearnReport report;
    for (std::size_t i = 0; i < critics.size(); ++i) {
      const torch::Tensor values = q(critics[i], seen, actions);
      if (i == 0) report.value = values.mean().item<double>();
      loss = loss + (values - targets).square().mean();
    }
    report.critic_loss = loss.item<double>() / static_cast<double>(critics.size());
    critic_steps.step(loss);
    return report;
  }

  void learn_actor(const TransitionBatch& batch, const Rows& seen, const torch::Tensor& actions, Rng& rng) {
    if (config.algorithm == Algorithm::kSac) {
      const DrawnAction drawn = draw_action(head, actor.raw(seen.windows, seen.features), normal(batch.count, rng));
      const torch::Tensor values = least_q(critics, seen, drawn.action);
      actor_steps.step((log_temperature.exp().detach() * drawn.log_probability - values).mean());
      const double wanted = std::isnan(config.target_entropy) ? ActorCriticConfig::target_entropy_of(config.actor)
                                                              : config.target_entropy;
      temperature_steps.step(-(log_temperature.exp() * (drawn.log_probability.detach() + wanted)).mean());
      return;
    }
    const torch::Tensor chosen = policy(actor, seen);
    const torch::Tensor values = q(critics.front(), seen, chosen);
    if (config.algorithm != Algorithm::kTd3Bc) return actor_steps.step(-values.mean());
    // Fujimoto and Gu 2021, eq. (5), the cloning term only over what was demonstrated
    const torch::Tensor shown = nn::torch_rows(std::span<const float>(batch.demonstrated), batch.count, device);
    const torch::Tensor scale = config.cloning / values.abs().mean().detach().clamp_min(1e-6);
    const torch::Tensor off = ((chosen - actions).square().sum(1, true) * shown).sum() / shown.sum().clamp_min(1.0);
    actor_steps.step(-scale * values.mean() + off);
  }

  void follow(double part) {
    target_actor.follow(actor, part);
    for (std::size_t i = 0; i < critics.size(); ++i) target_critics[i].follow(critics[i], part);
  }

  /// SAC: from the policy's parameters alone, with the same spread everywhere.
  void set_policy(std::span<const float> parameters) {
    if (config.algorithm != Algorithm::kSac) return actor.set_parameters(parameters);
    const nn::LayerShape mine = last_layer(actor.spec()), theirs = last_layer(config.actor);
    if (parameters.size() != config.actor.parameter_count()) throw InputError("actor: another number of parameters");
    std::vector<float> all(actor.spec().parameter_count(), 0.0F);
    std::ranges::copy(parameters.first(theirs.biases_at), all.begin());
    std::ranges::copy(parameters.subspan(theirs.biases_at), all.begin() + static_cast<std::ptrdiff_t>(mine.biases_at));
    std::fill(all.begin() + static_cast<std::ptrdiff_t>(mine.biases_at) + config.actor.outputs, all.end(),
              static_cast<float>(std::log(kFirstSpread)));
    actor.set_parameters(all);
  }

  std::vector<float> policy_parameters() const {
    std::vector<float> all = actor.parameters();
    if (config.algorithm != Algorithm::kSac) return all;
    const nn::LayerShape mine = last_layer(actor.spec()), theirs = last_layer(config.actor);
    std::vector<float> kept(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(theirs.biases_at));
    const auto biases = all.begin() + static_cast<std::ptrdiff_t>(mine.biases_at);
    kept.insert(kept.end(), biases, biases + config.actor.outputs);
    return kept;
  }

  void start_spread() { set_policy(policy_parameters()); }
};

ActorCritic::ActorCritic(const ActorCriticConfig& config) : impl_(std::make_unique<Impl>(checked(config))) {}
ActorCritic::~ActorCritic() = default;
ActorCritic::ActorCritic(ActorCritic&&) noexcept = default;
ActorCritic& ActorCritic::operator=(ActorCritic&&) noexcept = default;

const ActorCriticConfig& ActorCritic::config() const { return impl_->config; }

void ActorCritic::act(const State& state, std::span<float> action) const {
  const torch::NoGradGuard no_gradients;
  const auto seen = impl_->rows(state.windows, state.features, 1);
  std::ranges::copy(nn::torch_values(impl_->policy(impl_->actor, seen)), action.begin());
}

void ActorCritic::sample(const State& state, Rng& rng, std::span<float> action) const {
  if (impl_->config.algorithm != Algorithm::kSac) return act(state, action);
  const torch::NoGradGuard no_gradients;
  const auto seen = impl_->rows(state.windows, state.features, 1);
  const DrawnAction drawn =
      draw_action(impl_->head, impl_->actor.raw(seen.windows, seen.features), impl_->normal(1, rng));
  std::ranges::copy(nn::torch_values(drawn.action), action.begin());
}

LearnReport ActorCritic::learn(const TransitionBatch& batch, Rng& rng, bool actor_too) {
  const auto seen = impl_->rows(batch.windows, batch.features, batch.count);
  const torch::Tensor actions = nn::torch_rows(std::span<const float>(batch.actions), batch.count, impl_->device);
  const LearnReport report = impl_->learn_critics(batch, seen, actions, rng);
  const bool turn = !td3(impl_->config) || impl_->steps % impl_->config.policy_delay == 0;
  if (actor_too && turn) impl_->learn_actor(batch, seen, actions, rng);
  impl_->follow(impl_->config.smoothing);
  ++impl_->steps;
  return report;
}

std::vector<float> ActorCritic::policy_parameters() const { return impl_->policy_parameters(); }

void ActorCritic::set_policy_parameters(std::span<const float> parameters) {
  impl_->set_policy(parameters);
  impl_->target_actor.follow(impl_->actor, 1.0);
}

double ActorCritic::value(const State& state, std::span<const float> action) const {
  const torch::NoGradGuard no_gradients;
  const auto seen = impl_->rows(state.windows, state.features, 1);
  return impl_->least_q(impl_->critics, seen, nn::torch_rows(action, 1, impl_->device)).item<double>();
}

void ActorCritic::save(nn::ByteWriter& writer) const {
  save_network(writer, impl_->actor);
  save_network(writer, impl_->target_actor);
  for (const auto* list : {&impl_->critics, &impl_->target_critics}) {
    for (const nn::TorchNetwork& network : *list) save_network(writer, network);
  }
  writer.number(nn::torch_values(impl_->log_temperature).front());
  for (const auto* optimiser : {&impl_->actor_steps, &impl_->critic_steps, &impl_->temperature_steps}) {
    writer.text(optimiser->state());
  }
  writer.number(impl_->steps);
}

void ActorCritic::load(nn::ByteReader& reader) {
  load_network(reader, impl_->actor);
  load_network(reader, impl_->target_actor);
  for (auto* list : {&impl_->critics, &impl_->target_critics}) {
    for (nn::TorchNetwork& network : *list) load_network(reader, network);
  }
  {
    const torch::NoGradGuard no_gradients;
    impl_->log_temperature.fill_(reader.number<float>());
  }
  for (auto* optimiser : {&impl_->actor_steps, &impl_->critic_steps, &impl_->temperature_steps}) {
    optimiser->set_state(reader.text(), impl_->device);
  }
  impl_->steps = reader.number<std::uint64_t>();
}

double log_projected_normal(int dimension, double cosine, double sigma) {
  const auto number = [](double value) { return torch::full({1}, value, torch::kFloat64); };
  return log_projected_normal(dimension, number(cosine), number(sigma)).item<double>();
}

}  // namespace stairwell::rl
