/// What a report is made of: the files of a run folder, read and packed for the page.
#pragma once

#include "apps/csv_table.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::apps {

using ReportJson = nlohmann::ordered_json;

/// A run folder in memory.
struct RunData {
  std::string name;  ///< of the folder
  ReportJson metrics;
  std::string config;
  CsvTable steps;
  CsvTable trajectories;
  CsvTable timings;
  std::vector<ReportJson> log;
  std::string snapshot;  ///< PNG
  std::string replay;    ///< records of replay.bin
};

/// @throws InputError naming the file (and line) that is missing or damaged.
RunData read_run(const std::filesystem::path& run_dir);

/// One `<script type="text/plain">` with everything the viewer shows, compressed and with its checksum. When that would
/// be more than `most_bytes`, frontiers are left out, then plans; the page says so.
std::string packed_run(const RunData& run, std::size_t most_bytes);

}  // namespace stairwell::apps
