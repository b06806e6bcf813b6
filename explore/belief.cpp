#include "explore/belief.hpp"

#include "core/errors.hpp"
#include "mapping/map_merge.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <utility>

namespace stairwell::explore {

namespace {

// The map reaches a little beyond the task box, so that surfaces lying on the box's faces are mapped as well.
constexpr double kMapMargin_m = 0.3;
constexpr double kTrackStep_m = 0.5;

GridSpec map_grid(const FleetConfig& config) { return {config.task_box.inflated(kMapMargin_m), config.resolution_m}; }

double field_truncation_m(const FleetConfig& config) {
  return std::max(1.0, config.robot.clearance_m() + 4.0 * config.resolution_m);
}

coverage3d::CoverageConfig coverage_config(const FleetConfig& config) {
  coverage3d::CoverageConfig coverage;
  coverage.sensor = config.sensor;
  coverage.limits = config.limits;
  coverage.robot = config.robot;
  coverage.box = config.task_box;
  coverage.layers_m = config.layers_m;
  coverage.gain = config.gain;
  coverage.turn_taking = config.turn_taking;
  coverage.occupancy = config.occupancy;
  coverage.slice = config.mode == Mode::kSlice;
  coverage.blacklist_radius_m = config.blacklist_radius_m;
  coverage.blacklist_time_s = config.blacklist_time_s;
  coverage.finish = config.finish_slab;
  coverage.hybrid_first = config.hybrid_first;
  coverage.hybrid_switch = config.hybrid_switch;
  coverage.models_dir = config.planner_options.models_dir;
  coverage.seed = config.seed;
  return coverage;
}

std::unique_ptr<coverage3d::CoverageStrategy> make_coverage(const FleetConfig& config) {
  auto strategy = config.own_coverage ? config.own_coverage(coverage_config(config))
                                      : coverage3d::make_strategy(config.coverage, coverage_config(config));
  if (strategy == nullptr) throw InputError("own_coverage made no strategy");
  return strategy;
}

}  // namespace

Belief::Belief(const FleetConfig& fleet_config, std::uint64_t belief_id)
    : config(&fleet_config),
      id(belief_id),
      map(map_grid(fleet_config), fleet_config.occupancy),
      blocked(map.grid(), field_truncation_m(fleet_config), mapping::Obstacles::kBlocked),
      blocked_words(map.grid(), mapping::Obstacles::kBlocked),
      strategy(make_coverage(fleet_config)) {}

std::unique_ptr<Belief> Belief::clone(std::uint64_t belief_id) const {
  auto copy = std::make_unique<Belief>(*config, belief_id);
  copy->map = map.clone();
  copy->blocked = blocked;
  copy->blocked_words = blocked_words;
  if (auto twin = strategy->clone()) {
    copy->strategy = std::move(twin);
  } else {
    copy->strategy->load_state(strategy->save_state());
  }
  copy->known_by = known_by;
  copy->passed = passed;
  copy->yield_since_s = yield_since_s;
  copy->yield_voxels = yield_voxels;
  copy->fruitless = fruitless;
  copy->fruitless_voxels = fruitless_voxels;
  copy->winding_down = winding_down;
  return copy;
}

std::size_t Belief::absorb(const Belief& other) {
  std::uint64_t told = 0;
  for (const std::size_t uav : members) {
    const auto known = other.known_by.find(uav);
    if (known != other.known_by.end()) told = std::max(told, known->second);
  }
  for (const std::size_t uav : other.members) {
    known_by.erase(uav);
    passed.erase(uav);
  }
  winding_down = winding_down && other.winding_down;
  return mapping::merge_changes(other.map, told, map).sent;
}

void Belief::update(mapping::WorkerPool* workers) {
  mapping::for_each_index(workers, 2, [this](std::size_t i) {
    if (i == 0) {
      blocked.read_changes(map);
    } else {
      blocked_words.update(map);
    }
  });
  blocked.recompute_changed(workers);
}

bool Belief::has(std::size_t uav) const { return std::ranges::binary_search(members, uav); }

void Belief::note_absent(std::size_t uav, const Eigen::Vector3d& at_m) {
  std::vector<Eigen::Vector3d>& track = passed[uav];
  if (track.empty() || (track.back() - at_m).norm() >= kTrackStep_m) track.push_back(at_m);
}

std::vector<Eigen::Vector3d> Belief::passed_m() const {
  std::vector<Eigen::Vector3d> all;
  for (const auto& [uav, track] : passed) all.insert(all.end(), track.begin(), track.end());
  return all;
}

}  // namespace stairwell::explore
