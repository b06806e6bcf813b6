#pragma once

#include "apps/progress.hpp"
#include "apps/settings.hpp"
#include "explore/fleet.hpp"

#include <csignal>
#include <filesystem>
#include <string>

namespace stairwell::apps {

struct ExploreRequest {
  Settings settings;             ///< of a new run
  std::string out;               ///< run folder of a new run; empty: runs/<world>-<mode>-<seed>[-k]
  std::filesystem::path resume;  ///< run folder to go on with; empty: a new run
  Progress::Style progress = Progress::Style::kQuiet;
};

struct ExploreResult {
  std::filesystem::path folder;
  std::string metrics;        ///< text of metrics.json
  bool interrupted = false;   ///< saved; can be resumed
  bool was_complete = false;  ///< nothing was left to resume
};

/// Runs (or resumes) one exploration into its run folder.
/// @param interrupted set from a signal handler: the run is saved and ends after the present tick
/// @throws InputError, RunError
ExploreResult run_explore(const ExploreRequest& request, const volatile std::sig_atomic_t& interrupted);

/// A few lines for people, made from metrics.json.
std::string summary_text(const ExploreResult& result);

}  // namespace stairwell::apps
