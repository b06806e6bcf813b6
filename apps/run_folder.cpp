#include "apps/run_folder.hpp"

#include "apps/checkpoint.hpp"
#include "core/errors.hpp"

#include <cstdio>
#include <fstream>

namespace stairwell::apps {

namespace fs = std::filesystem;

namespace {

bool occupied(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return false;
  if (!fs::is_directory(folder, error)) return true;
  const bool empty = fs::is_empty(folder, error);
  return !empty || error;
}

}  // namespace

fs::path choose_run_folder(const RunConfig& config) {
  if (!config.out.empty()) {
    fs::path folder = config.out;
    if (!occupied(folder)) return folder;
    const bool run = fs::exists(folder / "config.yaml");
    throw InputError("--out " + folder.string() + ": is not an empty folder: " +
                     (run ? "use --resume to go on with the run in it, or give another one" : "give another one"));
  }
  const std::string stem =
      config.world.stem().string() + "-" + to_string(config.fleet.mode) + "-" + std::to_string(config.fleet.seed);
  fs::path folder = fs::path("runs") / stem;
  for (int k = 2; occupied(folder); ++k) folder = fs::path("runs") / (stem + "-" + std::to_string(k));
  return folder;
}

void make_run_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw RunError(folder.string() + ": cannot be made: " + error.message());
}

void require_run_folder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) throw InputError("--resume " + folder.string() + ": no such folder");
  if (!fs::exists(folder / "config.yaml", ignored)) {
    throw InputError("--resume " + folder.string() + ": is not a run folder (it has no config.yaml)");
  }
}

bool is_complete(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / "metrics.json", ignored) && !CheckpointFolder(folder).exists();
}

std::vector<std::vector<Eigen::Vector3d>> read_trajectories(const fs::path& file, std::size_t uavs) {
  std::vector<std::vector<Eigen::Vector3d>> lines_m(uavs);
  std::ifstream stream(file);
  std::string row;
  std::getline(stream, row);  // header
  while (std::getline(stream, row)) {
    double time_s = 0.0;
    std::size_t uav = 0;
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    if (std::sscanf(row.c_str(), "%lf,%zu,%lf,%lf,%lf", &time_s, &uav, &p.x(), &p.y(), &p.z()) == 5 && uav < uavs) {
      lines_m[uav].push_back(p);
    }
  }
  return lines_m;
}

}  // namespace stairwell::apps
