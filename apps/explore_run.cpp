#include "apps/explore_run.hpp"

#include "apps/atomic_file.hpp"
#include "apps/checkpoint.hpp"
#include "apps/fleet_map.hpp"
#include "apps/map_files.hpp"
#include "apps/metrics.hpp"
#include "apps/render.hpp"
#include "apps/report.hpp"
#include "apps/run_config.hpp"
#include "apps/run_folder.hpp"
#include "apps/run_log.hpp"
#include "apps/simulation.hpp"
#include "core/errors.hpp"
#include "core/version.hpp"
#include "mapping/octomap_io.hpp"

#include <nlohmann/json.hpp>

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>

namespace stairwell::apps {

namespace fs = std::filesystem;
using explore::StopReason;

namespace {

/// A checkpoint may take at most this share of the wall time.
constexpr double kCheckpointShare = 0.01;

double clock_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Computing time of this thread: other programs on the machine do not make the UAVs think longer.
double computing_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

bool near_ground(const std::string_view phase) {
  return phase == "grounded" || phase == "takeoff" || phase == "land" || phase == "done";
}

constexpr std::size_t kLargeVoxels = 20'000'000;  // above it, half a minute and more

/// Of what the fleet can see from where it can get to. @throws InputError when that is nothing
CoverageMeter coverage_meter(const Simulation& simulation, Progress& progress) {
  if (simulation.truth().grid().voxel_count() > kLargeVoxels) {
    progress.note("measuring what can be explored of a large world: this takes a while");
  }
  CoverageMeter meter(simulation.truth().grid(), simulation.explorable(simulation.reachable()));
  if (meter.explorable_count() == 0) {
    throw InputError("--box holds no free space that the robot can reach from its starts: move or enlarge it");
  }
  return meter;
}

/// One run from its first (or resumed) tick to its finished folder.
class ExploreRun {
 public:
  ExploreRun(const Simulation& simulation, CoverageMeter coverage, fs::path folder, Progress& progress)
      : simulation_(simulation),
        config_(simulation.config()),
        folder_(std::move(folder)),
        progress_(progress),
        checkpoints_(folder_),
        explorable_(std::move(coverage)),
        coverage_(explorable_),
        flight_(simulation.truth(), config_.fleet.robot.radius_m, config_.uavs),
        finish_(simulation.truth().grid(), config_.fleet) {}

  void begin() {
    log_.emplace(folder_, config_.fleet, simulation_.truth().grid(), config_.uavs);
    make_fleet();
    observe();
  }

  void resume(Simulation& simulation) {
    std::vector<mapping::OccupancyMap> maps;
    const Checkpoint saved =
        checkpoints_.load(mapping::OccupancyMap(simulation_.truth().grid(), config_.fleet.occupancy), maps);
    log_.emplace(folder_, config_.fleet, simulation_.truth().grid(), config_.uavs, saved.log_bytes);
    make_fleet();
    fleet_->load_state(saved.fleet, std::move(maps));
    log_->resume(*fleet_);
    simulation.set_scans_taken(saved.scans_taken);
    try {
      flight_.load(nlohmann::json::parse(saved.flight));
      milestones_.load(nlohmann::json::parse(saved.milestones));
      finish_.load(nlohmann::json::parse(saved.finish));
    } catch (const nlohmann::json::exception& error) {
      throw InputError(folder_.string() + ": the checkpoint is damaged: " + error.what());
    }
    earlier_wall_s_ = saved.wall_s;
    coverage_.update(map_.update(*fleet_));
  }

  void loop(const volatile std::sig_atomic_t& interrupted) {
    begin_s_ = clock_s();
    double next_checkpoint_s = begin_s_ + config_.checkpoint_period_s;
    for (bool going = true; going;) {
      if (interrupted != 0) {
        fleet_->stop(StopReason::kInterrupted);
        break;
      }
      going = fleet_->step();
      observe();
      if (going && config_.target_coverage < 1.0 && coverage_.coverage() >= config_.target_coverage) {
        fleet_->stop(StopReason::kTargetReached);
        going = false;
      }
      progress_.show({coverage_.coverage(), fleet_->time_s(), wall_s()});
      if (going && clock_s() >= next_checkpoint_s) next_checkpoint_s = checkpoint_and_time();
    }
    total_wall_s_ = wall_s();
    progress_.finish();
  }

  /// Writes everything a finished (or interrupted) run leaves. @returns the text of metrics.json.
  std::string finish() {
    const bool interrupted = fleet_->stop_reason() == StopReason::kInterrupted;
    if (interrupted) save_checkpoint();
    const mapping::OccupancyMap& map = map_.update(*fleet_);
    log_->publish(map, [this](const VoxelIndex& v) { return expected_occupancy(simulation_.truth(), v); });
    mapping::save_octomap(map, folder_ / "map.bt");
    mapping::save_octomap(map, folder_ / "map.ot");
    std::string metrics = metrics_json(run_figures(map));
    write_file_atomically(folder_ / "metrics.json", metrics);
    RenderOptions options;
    options.trajectories_m = read_trajectories(folder_ / "trajectories.csv", config_.uavs);
    render_map_png(map, options, folder_ / "snapshot.png");
    write_report(folder_);
    if (!interrupted) checkpoints_.remove();
    return metrics;
  }

  bool interrupted() const { return fleet_->stop_reason() == StopReason::kInterrupted; }

 private:
  void make_fleet() {
    fleet_ =
        std::make_unique<explore::Fleet>(config_.fleet, simulation_.doors(), *log_, computing_s, simulation_.radio());
    if (fleet_->map().grid() != simulation_.truth().grid()) throw RunError("the fleet's map has an unexpected grid");
  }

  void observe() {
    std::vector<MotionState> states;
    std::vector<bool> grounded;
    for (std::size_t i = 0; i < fleet_->size(); ++i) {
      states.push_back(fleet_->uav_state(i));
      grounded.push_back(near_ground(fleet_->uav_phase(i)));
    }
    const mapping::OccupancyMap& map = map_.update(*fleet_);
    coverage_.update(map);
    flight_.observe(fleet_->time_s(), states, grounded);
    for (const FlightMeter::Contact& contact : flight_.take_contacts()) {
      log_->on_event(fleet_->time_s(), contact.uav, "collision", contact.with);
    }
    milestones_.observe(fleet_->time_s(), coverage_.coverage());
    finish_.observe(fleet_->time_s(), map, states, fleet_->exploring());
    log_->record(*fleet_, coverage_.coverage(), map.known_volume_m3());
  }

  void save_checkpoint() {
    Checkpoint checkpoint;
    checkpoint.fleet = fleet_->save_state();
    checkpoint.flight = flight_.save().dump();
    checkpoint.milestones = milestones_.save().dump();
    checkpoint.finish = finish_.save().dump();
    checkpoint.wall_s = wall_s();
    checkpoint.scans_taken = simulation_.scans_taken();
    checkpoint.log_bytes = log_->flush();
    std::vector<const mapping::OccupancyMap*> maps;
    for (std::size_t i = 0; i < fleet_->map_count(); ++i) maps.push_back(&fleet_->map(i));
    checkpoints_.save(checkpoint, maps);
  }

  RunFigures run_figures(const mapping::OccupancyMap& map) const {
    RunFigures figures{config_, *fleet_, coverage_, flight_, milestones_, finish_};
    figures.known_volume_m3 = map.known_volume_m3();
    figures.wall_s = total_wall_s_;
    for (std::size_t i = 0; i < fleet_->size() && !fleet_->shares_one_map(); ++i) {
      CoverageMeter own = explorable_;
      own.update(fleet_->map_of(i));
      figures.coverage_per_uav.push_back(own.coverage());
    }
    return figures;
  }

  /// @returns when the next one is due
  double checkpoint_and_time() {
    const double before_s = clock_s();
    save_checkpoint();
    const double after_s = clock_s();
    return after_s + std::max(config_.checkpoint_period_s, (after_s - before_s) / kCheckpointShare);
  }

  double wall_s() const { return earlier_wall_s_ + (clock_s() - begin_s_); }

  const Simulation& simulation_;
  const RunConfig& config_;
  fs::path folder_;
  Progress& progress_;
  CheckpointFolder checkpoints_;
  CoverageMeter explorable_;  ///< nothing of it known
  CoverageMeter coverage_;
  FleetMap map_;
  FlightMeter flight_;
  Milestones milestones_;
  FinishMeter finish_;
  std::optional<RunLog> log_;
  std::unique_ptr<explore::Fleet> fleet_;
  double begin_s_ = 0.0;
  double earlier_wall_s_ = 0.0;
  double total_wall_s_ = 0.0;
};

ExploreResult run_in(Simulation& simulation, CoverageMeter coverage, const fs::path& folder, Progress& progress,
                     const volatile std::sig_atomic_t& interrupted) {
  ExploreRun run(simulation, std::move(coverage), folder, progress);
  if (CheckpointFolder(folder).exists()) {
    run.resume(simulation);
  } else {
    run.begin();
  }
  run.loop(interrupted);
  ExploreResult result;
  result.folder = folder;
  result.metrics = run.finish();
  result.interrupted = run.interrupted();
  return result;
}

ExploreResult run_new(Settings settings, Progress& progress, const volatile std::sig_atomic_t& interrupted,
                      const std::string& out) {
  RunConfig config = resolve(settings);
  config.out = out;
  require_usable(config);
  const fs::path folder = choose_run_folder(config);
  Simulation simulation(config);
  record_resolved(simulation.config(), settings);
  CoverageMeter coverage = coverage_meter(simulation, progress);  // the last of the input's checks
  make_run_folder(folder);
  const std::string heading = std::string("Stairwell ") + kVersion + ": resolved configuration of this run";
  write_file_atomically(folder / "config.yaml", to_yaml(settings, heading));
  progress.note("exploring " + simulation.config().world.string() + " into " + folder.string());
  return run_in(simulation, std::move(coverage), folder, progress, interrupted);
}

ExploreResult run_resumed(const fs::path& folder, Progress& progress, const volatile std::sig_atomic_t& interrupted) {
  require_run_folder(folder);
  if (is_complete(folder)) {
    ExploreResult result;
    result.folder = folder;
    result.metrics = read_text(folder / "metrics.json");
    result.was_complete = true;
    return result;
  }
  Settings settings;
  add_yaml_file(settings, folder / "config.yaml");
  const RunConfig config = resolve(settings);
  require_usable(config);
  Simulation simulation(config);
  progress.note("resuming " + folder.string());
  return run_in(simulation, coverage_meter(simulation, progress), folder, progress, interrupted);
}

}  // namespace

ExploreResult run_explore(const ExploreRequest& request, const volatile std::sig_atomic_t& interrupted) {
  Progress progress(request.progress);
  return request.resume.empty() ? run_new(request.settings, progress, interrupted, request.out)
                                : run_resumed(request.resume, progress, interrupted);
}

namespace {

/// `: 12 targets nobody can see, 1 UAV lost`; empty where there is nothing to say.
std::string left_text(const nlohmann::json& metrics) {
  std::string text;
  const auto tell = [&](const char* key, const char* what) {
    const auto count = metrics.contains("left") ? metrics["left"].value(key, 0) : 0;
    if (count > 0) text += (text.empty() ? " (" : ", ") + std::to_string(count) + " " + what;
  };
  tell("open_targets", "targets left");
  tell("unreachable_targets", "out of reach or sight");
  tell("uavs_out_of_battery", "UAVs out of battery");
  tell("uavs_lost", "UAVs lost");
  tell("uavs_stalled", "UAVs stalled");
  return text.empty() ? text : text + ")";
}

}  // namespace

std::string summary_text(const ExploreResult& result) {
  const auto metrics = nlohmann::json::parse(result.metrics, nullptr, false);
  if (metrics.is_discarded()) throw RunError((result.folder / "metrics.json").string() + ": is damaged");
  const auto value = [&](const char* key) {
    return metrics.contains(key) && metrics[key].is_number() ? metrics[key].get<double>() : 0.0;
  };
  char numbers[512];
  std::snprintf(numbers, sizeof(numbers),
                "coverage      %.2f %% of %.1f m3 explorable\n"
                "finished at   %.1f s simulated, %.1f s wall (x%.1f)\n"
                "path          %.1f m, %.0f collisions\n",
                100.0 * value("coverage"), value("explorable_volume_m3"), value("finish_s"), value("wall_s"),
                value("realtime_factor"), value("path_length_m"), value("collisions"));
  return "stopped       " + metrics.value("stop_reason", std::string("unknown")) + left_text(metrics) + "\n" + numbers +
         "run folder    " + result.folder.string() + "\n";
}

}  // namespace stairwell::apps
