#pragma once

#include "core/doors.hpp"
#include "explore/exploration_log.hpp"
#include "explore/fleet_config.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::explore {

enum class StopReason { kRunning, kTargetReached, kNothingReachableLeft, kTimeLimit, kInterrupted, kBattery, kAllLost };
/// `running`, `target reached`, `nothing reachable left`, `time limit`, `interrupted`,
/// `battery limit`, `all UAVs lost`.
const char* to_string(StopReason reason);

/// Doors of one UAV; owned by the caller, outlive the fleet.
struct UavDoors {
  DepthSource* sensor = nullptr;
  Vehicle* vehicle = nullptr;
};

/// Cost and trouble so far.
struct FleetStats {
  std::vector<double> plan_ms;                          ///< one per decision of a UAV (goal, path, trajectory, checks)
  std::vector<double> integrate_ms;                     ///< one per scan (filter and map)
  std::size_t fallbacks = 0;                            ///< plans answered by another planner than the one asked for
  std::map<std::string, std::size_t> fallback_reasons;  ///< as "apf: local minimum"
  std::size_t emergency_stops = 0;
  std::size_t open_targets = 0;  ///< left by the coverage strategy when last asked
  std::size_t unreachable_targets = 0;
  std::size_t map_exchanges = 0;   ///< times that two groups with maps of their own came into touch
  std::size_t out_of_battery = 0;  ///< UAVs that went back for that reason before all was explored
  std::size_t lost = 0;
  std::size_t stalls = 0;       ///< times that a UAV gave its task back because it made no progress
  std::size_t stalled = 0;      ///< UAVs that have made none since
  std::size_t voxels_told = 0;  ///< known voxels in the blocks exchanged then
};

/// The fleet's loop in simulated time: every tick all UAVs move, sense, map and decide (state machine of SPEC B3:
/// take-off, radial scan, find goal, travel, land). UAVs in touch with each other share a map; poses, tasks and
/// commanded motions are known to all. Repeatable for a seed when planning time is not charged.
class Fleet {
 public:
  /// @param clock_s monotonic seconds, to measure planning time; pass `[]{ return 0.0; }` for repeatable runs.
  /// @param radio who can exchange maps at a moment; null: all, always. Outlives the fleet.
  /// @throws InputError when the configuration has problems.
  Fleet(const FleetConfig& config, std::vector<UavDoors> uavs, ExplorationLog& log, std::function<double()> clock_s,
        const Radio* radio = nullptr);
  ~Fleet();

  /// One tick of 1/sensor rate seconds. @returns false when the run is over: see stop_reason().
  bool step();
  /// Ends the run: step() returns false from now on.
  void stop(StopReason reason);

  double time_s() const;
  /// When the last UAV had finished exploring (landing comes after it); the present time before that.
  double exploration_end_s() const;
  /// False once the UAVs only go home or land.
  bool exploring() const;
  double tick_s() const;
  StopReason stop_reason() const;
  std::size_t size() const;
  MotionState uav_state(std::size_t uav) const;
  /// Short name of the state machine's state.
  const char* uav_phase(std::size_t uav) const;
  /// One map per group of UAVs in touch: `map(0)` is everybody's where no radio limits the exchange. References hold
  /// until the next step.
  std::size_t map_count() const;
  const mapping::OccupancyMap& map(std::size_t i = 0) const;
  /// Of map(i): another one for every map that there ever was in the run, so that changes can be followed.
  std::uint64_t map_id(std::size_t i) const;
  const mapping::OccupancyMap& map_of(std::size_t uav) const;
  /// No radio limits the exchange.
  bool shares_one_map() const;
  const FleetStats& stats() const;
  /// Idle between steps; null for a fleet of one thread.
  mapping::WorkerPool* workers() const;
  /// Layers in use at present (slice mode), else empty.
  std::vector<double> layers_m() const;

  /// Everything a resumed run needs except the maps (save map(0), map(1), .. as .ot) and the simulator's own state.
  std::string save_state() const;
  /// @param maps what was saved beside the state, in this order. The vehicles resume their saved trajectories.
  /// @throws InputError when the state is damaged or for another fleet size.
  void load_state(const std::string& state, std::vector<mapping::OccupancyMap> maps);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stairwell::explore
