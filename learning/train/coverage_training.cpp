#include "learning/train/coverage_training.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::train {
namespace {

// Columns of option_rows() that the rules of thumb look at.
constexpr std::size_t kTime = 0, kRate = 4, kTour = 20;
constexpr double kSlip = 0.1;  // chance that a rule of thumb takes any option

rl::DoubleDqnConfig learner(const CoverageTrainingConfig& config) {
  if (const auto list = config.problems(); !list.empty()) throw InputError("coverage training: " + list.front());
  rl::DoubleDqnConfig learner;
  learner.network = config.network();
  learner.learning_rate = config.learning_rate;
  learner.smoothing = 0.01;
  learner.seed = config.seed;
  learner.device = config.device;
  return learner;
}

CoverageEnvironmentConfig seeded(CoverageEnvironmentConfig environment, std::uint64_t seed) {
  environment.seed = seed;
  return environment;
}

/// Nearest, most gain for the time, or shortest tour.
std::size_t by_rule(int rule, const coverage3d::OptionChoice& choice) {
  const auto value = [&](std::size_t option) {
    const float* row = choice.rows.data() + option * static_cast<std::size_t>(coverage3d::kOptionFeatures);
    return rule == 0 ? -row[kTime] : rule == 1 ? row[kRate] : -row[kTour] - 1e-3F * row[kTime];
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < choice.count(); ++i)
    if (value(i) > value(best)) best = i;
  return best;
}

}  // namespace

std::uint64_t CoverageTrainingConfig::shown_episodes() const { return std::clamp<std::uint64_t>(steps / 750, 1, 40); }

nn::NetworkSpec CoverageTrainingConfig::network() const {
  nn::NetworkSpec spec;
  spec.features = coverage3d::kOptionFeatures;
  spec.hidden = {64, 64};
  spec.layer_norm = true;
  return spec;
}

std::vector<std::string> CoverageTrainingConfig::problems() const {
  std::vector<std::string> list = environment.problems();
  if (batch == 0 || capacity < batch) list.emplace_back("batch must be at least 1, capacity at least batch");
  if (!(updates_per_choice > 0.0)) list.emplace_back("updates_per_choice must be above 0");
  return list;
}

CoverageTraining::CoverageTraining(const CoverageTrainingConfig& config)
    : config_(config),
      environment_(seeded(config.environment, config.seed)),
      agent_(learner(config)),
      replay_(config.capacity) {}

ExplorationReport CoverageTraining::fly(bool shown, Rng& rng) const {
  if (shown) {
    const int rule = rng.uniform_int(0, 2);
    return environment_.fly(episodes_, [&](const coverage3d::OptionChoice& choice) {
      if (rng.uniform() < kSlip)
        return static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(choice.count()) - 1));
      return by_rule(rule, choice);
    });
  }
  const double done = static_cast<double>(steps_) / static_cast<double>(config_.steps);
  const double epsilon = config_.first_epsilon * std::pow(config_.last_epsilon / config_.first_epsilon, done);
  return environment_.fly(
      episodes_, [&](const coverage3d::OptionChoice& choice) { return agent_.choose(choice.rows, epsilon, rng); });
}

double CoverageTraining::learn(std::size_t choices, Rng& rng) {
  const auto updates = static_cast<std::uint64_t>(std::ceil(config_.updates_per_choice * static_cast<double>(choices)));
  double sum = 0.0;
  const std::uint64_t count = std::min(updates, config_.steps - steps_);
  for (std::uint64_t i = 0; i < count; ++i) sum += agent_.learn(replay_.draw(config_.batch, rng));
  steps_ += count;
  return count > 0 ? sum / static_cast<double>(count) : std::numeric_limits<double>::quiet_NaN();
}

CoverageEpisode CoverageTraining::episode() {
  Rng rng = make_rng(config_.seed, "coverage training/" + std::to_string(episodes_));
  CoverageEpisode report;
  report.shown = rng.uniform() < config_.shown_share || episodes_ < config_.shown_episodes();
  report.flown = fly(report.shown, rng);
  const std::size_t count = report.flown.choices.size();
  for (rl::Choice& choice : std::exchange(report.flown.choices, {})) replay_.add(std::move(choice));
  ++episodes_;
  const bool ready = episodes_ >= config_.shown_episodes() && replay_.size() > 0;
  report.loss = learn(ready ? count : 0, rng);
  report.episode = episodes_;
  report.steps = steps_;
  return report;
}

std::string CoverageTraining::state() const {
  nn::ByteWriter writer;
  writer.number(episodes_);
  writer.number(steps_);
  agent_.save(writer);
  replay_.save(writer);
  return writer.bytes();
}

void CoverageTraining::set_state(std::string_view state) {
  nn::ByteReader reader(state);
  episodes_ = reader.number<std::uint64_t>();
  steps_ = reader.number<std::uint64_t>();
  agent_.load(reader);
  replay_.load(reader);
  reader.finish();
}

nn::Model CoverageTraining::model() const {
  nn::Model model;
  model.agent = "coverage";
  model.input = std::string(coverage3d::kOptionInput);
  model.network = config_.network();
  model.seed = config_.seed;
  model.steps = steps_;
  model.parameters = agent_.parameters();
  return model;
}

}  // namespace stairwell::train
