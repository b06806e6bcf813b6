/// The plots and tables of a report, as HTML.
#pragma once

#include "apps/report_data.hpp"

#include <string>
#include <vector>

namespace stairwell::apps {

/// The numbers that tell how a run went, as cards.
std::string key_numbers(const ReportJson& metrics);
/// Coverage and known volume of all runs in one figure each.
std::string joint_plots(const std::vector<RunData>& runs);
/// What belongs to one run: known volume per UAV, paths, heights, speeds, distances, times, troubles.
std::string run_plots(const RunData& run);
/// One column per run.
std::string metrics_table(const std::vector<RunData>& runs);

}  // namespace stairwell::apps
