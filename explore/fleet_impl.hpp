/// The inside of Fleet, shared by the loop (fleet.cpp), its decisions (fleet_decide.cpp) and its state file
/// (fleet_state.cpp).
#pragma once

#include "coverage3d/strategy.hpp"
#include "explore/avoider.hpp"
#include "explore/fleet.hpp"
#include "explore/pilot.hpp"
#include "explore/uav.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_words.hpp"
#include "mapping/scan_integrator.hpp"
#include "perception/cloud_pipeline.hpp"
#include "planning3d/free_space.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace stairwell::explore {

struct AssumedFree {
  Eigen::Vector3d center_m;
  double radius_m;
};

struct Fleet::Impl {
  Impl(const FleetConfig& fleet_config, std::vector<UavDoors> doors, ExplorationLog& exploration_log,
       std::function<double()> clock);

  // fleet.cpp: the tick
  bool step();
  void sense();
  void sense_one(Uav& uav);
  void assume_start_free(const Uav& uav);
  planning3d::FreeSpace space() const { return {map, blocked, config.robot, config.task_box, &blocked_words}; }
  std::vector<const Uav*> fellows_of(const Uav& uav) const;
  void enter(Uav& uav, Phase phase);
  bool command(Uav& uav, const Trajectory& trajectory);

  // fleet_decide.cpp: the state machine
  void decide();
  void guard(Uav& uav);
  void advance_phase(Uav& uav);
  void take_off(Uav& uav);
  void scan_around_or_find_goal(Uav& uav);
  bool wants_goal(const Uav& uav);
  void arrive(Uav& uav);
  void assign_goals(const std::vector<std::size_t>& wanting);
  void fly(Uav& uav, const coverage3d::Goal& goal, double assign_s);
  void no_goal(Uav& uav);
  void make_way(const Uav& blocked_uav, const std::vector<Eigen::Vector3d>& wanted_path_m);
  double depart_time(const Uav& uav) const;
  void charge(Uav& uav, double computing_s);
  bool worth_going_on();
  void finish_if_nothing_left();
  void land_all();

  // fleet_avoid.cpp: local avoidance
  void avoid();
  void begin_avoiding(Uav& uav);
  void avoid_fellows(Uav& uav, const std::vector<planning3d::SeenUav>& fellows);
  void stop_avoiding(Uav& uav);

  FleetConfig config;
  ExplorationLog& log;
  std::function<double()> clock_s;
  std::vector<Uav> uavs;
  mapping::OccupancyMap map;
  mapping::DistanceField blocked;
  mapping::OccupancyWords blocked_words;
  mapping::ScanIntegrator integrator;
  perception::CloudPipeline pipeline;
  std::unique_ptr<coverage3d::CoverageStrategy> strategy;
  Pilot pilot;
  Avoider avoider;
  FleetStats stats;
  std::vector<AssumedFree> assumed;
  std::size_t ticks = 0;
  double tick_s = 0.1;
  double idle_since_s = -1.0;  ///< nobody has anything to do since then; negative = somebody has
  double exploration_end_s = -1.0;
  double yield_since_s = 0.0;    ///< last time that exploring was clearly worth it
  std::size_t yield_voxels = 0;  ///< known voxels then
  bool winding_down = false;     ///< no more goals are given
  StopReason reason = StopReason::kRunning;

  double now_s() const { return static_cast<double>(ticks) * tick_s; }
};

}  // namespace stairwell::explore
