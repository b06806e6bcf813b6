#include "apps/training/training_run.hpp"
#include "core/errors.hpp"
#include "learning/train/imitation.hpp"
#include "learning/train/training_checkpoint.hpp"

#include <cmath>
#include <cstdio>
#include <sstream>

namespace stairwell::apps {

namespace {

train::ImitationConfig config_of(const TrainingRequest& request) {
  using Config = train::ImitationConfig;
  Config config;
  config.algorithm = request.algorithm == "bc" ? Config::Algorithm::kBc : Config::Algorithm::kDagger;
  config.head = request.head == "angles" ? nn::Head::kAngles : nn::Head::kUnitVector;
  config.input = input_of(request);
  config.steps = request.steps;
  config.seed = request.seed;
  config.device = request.device;
  return config;
}

class ImitationRun final : public TrainingRun {
 public:
  explicit ImitationRun(const TrainingRequest& request) : config_(config_of(request)), imitation_(config_) {
    if (!request.from.empty() || request.demonstrations) {
      throw InputError(
          "--from and --demonstrations are for learning by trial and error (--algo ddpg, td3, sac, td3bc)");
    }
  }

  std::uint64_t steps() const override { return report_.steps; }
  bool finished() const override { return imitation_.finished(); }
  std::string columns() const override { return "round,step,looks,loss,student_success"; }
  std::string advance() override {
    report_ = imitation_.round();
    std::ostringstream row;
    row << report_.round << ',' << report_.steps << ',' << report_.looks << ',' << report_.loss << ',';
    if (!std::isnan(report_.student_success)) row << report_.student_success;
    return row.str();
  }
  std::string summary() const override {
    char text[80];
    std::snprintf(text, sizeof text, "loss %.4f  success %.1f %%", report_.loss, 100.0 * report_.student_success);
    return text;
  }
  std::string checkpoint(const std::string& command) const override {
    return train::checkpoint_bytes(imitation_.state(), command);
  }
  void resume(std::string_view bytes, const std::string& command) override {
    const train::ImitationState state = train::parse_checkpoint(bytes, command);
    imitation_ = train::Imitation(config_, &state);
    report_.steps = state.steps;
  }
  double seconds_between_checkpoints() const override { return 20.0; }
  nn::Model model() const override { return imitation_.model(); }

 private:
  train::ImitationConfig config_;
  train::Imitation imitation_;
  train::RoundReport report_;
};

}  // namespace

std::unique_ptr<TrainingRun> make_imitation_run(const TrainingRequest& request) {
  return std::make_unique<ImitationRun>(request);
}

}  // namespace stairwell::apps
