#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace stairwell::apps {

/// The size that a report of one run keeps below (frontiers, then plans are left out where it takes that).
inline constexpr std::size_t kMostReportBytes = 15'000'000;

/// Reads a run folder (docs/file_formats.md) and writes `report.html` in it: one file that needs nothing else, with a
/// replay, plots and tables.
/// @throws InputError naming the file that is missing or damaged; RunError when the report cannot be written.
void write_report(const std::filesystem::path& run_dir);

/// One page for one run, or for two of them side by side.
/// @pre one or two folders
void write_report(const std::vector<std::filesystem::path>& run_dirs, const std::filesystem::path& file);

}  // namespace stairwell::apps
