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

ArrivalField::Config field_config(const AgentInput& input) {
  ArrivalField::Config config;
  config.plane = input.plane;
  return config;
}

}  // namespace

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
  const auto lost = [this] { return last_end_ == RolloutEnd::kNoProgress || last_end_ == RolloutEnd::kTooLong; };
  std::vector<Eigen::Vector3d> flown_m;
  for (RolloutConfig config = config_.rollout;; config.keep = config_.second_keep) {
    view_.begin(space, request.keep_out, field_);
    Rollout rollout(check, view_, field_, config, start_m);
    while (rollout.look(seen_)) {
      if (looks++ >= request.max_expansions || request.late()) return PlanStatus::kTimedOut;
      rollout.move(direction(seen_));
    }
    last_end_ = rollout.end();
    flown_m = rollout.path_m();
    if (!lost() || config.keep == config_.second_keep || !(config_.second_keep > 0.0)) break;
  }
  if (lost()) return PlanStatus::kLocalMinimum;
  if (last_end_ != RolloutEnd::kReached) return PlanStatus::kNoPath;
  flown_m = straighten_path(check, smooth_path(check, std::move(flown_m), config_.smoothings));
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

}  // namespace stairwell::planning3d
