#include "learning/train/imitation.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::train {

using planning3d::AgentInput;
using planning3d::KeepOut;
using planning3d::SegmentCheck;

namespace {

constexpr std::uint64_t kBcRounds = 4;  // DAgger's first rounds: the teacher flies
constexpr double kKeptShare = 0.4;      // of all looks that are kept: neighbours are much the same
constexpr std::size_t kClearance = 15;  // its place among the features
constexpr float kTight = 0.2F;          // clearance (as a feature) below which all are kept
constexpr int kGoalsPerWorld = 4;
constexpr int kFlightsPerGoal = 10;
constexpr int kRecovery = 6;      // steps that the teacher flies after the student has touched something
constexpr double kReach_m = 0.2;  // of the goal

ImitationConfig checked(const ImitationConfig& config) {
  if (const auto list = config.problems(); !list.empty()) throw InputError("training: " + list.front());
  return config;
}

Teacher::Config teacher_config(const ImitationConfig& config) {
  Teacher::Config teacher;
  teacher.plane = config.input.plane;
  return teacher;
}

planning3d::ArrivalField::Config field_config(const ImitationConfig& config) {
  planning3d::ArrivalField::Config field;
  field.plane = config.input.plane;
  return field;
}

nn::TrainerConfig trainer_config(const ImitationConfig& config) {
  nn::TrainerConfig trainer;
  trainer.learning_rate = config.learning_rate;
  trainer.device = config.device;
  return trainer;
}

Eigen::Vector3d shaken(const Eigen::Vector3d& direction, double sigma, bool plane, Rng& rng) {
  const Eigen::Vector3d noise(rng.normal(0.0, sigma), rng.normal(0.0, sigma), plane ? 0.0 : rng.normal(0.0, sigma));
  const Eigen::Vector3d sum = direction + noise;  // in R3, then a direction again: no seam, no poles
  return sum.norm() > 1e-6 ? Eigen::Vector3d(sum.normalized()) : direction;
}

}  // namespace

ImitationConfig ImitationConfig::slice() {
  ImitationConfig config;
  config.input = AgentInput::slice();
  return config;
}

ImitationConfig ImitationConfig::volume() { return {}; }

nn::NetworkSpec ImitationConfig::network() const {
  nn::NetworkSpec spec;
  spec.windows = input.windows();
  if (input.plane) {
    spec.trunk = {{8, 3, 2}, {16, 3, 2}, {32, 3, 2}, {32, 3, 2}};
  } else {
    spec.trunk = {{8, 3, 2}, {16, 3, 2}, {32, 3, 2}};
  }
  spec.features = AgentInput::kFeatures;
  spec.hidden = {128, 64};
  spec.head = head;
  spec.outputs = (head == nn::Head::kAngles ? 2 : 3) - (input.plane ? 1 : 0);
  return spec;
}

std::vector<std::string> ImitationConfig::problems() const {
  std::vector<std::string> list = input.problems();
  if (steps == 0 || steps > 100'000'000) list.emplace_back("steps must be 1 to 100000000");
  if (batch == 0 || batch > 65'536) list.emplace_back("batch must be 1 to 65536");
  if (steps_per_round == 0 || looks_per_round == 0) list.emplace_back("a round must have steps and looks");
  if (capacity < batch) list.emplace_back("capacity must hold a batch");
  if (!(learning_rate > 0.0 && learning_rate < 1.0)) list.emplace_back("learning_rate must be between 0 and 1");
  if (!(teacher_share >= 0.0 && teacher_share <= 1.0)) list.emplace_back("teacher_share must be 0 to 1");
  if (head == nn::Head::kValues) list.emplace_back("head must be unit_vector or angles");
  return list;
}

/// One flight towards the goal that field and teacher know.
struct Imitation::Flight {
  const SegmentCheck* check = nullptr;
  Eigen::Vector3d at_m, goal_m;
  bool student = false;
  double noise = 0.0;
};

Imitation::Imitation(const ImitationConfig& config, const ImitationState* resumed)
    : config_(checked(config)),
      trainer_(config.network(), config.seed, trainer_config(config)),
      replay_(config.input, config.head, config.network().outputs, config.capacity),
      teacher_(teacher_config(config)),
      field_(field_config(config)),
      view_(config.input),
      outputs_(static_cast<std::size_t>(config.network().outputs)) {
  if (resumed == nullptr) return;
  trainer_.set_parameters(resumed->parameters);
  trainer_.set_optimiser_state(resumed->optimiser);
  round_ = resumed->round;
  steps_ = resumed->steps;
}

ImitationState Imitation::state() const { return {round_, steps_, trainer_.parameters(), trainer_.optimiser_state()}; }

nn::Model Imitation::model() const {
  return path_model(config_.input, config_.network(), config_.seed, steps_, trainer_.parameters());
}

nn::Model path_model(const AgentInput& input, const nn::NetworkSpec& network, std::uint64_t seed, std::uint64_t steps,
                     std::vector<float> parameters) {
  nn::Model model;
  model.agent = input.plane ? "path2d" : "path3d";
  model.input = input.text();
  model.network = network;
  model.seed = seed;
  model.steps = steps;
  model.parameters = std::move(parameters);
  return model;
}

RoundReport Imitation::round() {
  RoundReport report;
  student_ = std::make_unique<nn::Network>(config_.network(), trainer_.parameters());
  student_flights_ = student_reached_ = 0;
  report.round = round_;
  collect(report);
  learn(report);
  report.student_success = student_flights_ > 0
                               ? static_cast<double>(student_reached_) / static_cast<double>(student_flights_)
                               : std::numeric_limits<double>::quiet_NaN();
  ++round_;
  report.steps = steps_;
  return report;
}

void Imitation::collect(RoundReport& report) {
  Rng rng = make_rng(config_.seed, "train-round-" + std::to_string(round_));
  while (report.looks < config_.looks_per_round) fly_in(random_training_world(config_.input.plane, rng), rng, report);
}

void Imitation::fly_in(const TrainingWorld& world, Rng& rng, RoundReport& report) {
  const planning3d::FreeSpace space = world.space();
  const Aabb box = space.grid().box();
  std::optional<double> height_m;
  if (config_.input.plane) height_m = rng.uniform(0.3, 0.7) * (box.max_m.z() - box.min_m.z());
  for (int g = 0; g < kGoalsPerWorld; ++g) {
    const auto goal = random_place(space, height_m, rng);
    if (!goal) return;
    std::vector<KeepOut> keep_out;
    if (rng.uniform() < 0.2) {  // a fellow UAV
      const auto fellow = random_place(space, height_m, rng);
      if (fellow && (*fellow - *goal).norm() > 1.0) keep_out.push_back({*fellow, rng.uniform(0.4, 0.8)});
    }
    const SegmentCheck check(space, keep_out, *goal);
    field_.compute(space, check, *goal, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    teacher_.begin(space, check, *goal);
    for (int f = 0; f < kFlightsPerGoal; ++f) {
      const auto start = random_place(space, height_m, rng);
      if (!start || !check.voxel_free(space.grid().index_of(*start)) || !check.outside_keep_out(*start)) continue;
      const float left_m = field_.value_m(*start);
      if (!(left_m > 0.8F && left_m < 60.0F)) continue;
      const bool teacher_flies = config_.algorithm == ImitationConfig::Algorithm::kBc || round_ < kBcRounds ||
                                 rng.uniform() < config_.teacher_share;
      view_.begin(space, keep_out, field_);
      Flight flight{&check, *start, *goal, !teacher_flies, rng.uniform(0.0, teacher_flies ? 0.8 : 0.15)};
      fly(flight, rng, report);
    }
  }
}

void Imitation::fly(Flight& flight, Rng& rng, RoundReport& report) {
  const double longest_m = 2.0 * static_cast<double>(field_.value_m(flight.at_m)) + 2.0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero(), shake = Eigen::Vector3d::Zero();
  int recovering = 0;
  bool touched = false, reached = false;
  planning3d::RolloutConfig alone;
  alone.slide = false;
  for (double flown_m = 0.0; flown_m < longest_m;) {
    if ((flight.at_m - flight.goal_m).norm() <= kReach_m) {
      reached = true;
      break;
    }
    view_.look(flight.at_m, seen_);
    const bool kept = rng.uniform() < kKeptShare || seen_.features[kClearance] < kTight;
    const bool student = flight.student && recovering == 0;
    Eigen::Vector3d right = Eigen::Vector3d::UnitX();
    if ((kept || !student) && !teacher_.direction(flight.at_m, right)) break;
    if (kept) {
      replay_.add(seen_, planning3d::turned(right, -seen_.yaw_rad));
      ++report.looks;
    }
    Eigen::Vector3d chosen = right;
    if (student) {
      student_->infer(seen_.windows, seen_.features, outputs_);
      chosen = planning3d::turned(planning3d::direction_of(config_.head, config_.input.plane, outputs_), seen_.yaw_rad);
    } else if (recovering == 0) {  // a bias that lasts, so that it really gets off the way
      shake = 0.8 * shake + 0.6 * (shaken(right, flight.noise, config_.input.plane, rng) - right);
      chosen = right + shake;
    }
    recovering = std::max(0, recovering - 1);
    Eigen::Vector3d to_m;
    if (!fitting_step(*flight.check, alone, config_.input.plane, flight.at_m, last, chosen, to_m)) {
      touched = true;
      recovering = kRecovery;
      shake = Eigen::Vector3d::Zero();
      if (!teacher_.direction(flight.at_m, right)) break;
      if (!fitting_step(*flight.check, {}, config_.input.plane, flight.at_m, {0, 0, 0}, right, to_m)) break;
    }
    last = (to_m - flight.at_m).normalized();
    flown_m += (to_m - flight.at_m).norm();
    flight.at_m = to_m;
  }
  if (!flight.student) return;
  ++student_flights_;
  if (reached && !touched) ++student_reached_;
}

void Imitation::learn(RoundReport& report) {
  Rng rng = make_rng(config_.seed, "train-batches-" + std::to_string(round_));
  std::size_t done = 0;
  for (; done < config_.steps_per_round && !finished(); ++done, ++steps_) {
    const double part = static_cast<double>(steps_) / static_cast<double>(config_.steps);
    trainer_.set_learning_rate(config_.learning_rate * 0.5 * (1.0 + std::cos(kPi * part)));
    report.loss += trainer_.step(replay_.draw(config_.batch, rng));
  }
  if (done > 0) report.loss /= static_cast<double>(done);
}

TrainingWorld random_training_world(bool plane, Rng& rng) {
  if (plane) {
    SliceWorldConfig config;
    const double kind = rng.uniform();
    if (kind < 0.3) config.size_m = rng.uniform(12.0, 20.0);
    if (kind > 0.6) config.least_obstacles = 0.2;
    const Robot robot{rng.uniform(0.15, 0.3), 0.0};
    const VoxelScene scene = make_slice_scene(config, rng);
    if (rng.uniform() < 0.75) return {scene, robot};
    const TrainingWorld known(scene, robot);
    std::vector<Eigen::Vector3d> places;
    for (int i = rng.uniform_int(2, 6); i > 0; --i) {
      if (const auto place = random_place(known.space(), rng.uniform(0.6, 1.4), rng)) places.push_back(*place);
    }
    const auto seen = seen_from(scene, places, rng.uniform(3.0, 6.0));
    return {scene, robot, &seen};
  }
  StoreyWorldConfig config;
  const Robot robot{rng.uniform(0.18, 0.3), 0.0};
  const VoxelScene scene = make_storey_scene(config, rng);
  if (rng.uniform() < 0.5) return {scene, robot};
  const TrainingWorld known(scene, robot);
  std::vector<Eigen::Vector3d> places;
  for (int i = rng.uniform_int(3, 10); i > 0; --i) {
    if (const auto place = random_place(known.space(), std::nullopt, rng)) places.push_back(*place);
  }
  const auto seen = seen_from(scene, places, rng.uniform(3.5, 6.0));
  return {scene, robot, &seen};
}

}  // namespace stairwell::train
