#include "apps/training/training_run.hpp"
#include "core/errors.hpp"
#include "learning/nn/sealed_bytes.hpp"
#include "learning/train/coverage_training.hpp"

#include <cmath>
#include <cstdio>
#include <sstream>

namespace stairwell::apps {

namespace {

constexpr const char* kKind = "stairwell-coverage 1";
constexpr int kEpisodesPerRow = 10;

train::CoverageTrainingConfig config_of(const TrainingRequest& request) {
  if (!request.from.empty() || request.demonstrations) {
    throw InputError("--from and --demonstrations are for path agents (--algo ddpg, td3, sac, td3bc)");
  }
  using Reward = train::CoverageEnvironmentConfig::Reward;
  train::CoverageTrainingConfig config;
  config.environment.reward = request.reward == "thesis" ? Reward::kThesis : Reward::kProgress;
  config.seed = request.seed;
  config.steps = request.steps;
  config.device = request.device;
  return config;
}

class CoverageRun final : public TrainingRun {
 public:
  explicit CoverageRun(const TrainingRequest& request) : training_(config_of(request)) {}

  std::uint64_t steps() const override { return training_.steps(); }
  bool finished() const override { return training_.finished(); }
  std::string columns() const override { return "episode,step,reward,t90_s,finish_s,failures,loss"; }
  std::string advance() override {
    train::CoverageEpisode last;
    double loss = 0.0, reward = 0.0, t90_s = 0.0, finish_s = 0.0, failures = 0.0;
    int flown = 0, learned = 0;
    for (int count = 0; count < kEpisodesPerRow && !finished(); ++count) {
      last = training_.episode();
      if (!std::isnan(last.loss)) {
        loss += last.loss;
        ++learned;
      }
      if (last.shown) continue;
      reward += last.flown.reward;
      t90_s += last.flown.t90_s;
      finish_s += last.flown.finish_s;
      failures += static_cast<double>(last.flown.failures);
      ++flown;
    }
    loss_ = loss / learned;  // NaN: nothing learned
    reward_ = reward / flown;
    finish_s_ = finish_s / flown;
    std::ostringstream row;
    row << last.episode << ',' << steps() << ',';
    if (flown > 0) row << reward_ << ',' << t90_s / flown << ',' << finish_s_ << ',' << failures / flown << ',';
    if (flown == 0) row << ",,,,";
    if (learned > 0) row << loss_;
    return row.str();
  }
  std::string summary() const override {
    if (std::isnan(loss_)) return "flown by rules of thumb";
    char text[100];
    std::snprintf(text, sizeof text, "reward %.2f  finish %.0f s  loss %.4f", reward_, finish_s_, loss_);
    return text;
  }
  std::string checkpoint(const std::string& command) const override {
    return nn::seal(kKind, command, training_.state());
  }
  void resume(std::string_view bytes, const std::string& command) override {
    training_.set_state(nn::unseal(bytes, kKind, command));
  }
  double seconds_between_checkpoints() const override { return 120.0; }  // they hold the replay
  nn::Model model() const override { return training_.model(); }

 private:
  train::CoverageTraining training_;
  double reward_ = 0.0, finish_s_ = 0.0, loss_ = 0.0;
};

}  // namespace

std::unique_ptr<TrainingRun> make_coverage_run(const TrainingRequest& request) {
  return std::make_unique<CoverageRun>(request);
}

}  // namespace stairwell::apps
