#include "planning3d/agent_planner.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "planning3d/connectivity.hpp"
#include "planning3d/plan_ends.hpp"
#include "planning3d/shorten_path.hpp"
#include "planning3d/slice_legs.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr double kProgress_m = 0.05;  // nearer by so much is progress

ArrivalField::Config field_config(const AgentInput& input) {
  ArrivalField::Config config;
  config.plane = input.plane;
  return config;
}

}  // namespace

const char* to_string(RolloutEnd end) {
  switch (end) {
    case RolloutEnd::kReached:
      return "reached";
    case RolloutEnd::kCollision:
      return "collision";
    case RolloutEnd::kNoProgress:
      return "no progress";
    case RolloutEnd::kTooLong:
      return "too long";
    case RolloutEnd::kNoWay:
      return "no way";
  }
  return "?";
}

Rollout::Rollout(const SegmentCheck& check, AgentView& view, const ArrivalField& field, const RolloutConfig& config,
                 const Eigen::Vector3d& start_m)
    : check_(&check), view_(&view), field_(&field), config_(config), path_m_{start_m} {
  const double left_m = static_cast<double>(field.value_m(start_m));
  least_left_m_ = std::numeric_limits<double>::infinity();
  longest_m_ = config.detour * left_m + 2.0;
  std::vector<Eigen::Vector3d> way;
  field.descend(start_m, 0.1, way);
  if (way.empty()) finish(RolloutEnd::kNoWay);
}

bool Rollout::finish(RolloutEnd end) {
  ended_ = true;
  end_ = end;
  return false;
}

bool Rollout::look(Observation& seen) {
  if (ended_) return false;
  const Eigen::Vector3d& at_m = path_m_.back();
  const Eigen::Vector3d& goal_m = field_->goal_m();
  if ((goal_m - at_m).norm() <= config_.goal_reach_m && check_->segment_free(at_m, goal_m)) {
    if (at_m != goal_m || path_m_.size() == 1) path_m_.push_back(goal_m);
    return finish(RolloutEnd::kReached);
  }
  view_->look(at_m, seen);
  if (view_->way_left_m() < least_left_m_ - kProgress_m) {
    least_left_m_ = view_->way_left_m();
    since_least_m_ = 0.0;
  }
  if (since_least_m_ > config_.patience_m) return finish(RolloutEnd::kNoProgress);
  if (!(flown_m_ <= longest_m_)) return finish(RolloutEnd::kTooLong);
  return true;
}

bool Rollout::try_step(const Eigen::Vector3d& direction, double step_m) {
  const Eigen::Vector3d to_m = path_m_.back() + step_m * direction;
  if (!check_->segment_free(path_m_.back(), to_m)) return false;
  path_m_.push_back(to_m);
  last_ = direction;
  flown_m_ += step_m;
  since_least_m_ += step_m;
  return true;
}

void Rollout::move(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d wanted = direction.normalized();
  Eigen::Vector3d mixed = wanted + config_.keep * last_;
  mixed = mixed.norm() > 1e-3 ? mixed.normalized() : wanted;
  for (double step_m = config_.step_m; step_m >= config_.least_step_m; step_m *= 0.5) {
    if (try_step(mixed, step_m) || try_step(wanted, step_m)) return;
  }
  if (!config_.slide || !slide_along(wanted)) finish(RolloutEnd::kCollision);
}

bool Rollout::slide_along(const Eigen::Vector3d& wanted) {
  constexpr int kAround = 8;
  const bool plane = view_->input().plane;
  const Eigen::Vector3d side = std::abs(wanted.z()) < 0.9 ? Eigen::Vector3d(-wanted.y(), wanted.x(), 0.0).normalized()
                                                          : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d up = wanted.cross(side);
  for (const double off_deg : {20.0, 40.0, 60.0, 80.0}) {
    const double off = rad_from_deg(off_deg);
    for (int i = 0; i < kAround; i += plane ? kAround / 2 : 1) {
      const double around = 2.0 * kPi * i / kAround;
      const Eigen::Vector3d tilted = std::cos(around) * side + std::sin(around) * up;
      if (try_step(std::cos(off) * wanted + std::sin(off) * tilted, 0.5 * config_.step_m)) return true;
    }
  }
  return false;
}

void require_fitting(const AgentInput& input, const nn::NetworkSpec& network) {
  if (network.windows != input.windows() || network.features != AgentInput::kFeatures) {
    throw InputError("the network's inputs are not what the agent is shown: " + network.text() + " / " + input.text());
  }
  const int directions = network.head == nn::Head::kAngles ? 2 : 3;
  if (network.head == nn::Head::kValues || network.outputs != directions - (input.plane ? 1 : 0)) {
    throw InputError("the network's outputs are no direction: " + network.text());
  }
}

AgentPlanner::AgentPlanner(const nn::Model& model) : AgentPlanner(model, Config{}) {}

AgentPlanner::AgentPlanner(const nn::Model& model, const Config& config)
    : config_(config),
      input_(AgentInput::parse(model.input)),
      network_(model.network, model.parameters),
      field_(field_config(input_)),
      view_(input_),
      outputs_(static_cast<std::size_t>(model.network.outputs)) {
  require_fitting(input_, model.network);
}

std::unique_ptr<AgentPlanner> AgentPlanner::load(std::string_view name, const std::filesystem::path& models_dir) {
  const std::string agent = name == "agent2d" ? "path2d" : "path3d";
  const std::filesystem::path file = models_dir / (agent + ".model");
  const nn::Model model = nn::read_model(file, agent);
  try {
    return std::make_unique<AgentPlanner>(model);
  } catch (const InputError& problem) {
    throw InputError(file.string() + ": " + problem.what());
  }
}

Eigen::Vector3d AgentPlanner::direction(const Observation& seen) {
  network_.infer(seen.windows, seen.features, outputs_);
  return turned(direction_of(network_.spec().head, input_.plane, outputs_), seen.yaw_rad);
}

PlanStatus AgentPlanner::fly(const FreeSpace& space, const SegmentCheck& check, const PlanRequest& request,
                             const Eigen::Vector3d& goal_m, std::vector<Eigen::Vector3d>& path_m, std::size_t& looks) {
  const Eigen::Vector3d start_m = path_m.back();
  if (request.late()) return PlanStatus::kTimedOut;
  if (!field_.compute(space, check, goal_m, start_m, [&request] { return request.late(); })) {
    return PlanStatus::kTimedOut;
  }
  view_.begin(space, request.keep_out, field_);
  Rollout rollout(check, view_, field_, config_.rollout, start_m);
  while (rollout.look(seen_)) {
    if (looks++ >= request.max_expansions || request.late()) return PlanStatus::kTimedOut;
    rollout.move(direction(seen_));
  }
  last_end_ = rollout.end();
  if (last_end_ == RolloutEnd::kNoProgress || last_end_ == RolloutEnd::kTooLong) return PlanStatus::kLocalMinimum;
  if (last_end_ != RolloutEnd::kReached) return PlanStatus::kNoPath;
  const std::vector<Eigen::Vector3d> flown_m = smooth_path(check, rollout.path_m(), config_.smoothings);
  path_m.insert(path_m.end(), flown_m.begin() + 1, flown_m.end());
  return PlanStatus::kReached;
}

PlanResult AgentPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  const GivingUp giving_up(space, request);
  const SegmentCheck check(space, request.keep_out, request.start_m);
  PlanEnds ends;
  result.status = find_ends(space, request, check, ends);
  if (result.status != PlanStatus::kReached) return result;
  const auto give_up = [&](PlanStatus ended) {
    result.status = giving_up.status(ended, ends.start, ends.goal);
    return result;
  };
  last_end_ = RolloutEnd::kNoWay;
  const bool slice = request.rule.kind == MotionRule::Kind::kSlice;
  if (input_.plane ? !slice && ends.start.z != ends.goal.z : slice) return give_up(PlanStatus::kLocalMinimum);
  std::vector<Eigen::Vector3d> legs_m{ends.start_m, ends.goal_m};
  if (input_.plane && ends.start.z != ends.goal.z) {
    legs_m = slice_legs(space, check, request.rule, ends.start_m, ends.goal_m, costs_);
    if (legs_m.empty()) return give_up(PlanStatus::kLocalMinimum);
  }
  std::vector<Eigen::Vector3d> path_m{request.start_m};
  if (ends.start_m != request.start_m) path_m.push_back(ends.start_m);
  for (std::size_t i = 1; i < legs_m.size(); ++i) {
    const bool straight = input_.plane && (legs_m[i] - legs_m[i - 1]).head<2>().norm() < 1e-6;
    Eigen::Vector3d to_m = legs_m[i];
    if (input_.plane && !straight) to_m.z() = path_m.back().z();
    const PlanStatus status =
        straight ? PlanStatus::kReached : fly(space, check, request, to_m, path_m, result.expansions);
    if (status != PlanStatus::kReached) return give_up(status);
    if (path_m.back() != legs_m[i] || path_m.size() == 1) path_m.push_back(legs_m[i]);
  }
  result.status = PlanStatus::kReached;
  result.length_m = path_length_m(path_m);
  result.path_m = std::move(path_m);
  return result;
}

std::vector<Eigen::Vector3d> smooth_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, int rounds) {
  constexpr int kRepairs = 4;
  std::vector<Eigen::Vector3d> next = path_m;
  std::vector<bool> pinned(path_m.size(), false);
  for (int round = 0; round < rounds && path_m.size() > 2; ++round) {
    for (std::size_t i = 1; i + 1 < path_m.size(); ++i) {
      next[i] = pinned[i] ? path_m[i] : Eigen::Vector3d(0.25 * path_m[i - 1] + 0.5 * path_m[i] + 0.25 * path_m[i + 1]);
    }
    bool touches = true;
    for (int repair = 0; repair < kRepairs && touches; ++repair) {
      touches = false;
      for (std::size_t i = 1; i < next.size(); ++i) {
        if (check.segment_free(next[i - 1], next[i])) continue;
        touches = true;
        for (const std::size_t k : {i - 1, i}) {
          next[k] = path_m[k];
          pinned[k] = true;
        }
      }
    }
    if (touches) return path_m;
    path_m = next;
  }
  return path_m;
}

}  // namespace stairwell::planning3d
