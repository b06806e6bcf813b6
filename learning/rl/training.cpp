#include "learning/rl/training.hpp"

#include "core/errors.hpp"

#include <cmath>
#include <limits>

namespace stairwell::rl {

namespace {

/// Demonstrations are episodes of their own numbers.
constexpr std::uint64_t kFirstDemonstration = std::uint64_t{1} << 40;

TrainingConfig checked(const TrainingConfig& config) {
  if (const auto list = config.problems(); !list.empty()) throw InputError("training: " + list.front());
  return config;
}

ReplayBuffer::Shape shape_of(const nn::NetworkSpec& actor) {
  return {actor.window_values(), static_cast<std::size_t>(actor.features), static_cast<std::size_t>(actor.outputs)};
}

}  // namespace

std::vector<std::string> TrainingConfig::problems() const {
  std::vector<std::string> list;
  const auto require = [&](bool usable, const char* what) {
    if (!usable) list.emplace_back(what);
  };
  require(updates >= 1, "updates must be 1 or more");
  require(warmup + demonstrations >= 1, "there must be something to learn from: warmup or demonstrations");
  require(steps_per_update >= 1, "steps_per_update must be 1 or more");
  require(batch >= 1 && batch <= 65'536, "batch must be 1 to 65536");
  require(capacity >= 2, "capacity must be 2 or more");
  require(n_step >= 1, "n_step must be 1 or more");
  require(discount > 0.0 && discount <= 1.0, "discount must be above 0, at most 1");
  require(demonstration_share >= 0.0 && demonstration_share <= 1.0, "demonstration_share must be 0 to 1");
  return list;
}

Training::Training(const TrainingConfig& config, const ActorCriticConfig& agent, Environment& environment)
    : config_(checked(config)),
      environment_(&environment),
      agent_(agent),
      own_(shape_of(agent.actor), config.capacity),
      demonstrations_(shape_of(agent.actor),
                      std::max<std::size_t>(2, config.demonstrations + config.demonstrations / 4)) {
  show();
}

void Training::show() {
  State state;
  std::vector<float> action(static_cast<std::size_t>(agent_.config().actor.outputs));
  for (std::uint64_t e = kFirstDemonstration; demonstrations_.transitions() < config_.demonstrations; ++e) {
    environment_->begin(e, state);
    demonstrations_.begin(state);
    bool ended = false;
    while (!ended) {
      if (!environment_->demonstrate(action)) {
        if (e > kFirstDemonstration + config_.demonstrations) throw InputError("training: nobody demonstrates here");
        break;
      }
      const StepResult result = environment_->step(action, state);
      demonstrations_.step(action, result.reward, result.terminal, state);
      ended = result.ended;
    }
  }
}

void Training::choose(const State& state, Noise& noise, Rng& rng, std::span<float> action) const {
  const nn::Head head = agent_.config().actor.head;
  if (config_.random_warmup && steps_ < config_.warmup) return random_action(head, rng, action);
  agent_.sample(state, rng, action);
  if (agent_.config().algorithm != ActorCriticConfig::Algorithm::kSac) perturb(head, noise.next(rng), action);
}

void Training::learn(Rng& rng, EpisodeReport& report) {
  const ReplayBuffer::Draw how{config_.n_step, config_.discount, false};
  const TransitionBatch batch = draw_mixed(own_, demonstrations_, config_.batch, config_.demonstration_share, how, rng);
  const LearnReport learned = agent_.learn(batch, rng, updates_ >= config_.critic_only);
  report.critic_loss += learned.critic_loss;
  report.value += learned.value;
  ++updates_;
}

EpisodeReport Training::episode() {
  Rng rng = make_rng(config_.seed, "rl-episode-" + std::to_string(episodes_));
  EpisodeReport report;
  report.episode = episodes_;
  Noise noise(config_.noise, static_cast<std::size_t>(agent_.config().actor.outputs));
  std::vector<float> action(static_cast<std::size_t>(agent_.config().actor.outputs));
  State state;
  environment_->begin(episodes_, state);
  own_.begin(state);
  const std::uint64_t before = updates_;
  bool ended = false;
  while (!ended && !finished()) {
    choose(state, noise, rng, action);
    const StepResult result = environment_->step(action, state);
    own_.step(action, result.reward, result.terminal, state);
    report.reward += result.reward;
    report.success = result.success;
    ended = result.ended;
    ++steps_;
    if (steps_ > config_.warmup && steps_ % config_.steps_per_update == 0) learn(rng, report);
  }
  ++episodes_;
  const auto learned = static_cast<double>(updates_ - before);
  report.critic_loss = learned > 0 ? report.critic_loss / learned : std::numeric_limits<double>::quiet_NaN();
  report.value = learned > 0 ? report.value / learned : std::numeric_limits<double>::quiet_NaN();
  report.steps = steps_;
  report.updates = updates_;
  return report;
}

std::string Training::state() const {
  nn::ByteWriter writer;
  writer.number(episodes_);
  writer.number(steps_);
  writer.number(updates_);
  agent_.save(writer);
  own_.save(writer);
  return writer.bytes();
}

void Training::set_state(std::string_view state) {
  nn::ByteReader reader(state);
  episodes_ = reader.number<std::uint64_t>();
  steps_ = reader.number<std::uint64_t>();
  updates_ = reader.number<std::uint64_t>();
  agent_.load(reader);
  own_.load(reader);
  reader.finish();
}

}  // namespace stairwell::rl
