#include "planning3d/fallback_planner.hpp"

#include "core/errors.hpp"
#include "planning3d/plan_ends.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace stairwell::planning3d {

namespace {

constexpr double kStart_m = 1e-6;

bool well_formed(const FreeSpace& space, const PlanRequest& request, const std::vector<Eigen::Vector3d>& path_m) {
  if (path_m.size() < 2) return false;
  if (!std::all_of(path_m.begin(), path_m.end(), [](const Eigen::Vector3d& p_m) { return p_m.allFinite(); })) {
    return false;
  }
  // Planners lead a goal that is off traversable space to the nearest of it; the voxel's centre may be off as well.
  const double reach_m = kSnap_m + space.grid().resolution_m();
  return (path_m.front() - request.start_m).norm() <= kStart_m && (path_m.back() - request.goal_m).norm() <= reach_m;
}

}  // namespace

std::string PlanAttempt::reason() const {
  switch (outcome) {
    case AttemptOutcome::kUsed:
      return "used";
    case AttemptOutcome::kNoAnswer:
      return to_string(status);
    case AttemptOutcome::kMalformed:
      return "malformed path";
    case AttemptOutcome::kUnsafe:
      return std::string("unsafe: ") + to_string(verdict);
    case AttemptOutcome::kRefused:
      return "refused: " + note;
    case AttemptOutcome::kFailed:
      return "failed: " + note;
  }
  return "?";
}

std::string FallbackResult::reason() const {
  std::string text;
  for (const PlanAttempt& attempt : attempts) {
    if (attempt.outcome == AttemptOutcome::kUsed) break;
    if (!text.empty()) text += ", ";
    text.append(attempt.planner).append(": ").append(attempt.reason());
  }
  return text;
}

FallbackPlanner::FallbackPlanner(std::unique_ptr<Planner> primary, std::vector<std::unique_ptr<Planner>> fallbacks,
                                 const SafetyCheck& check)
    : check_(check) {
  planners_.push_back(std::move(primary));
  for (auto& fallback : fallbacks) planners_.push_back(std::move(fallback));
}

PlanAttempt FallbackPlanner::attempt(Planner& planner, const FreeSpace& space, const PlanRequest& request,
                                     PlanResult& plan) const {
  PlanAttempt made;
  made.planner = planner.name();
  try {
    plan = planner.plan(space, request);
  } catch (const std::exception& error) {
    made.outcome = AttemptOutcome::kFailed;
    made.note = error.what();
    return made;
  }
  made.status = plan.status;
  if (plan.status != PlanStatus::kReached) return made;
  if (!well_formed(space, request, plan.path_m)) {
    made.outcome = AttemptOutcome::kMalformed;
    return made;
  }
  made.verdict = check_.check_path(space, plan.path_m).verdict;
  made.outcome = made.verdict == Verdict::kSafe ? AttemptOutcome::kUsed : AttemptOutcome::kUnsafe;
  return made;
}

FallbackResult FallbackPlanner::decide(const FreeSpace& space, const PlanRequest& request, const Judge& judge) {
  FallbackResult result;
  for (const auto& planner : planners_) {
    PlanResult plan;
    PlanAttempt made = attempt(*planner, space, request, plan);
    bool stop = false;
    if (made.outcome == AttemptOutcome::kUsed && judge) {
      PlanVerdict verdict = judge(plan, planner->name());
      stop = verdict.kind == PlanVerdict::Kind::kStop;
      if (verdict.kind != PlanVerdict::Kind::kUse) {
        made.outcome = AttemptOutcome::kRefused;
        made.note = std::move(verdict.note);
      }
    }
    result.attempts.push_back(std::move(made));
    if (!result.hover()) {
      result.plan = std::move(plan);
      return result;
    }
    if (stop) break;
  }
  const PlanAttempt& first = result.attempts.front();
  result.plan.status = first.outcome == AttemptOutcome::kNoAnswer ? first.status : PlanStatus::kNoPath;
  return result;
}

PlanResult FallbackPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  return decide(space, request).plan;
}

std::string_view resolve_fallback(std::string_view fallback, std::string_view primary) {
  if (fallback == "none") return {};
  const std::string_view chosen = fallback == "auto" ? std::string_view("astar") : fallback;
  const auto known = planner_names();
  const auto found = std::find(known.begin(), known.end(), chosen);
  if (found == known.end()) {
    std::string message("unknown fallback '");
    message.append(fallback).append("'; known: auto none");
    for (const std::string_view name : known) message.append(" ").append(name);
    throw InputError(message);
  }
  return chosen == primary ? std::string_view{} : *found;
}

}  // namespace stairwell::planning3d
