#pragma once

#include "planning3d/planner.hpp"
#include "planning3d/safety_check.hpp"

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::planning3d {

/// What became of one planner's answer.
enum class AttemptOutcome {
  kUsed,
  kNoAnswer,   ///< its status says why
  kMalformed,  ///< claimed to be there with a path that is empty, not finite, or leads from or to elsewhere
  kUnsafe,     ///< its path does not pass the safety check
  kRefused,    ///< the caller could not use it
  kFailed      ///< it threw
};

/// What one planner answered.
struct PlanAttempt {
  std::string_view planner;
  AttemptOutcome outcome = AttemptOutcome::kNoAnswer;
  PlanStatus status = PlanStatus::kNoPath;
  Verdict verdict = Verdict::kSafe;  ///< kUnsafe only
  std::string note;                  ///< kRefused, kFailed: in the words of who said so

  std::string reason() const;  ///< as "local minimum" or "unsafe: occupied"
};

/// The answer, and who gave it.
struct FallbackResult {
  PlanResult plan;                    ///< kReached with a path that passed, or no path: then stop and hover
  std::vector<PlanAttempt> attempts;  ///< in the order they were asked; the last one was used unless `hover()`

  bool hover() const { return attempts.empty() || attempts.back().outcome != AttemptOutcome::kUsed; }
  bool fell_back() const { return !hover() && attempts.size() > 1; }
  std::string_view planner() const { return hover() ? std::string_view{} : attempts.back().planner; }
  /// Why the planners before the one that was used were not, as "apf: local minimum"; empty if the first was.
  std::string reason() const;
};

/// What the caller makes of an answer that passed the safety check.
struct PlanVerdict {
  enum class Kind {
    kUse,
    kTryNext,
    kStop  ///< hover: no other planner's answer would do either
  };
  Kind kind = Kind::kUse;
  std::string note;
};

/// The first answer that passes the safety check: the primary's, else that of the next planner, and so on; when there
/// is none, the UAV is to stop and hover. No planner's word is taken for anything.
class FallbackPlanner final : public Planner {
 public:
  /// Called with paths that are safe; whether a motion can be made of them is for the caller to find out.
  using Judge = std::function<PlanVerdict(const PlanResult& plan, std::string_view planner)>;

  /// @pre primary is not null
  explicit FallbackPlanner(std::unique_ptr<Planner> primary, std::vector<std::unique_ptr<Planner>> fallbacks = {},
                           const SafetyCheck& check = {});

  /// The primary's.
  std::string_view name() const override { return planners_.front()->name(); }
  /// The plan alone. When nobody has one, the primary's status; a path that did not pass counts as kNoPath.
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;
  FallbackResult decide(const FreeSpace& space, const PlanRequest& request, const Judge& judge = {});

 private:
  PlanAttempt attempt(Planner& planner, const FreeSpace& space, const PlanRequest& request, PlanResult& plan) const;

  std::vector<std::unique_ptr<Planner>> planners_;
  SafetyCheck check_;
};

/// The planner that answers when `primary` does not: `fallback` itself, none for "none" or where it is the primary,
/// and for "auto" astar unless that is the primary. Empty = none. @throws InputError for unknown names.
std::string_view resolve_fallback(std::string_view fallback, std::string_view primary);

}  // namespace stairwell::planning3d
