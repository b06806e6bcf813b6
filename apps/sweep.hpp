/// Many runs of `stairwell explore`, each a process and a run folder of its own.
#pragma once

#include "apps/progress.hpp"
#include "apps/settings.hpp"

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::apps {

/// A setting and the values that it is to have.
struct VariedSetting {
  std::string key;
  std::vector<std::string> values;
};

struct SweepConfig {
  std::vector<std::string> worlds;
  std::vector<std::string> modes, planners, coverages;  ///< empty: what the base settings say
  std::vector<std::uint64_t> uavs, seeds;
  std::vector<VariedSetting> varied;  ///< every combination is run
  Settings base;                      ///< everything else
  std::size_t jobs = 1;
  bool bound = true;
  std::filesystem::path out;
  std::filesystem::path program;  ///< stairwell itself
};

struct SweepRun {
  std::string world, mode, planner, coverage;
  std::uint64_t uavs = 1, seed = 1;
  std::string variant;           ///< `key=value key=value`, of what is varied; may be empty
  std::string name;              ///< `<world>-<mode>-<planner>-<coverage>-[<key=value>-..]<uavs>-<seed>`
  std::filesystem::path folder;  ///< run folder
  std::filesystem::path bound;   ///< file with the reference of its world and number of UAVs; empty: none
};

/// Every run of the sweep, seeds outermost, so that a sweep cut short is an even one.
/// @throws InputError for lists without values, values that no run can have, missing and equally named worlds
std::vector<SweepRun> plan_sweep(const SweepConfig& config);

struct SweepResult {
  std::vector<std::string> failed;  ///< names and reasons; the sweep went on
  bool interrupted = false;
};

/// Does what is not done yet; what a killed sweep left half done is done again.
/// @throws InputError when the folder holds runs with other settings; RunError when it cannot be written
SweepResult run_sweep(const SweepConfig& config, const std::vector<SweepRun>& runs, Progress::Style progress,
                      const volatile std::sig_atomic_t& interrupted);

/// `1,2,4`, `1..10` and mixtures. @throws InputError quoting the text
std::vector<std::uint64_t> parse_counts(std::string_view text);
/// `key=a,b`. @throws InputError quoting the text, or naming an unknown key
VariedSetting parse_varied(std::string_view text);
/// `a,b`; every part has to be there. @throws InputError quoting the text
std::vector<std::string> parse_words(std::string_view text);

}  // namespace stairwell::apps
