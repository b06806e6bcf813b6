#include "apps/training/training_run.hpp"
#include "core/errors.hpp"
#include "learning/nn/sealed_bytes.hpp"
#include "learning/train/path_reinforcement.hpp"

#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

namespace stairwell::apps {

namespace {

constexpr const char* kKind = "stairwell-reinforcement 1";
constexpr int kEpisodesPerRow = 20;

train::PathReinforcementConfig config_of(const TrainingRequest& request) {
  using Algorithm = rl::ActorCriticConfig::Algorithm;
  static const std::map<std::string, Algorithm> kAlgorithms{
      {"ddpg", Algorithm::kDdpg}, {"td3", Algorithm::kTd3}, {"sac", Algorithm::kSac}, {"td3bc", Algorithm::kTd3Bc}};
  train::PathReinforcementConfig config;
  config.environment.input = input_of(request);
  config.environment.head = request.head == "angles" ? nn::Head::kAngles : nn::Head::kUnitVector;
  using Reward = train::PathEnvironmentConfig::Reward;
  config.environment.reward = request.reward == "thesis" ? Reward::kThesis : Reward::kProgress;
  config.algorithm = kAlgorithms.at(request.algorithm);
  config.seed = request.seed;
  config.steps = request.steps;
  config.demonstration_share = request.demonstrations;
  config.device = request.device;
  return config;
}

std::unique_ptr<train::PathReinforcement> started(const TrainingRequest& request) {
  if (request.from.empty()) return std::make_unique<train::PathReinforcement>(config_of(request), nullptr);
  const nn::Model from = nn::read_model(request.from, request.agent);
  try {
    return std::make_unique<train::PathReinforcement>(config_of(request), &from);
  } catch (const InputError& problem) {
    throw InputError(request.from + ": " + problem.what());
  }
}

class ReinforcementRun final : public TrainingRun {
 public:
  explicit ReinforcementRun(const TrainingRequest& request) : learner_(started(request)) {}

  std::uint64_t steps() const override { return learner_->training().updates(); }
  bool finished() const override { return learner_->training().finished(); }
  std::string columns() const override { return "episode,step,flown_steps,reward,success,loss,value"; }
  std::string advance() override {
    rl::EpisodeReport sum;
    int count = 0, learned = 0, reached = 0;
    for (; count < kEpisodesPerRow && !finished(); ++count) {
      const rl::EpisodeReport one = learner_->training().episode();
      sum.episode = one.episode;
      sum.steps = one.steps;
      sum.reward += one.reward;
      reached += one.success ? 1 : 0;
      if (std::isnan(one.critic_loss)) continue;
      sum.critic_loss += one.critic_loss;
      sum.value += one.value;
      ++learned;
    }
    reward_ = sum.reward / count;
    success_ = static_cast<double>(reached) / count;
    loss_ = sum.critic_loss / learned;  // NaN: nothing learned
    std::ostringstream row;
    row << sum.episode << ',' << steps() << ',' << sum.steps << ',' << reward_ << ',' << success_ << ',';
    if (learned > 0) row << loss_ << ',' << sum.value / learned;
    if (learned == 0) row << ',';
    return row.str();
  }
  std::string summary() const override {
    char text[120];
    std::snprintf(text, sizeof text, "reward %.2f  success %.0f %%", reward_, 100.0 * success_);
    if (std::isnan(loss_)) return text;
    const std::string seen = text;
    std::snprintf(text, sizeof text, "  loss %.4f", loss_);
    return seen + text;
  }
  std::string checkpoint(const std::string& command) const override {
    return nn::seal(kKind, command, learner_->training().state());
  }
  void resume(std::string_view bytes, const std::string& command) override {
    learner_->training().set_state(nn::unseal(bytes, kKind, command));
  }
  double seconds_between_checkpoints() const override { return 300.0; }  // they hold the replay
  nn::Model model() const override { return learner_->model(); }

 private:
  std::unique_ptr<train::PathReinforcement> learner_;
  double reward_ = 0.0, success_ = 0.0, loss_ = 0.0;
};

}  // namespace

std::unique_ptr<TrainingRun> make_reinforcement_run(const TrainingRequest& request) {
  return std::make_unique<ReinforcementRun>(request);
}

}  // namespace stairwell::apps
