/// What the runs of a sweep say together: rows over the seeds, and differences between rows.
#pragma once

#include "apps/statistics.hpp"
#include "apps/sweep.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace stairwell::apps {

/// Numbers of one run by name; those of an object of metrics.json as `plan_ms.p50`. NaN for null.
using RunNumbers = std::map<std::string, double>;

struct ComparisonRow {
  std::string world, mode, planner, coverage;
  std::uint64_t uavs = 1;
  std::string variant;               ///< as of SweepRun
  std::vector<std::uint64_t> seeds;  ///< of the runs there are
  std::vector<RunNumbers> runs;
  std::vector<std::filesystem::path> folders;
  std::map<std::string, Estimate> estimates;
  std::size_t distinct = 0;  ///< runs that differ in when they finished or how far they flew
  std::string name() const;  ///< of the row, without seeds
  /// Coverage strategy and what is varied.
  std::string strategy() const { return coverage + (variant.empty() ? "" : " ") + variant; }
};

struct ComparisonDifference {
  std::size_t first, second;  ///< rows of the same world and number of UAVs
  std::string metric;
  std::size_t pairs = 0;
  PairedDifference found;
};

struct Comparison {
  std::vector<ComparisonRow> rows;
  std::vector<ComparisonDifference> differences;
  std::vector<std::string> missing;  ///< names of runs without results
};

/// Reads the finished runs. Besides what metrics.json holds: `finish_over_bound`, `t99_over_bound` where there is a
/// reference, and `energy_hover_s`. @throws InputError naming the file that is damaged
Comparison read_comparison(const std::vector<SweepRun>& runs);

/// Seconds of hovering that cost as much as the flight: thrust to the power of 3/2 over that of hovering (momentum
/// theory), all UAVs, while airborne. @param trajectories trajectories.csv of a run folder
double energy_hover_s(const std::filesystem::path& trajectories);

/// The names in `estimates` in the order in which tables show them.
std::vector<std::string> metric_names(const Comparison& comparison);

/// comparison.json, as docs/file_formats.md has it.
std::string comparison_json(const Comparison& comparison);
std::string comparison_csv(const Comparison& comparison);
/// One line per run.
std::string runs_csv(const Comparison& comparison);
std::string comparison_markdown(const Comparison& comparison);
std::string comparison_page(const Comparison& comparison);

/// Writes comparison.json, .csv, .md, .html and runs.csv.
void write_comparison(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace stairwell::apps
