#pragma once

#include "core/aabb.hpp"
#include "core/robot.hpp"
#include "core/scan.hpp"
#include "core/trajectory.hpp"
#include "core/units.hpp"
#include "coverage3d/strategy.hpp"
#include "mapping/occupancy_map.hpp"
#include "perception/cloud_pipeline.hpp"
#include "planning3d/planner.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stairwell::explore {

enum class Mode { kSlice, kVolume };
enum class MotionModel { kLimited, kStep };
/// kPriority: plans keep away from the fellows' commanded motions, first come, first served. kOrca: plans leave fellows
/// out; UAVs that come near avoid each other reciprocally, by positions and velocities alone.
enum class Avoidance { kPriority, kOrca };

/// What a UAV does when it has nothing left to explore, or its battery asks for it.
enum class ReturnTo { kHome, kLand, kStay };

/// A UAV that fails at a moment (tests of the fleet's behaviour): it stops, and is heard of no more.
struct Loss {
  std::size_t uav = 0;
  double at_s = 0.0;
};

/// A UAV that takes commands and does not move, for a while (tests of the fleet's behaviour). It still scans and is
/// heard of.
struct Stall {
  std::size_t uav = 0;
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();
};

/// Everything a fleet needs to know to explore; nothing about the world itself.
struct FleetConfig {
  Aabb task_box;  ///< what is to be explored; UAVs stay inside
  double resolution_m = 0.1;
  mapping::OccupancyParams occupancy;
  bool discretize = false;  ///< one ray per end voxel when integrating (OctoMap's discretize)
  SensorModel sensor;
  perception::CloudConfig cloud;
  MotionLimits limits;
  MotionModel motion = MotionModel::kLimited;
  double step_delta_m = 0.12;  ///< `step` motion: distance per step (SPEC A5)
  double step_period_s = 0.1;  ///< `step` motion: duration of a step (SPEC A7)
  Robot robot;
  Mode mode = Mode::kVolume;
  std::string planner = "astar";
  std::string fallback = "auto";  ///< planner when that one has no answer: a name, none, or auto (astar)
  Avoidance avoidance = Avoidance::kPriority;
  planning3d::PlannerOptions planner_options;
  /// A planner of one's own instead of `planner`; called once. Its answers pass the same safety check, and `fallback`
  /// is asked when it has none.
  std::function<std::unique_ptr<planning3d::Planner>()> own_planner;
  std::string coverage = "frontiers";
  bool turn_taking = true;  ///< UAVs plan knowing what the others are going to see; false: as if alone
  coverage3d::GainKind gain = coverage3d::GainKind::kVolume;
  std::string hybrid_first = "greedy";  ///< coverage `hybrid`: what decides before k-means does ...
  double hybrid_switch = 0.7;           ///< ... from when this share of the box is known
  /// A strategy of one's own instead of `coverage`; called once.
  std::function<std::unique_ptr<coverage3d::CoverageStrategy>(const coverage3d::CoverageConfig&)> own_coverage;
  std::vector<double> layers_m;                       ///< slice mode; empty = automatic
  std::optional<coverage3d::FinishSlab> finish_slab;  ///< nullopt: explored is all that can be seen
  ReturnTo return_to = ReturnTo::kLand;               ///< kLand: where it is; UAVs that started in the air stay there
  double battery_s = 0.0;                             ///< flying time until it has to be back; 0 = unlimited
  double lost_after_s = 5.0;                          ///< a UAV that is not heard of for so long gives its task back
  std::vector<Loss> losses;
  double stalled_after_s = 8.0;  ///< a UAV that gets on with its task no more for so long gives it back
  std::vector<Stall> stalls;
  double takeoff_height_m = 1.0;
  double start_bubble_m = 0.6;           ///< space around the start assumed free (a UAV can stand there)
  double radial_scan_radps = 0.5 * kPi;  ///< turning speed of the radial scan (SPEC B3: at most 0.4 for a slow mapper)
  bool radial_scan = true;               ///< after take-off, where sectors around the UAV are unknown
  double fellow_clearance_m = 0.6;       ///< least distance between UAV centres
  double time_limit_s = 1800.0;
  bool charge_planning = true;  ///< measured computing time passes in the simulation too
  double plan_latency_s = 0.1;  ///< least time between deciding and turning on to the new trajectory
  double replan_period_s = 1.5;
  double remainder_gain_m3 = 1.5;     ///< goals that promise less are remainders ...
  double patience_s = 20.0;           ///< ... and when for so long there were only remainders, and the map grew by less
  double min_growth = 0.003;          ///< than this part of itself, nothing useful is left; ...
  std::size_t fruitless_visits = 20;  ///< ... nor when so many goals (or 5 per UAV) in a row showed next to nothing
  double blacklist_radius_m = 0.6;
  double blacklist_time_s = 120.0;
  std::uint64_t seed = 1;
  /// That work on one run; what comes of it is the same with any number. With more than one, the sensors of different
  /// UAVs are asked at the same time.
  int threads = 1;

  /// Every reason why the configuration cannot be used; empty = usable.
  std::vector<std::string> problems() const;
};

}  // namespace stairwell::explore
