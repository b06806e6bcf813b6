#pragma once

#include "apps/run_config.hpp"

#include <filesystem>
#include <vector>

namespace stairwell::apps {

/// Where a new run goes: `config.out`, or the first free `runs/<world>-<mode>-<seed>[-k]`. Nothing is made yet.
/// @throws InputError when the folder holds something already.
std::filesystem::path choose_run_folder(const RunConfig& config);

/// @throws RunError naming the folder.
void make_run_folder(const std::filesystem::path& folder);

/// @throws InputError when this is not a run folder.
void require_run_folder(const std::filesystem::path& folder);

/// Nothing is left to do in this run folder.
bool is_complete(const std::filesystem::path& folder);

/// Polylines per UAV from trajectories.csv.
std::vector<std::vector<Eigen::Vector3d>> read_trajectories(const std::filesystem::path& file, std::size_t uavs);

}  // namespace stairwell::apps
