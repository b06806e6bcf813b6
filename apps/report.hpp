#pragma once

#include <filesystem>

namespace stairwell::apps {

/// Reads `metrics.json`, `config.yaml`, `steps.csv`, `trajectories.csv` and `snapshot.png` of a run folder and writes
/// `report.html` beside them: one file that needs nothing else.
/// @throws InputError naming the file that is missing or damaged; RunError when the report cannot be written.
void write_report(const std::filesystem::path& run_dir);

}  // namespace stairwell::apps
