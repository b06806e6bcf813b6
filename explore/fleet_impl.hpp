/// The inside of Fleet, shared by the loop (fleet.cpp), its decisions (fleet_decide.cpp) and its state file
/// (fleet_state.cpp).
#pragma once

#include "explore/avoider.hpp"
#include "explore/belief.hpp"
#include "explore/fleet.hpp"
#include "explore/pilot.hpp"
#include "explore/uav.hpp"
#include "mapping/scan_integrator.hpp"
#include "mapping/worker_pool.hpp"
#include "perception/cloud_pipeline.hpp"

#include <nlohmann/json_fwd.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stairwell::explore {

struct AssumedFree {
  Eigen::Vector3d center_m;
  double radius_m;
};

struct Fleet::Impl {
  Impl(const FleetConfig& fleet_config, std::vector<UavDoors> doors, ExplorationLog& exploration_log,
       std::function<double()> clock, const Radio* link);

  // fleet.cpp: the tick
  bool step();
  void sense();
  /// What a UAV's scan says about its map, and how long finding that out took.
  struct Sensed {
    mapping::CarvedScan carved;
    double computing_s = 0.0;
  };
  Sensed sense_one(const Uav& uav, mapping::ScanIntegrator& carver) const;
  void assume_start_free(const Uav& uav);
  std::vector<const Uav*> fellows_of(const Uav& uav) const;
  void enter(Uav& uav, Phase phase);
  bool command(Uav& uav, const Trajectory& trajectory);

  // fleet_decide.cpp: the state machine
  void decide();
  void decide_together(Belief& belief);
  void guard();
  bool guarded(const Uav& uav) const;
  bool braking(const Uav& uav) const;
  bool meets_anyone(const std::vector<bool>& stopped);
  bool mind_fellows(Uav& uav);
  void stop_at_once(Uav& uav, const Trajectory& stop, planning3d::Verdict verdict);
  void advance_phase(Uav& uav);
  void take_off(Uav& uav);
  void scan_around_or_find_goal(Uav& uav);
  double look_round_turn(const Uav& uav) const;
  bool wants_goal(const Uav& uav);
  void arrive(Uav& uav);
  void assign_goals(Belief& belief, const std::vector<std::size_t>& wanting);
  /// A motion to a goal, made ready by one of the threads.
  struct Draft {
    FlightDraft flight;
    double computing_s = 0.0;
  };
  Draft draft_flight(const Uav& uav, const coverage3d::Goal& goal, int thread);
  void draft_flights(const std::vector<std::size_t>& wanting, const coverage3d::Assignment& assignment);
  bool must_plan_on(const Uav& uav) const;
  bool keeps_goal(const Uav& uav, const coverage3d::Goal& goal) const;
  void fly(Uav& uav, const coverage3d::Goal& goal, double assign_s);
  void no_goal(Uav& uav);
  void stop_short(Uav& uav);
  void make_way(const Uav& blocked_uav, const std::vector<Eigen::Vector3d>& wanted_path_m);
  double depart_time(const Uav& uav) const;
  void charge(Uav& uav, double computing_s);
  bool worth_going_on(Belief& belief);
  bool promises_nothing(Belief& belief) const;
  void finish_if_nothing_left();
  void end_run_when_down();

  // fleet_return.cpp: the way back
  void lose_uavs();
  bool forgotten(const Uav& uav) const;
  double lift_to_m(const Uav& uav) const;
  void watch_battery(Uav& uav);
  double time_back_s(const Uav& uav) const;
  void retire(Uav& uav);
  void fly_home(Uav& uav);
  double above_fellows_m(const Uav& uav) const;
  void land(Uav& uav);

  // fleet_stall.cpp: no progress
  void hold_uavs();
  void watch_progress(Uav& uav);
  void give_task_back(Uav& uav);
  bool reached(const Uav& uav) const;
  void note_progress(Uav& uav);
  bool lifted(const Uav& uav) const;
  bool dispensable(const Uav& uav) const;

  // fleet_state.cpp
  void load(const nlohmann::json& state, std::vector<mapping::OccupancyMap> maps);

  // fleet_radio.cpp: who shares a map
  std::vector<std::vector<std::size_t>> groups_in_touch() const;
  void regroup();
  void split(Belief& belief, const std::vector<std::vector<std::size_t>>& groups);
  void share_tasks(const std::vector<std::size_t>& group);
  void join(const std::vector<std::size_t>& group);

  // fleet_avoid.cpp: local avoidance
  void avoid();
  void begin_avoiding(Uav& uav);
  void avoid_fellows(Uav& uav, const std::vector<planning3d::SeenUav>& fellows);
  void stop_avoiding(Uav& uav);

  FleetConfig config;
  std::unique_ptr<mapping::WorkerPool> pool;  ///< null: this thread does all
  std::vector<std::optional<Draft>> drafts;   ///< by UAV; gone when something is commanded to it
  ExplorationLog& log;
  std::function<double()> clock_s;
  const Radio* radio;  ///< null: all are in touch, always
  std::vector<Uav> uavs;
  std::vector<std::unique_ptr<Belief>> beliefs;  ///< one per group in touch
  std::uint64_t next_belief_id = 0;
  coverage3d::TaskBoard tasks;                   ///< told to all at any distance; with a radio only
  std::vector<mapping::ScanIntegrator> carvers;  ///< one for each thread
  mapping::ScanIntegrator integrator;            ///< stores what they carved
  perception::CloudPipeline pipeline;
  Pilot pilot;
  Avoider avoider;
  FleetStats stats;
  std::vector<AssumedFree> assumed;
  std::size_t ticks = 0;
  double tick_s = 0.1;
  double idle_since_s = -1.0;  ///< nobody has anything to do since then; negative = somebody has
  double exploration_end_s = -1.0;
  StopReason reason = StopReason::kRunning;

  double now_s() const { return static_cast<double>(ticks) * tick_s; }
};

}  // namespace stairwell::explore
