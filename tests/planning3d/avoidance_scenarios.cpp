#include "avoidance_scenarios.hpp"

#include "core/errors.hpp"
#include "planning3d/path_follower.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/right_of_way.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <set>
#include <utility>

namespace stairwell::test {

using planning3d::FreeSpace;
using planning3d::OrcaConfig;
using planning3d::PathFollower;
using planning3d::RightOfWay;
using planning3d::SeenUav;

namespace {

constexpr double kArrived_m = 0.2;
constexpr double kReplan_s = 1.0;
constexpr int kMoments = 5;  // looked at per period

double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// There and back, so that each pair meets.
void add_pair(AvoidanceScenario& scenario, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
  scenario.uavs.push_back({a_m, b_m, 2.0});
  scenario.uavs.push_back({b_m, a_m, 2.0});
}

AvoidanceScenario head_on(bool corridor) {
  const Eigen::Vector3d size_m = corridor ? Eigen::Vector3d(12.0, 1.6, 1.6) : Eigen::Vector3d(12.0, 6.0, 6.0);
  AvoidanceScenario scenario{std::make_shared<TestWorld>(size_m, 0.1), {}};
  add_pair(scenario, {1.0, 0.5 * size_m.y(), 0.5 * size_m.z()}, {11.0, 0.5 * size_m.y(), 0.5 * size_m.z()});
  return scenario;
}

/// A hatch of 0.8 m, two diameters of a UAV, in a wall: two cannot pass each other in it.
AvoidanceScenario doorway() {
  AvoidanceScenario scenario{std::make_shared<TestWorld>(Eigen::Vector3d(12.0, 6.0, 4.0), 0.1), {}};
  for (const Aabb& part : {Aabb{{5.9, 0.0, 0.0}, {6.1, 2.6, 4.0}}, Aabb{{5.9, 3.4, 0.0}, {6.1, 6.0, 4.0}},
                           Aabb{{5.9, 2.6, 0.0}, {6.1, 3.4, 1.2}}, Aabb{{5.9, 2.6, 2.0}, {6.1, 3.4, 4.0}}}) {
    scenario.world->fill(part, true);
  }
  add_pair(scenario, {2.0, 1.5, 1.6}, {10.0, 4.5, 1.6});
  add_pair(scenario, {2.0, 3.0, 1.6}, {10.0, 3.0, 1.6});
  add_pair(scenario, {2.0, 4.5, 1.6}, {10.0, 1.5, 1.6});
  return scenario;
}

AvoidanceScenario crossing() {
  AvoidanceScenario scenario{std::make_shared<TestWorld>(Eigen::Vector3d(14.0, 14.0, 4.0), 0.1), {}};
  for (const double lane_m : {6.0, 7.0, 8.0}) {
    add_pair(scenario, {1.5, lane_m, 2.0}, {12.5, lane_m, 2.0});
    add_pair(scenario, {lane_m, 1.5, 2.0}, {lane_m, 12.5, 2.0});
  }
  return scenario;
}

AvoidanceScenario sphere_swap() {
  constexpr int kUavs = 20;
  constexpr double kRadius_m = 4.0;
  AvoidanceScenario scenario{std::make_shared<TestWorld>(Eigen::Vector3d(12.0, 12.0, 12.0), 0.2), {}};
  const Eigen::Vector3d center_m(6.0, 6.0, 6.0);
  for (int i = 0; i < kUavs; ++i) {  // Fibonacci lattice on the sphere
    const double z = 1.0 - (2.0 * i + 1.0) / kUavs;
    const double angle_rad = M_PI * (3.0 - std::sqrt(5.0)) * i;
    const double r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d out_m = kRadius_m * Eigen::Vector3d(r * std::cos(angle_rad), r * std::sin(angle_rad), z);
    scenario.uavs.push_back({center_m + out_m, center_m - out_m, 2.0});
  }
  return scenario;
}

double jitter_of(std::string_view name) { return name == "head_on_corridor" ? 0.25 : 0.3; }

struct Agent {
  Agent(const ScenarioUav& uav, std::size_t number) : plan(uav) {
    state.position_m = uav.start_m;
    state.number = number;
  }
  ScenarioUav plan;
  SeenUav state;
  Eigen::Vector3d next_mps = Eigen::Vector3d::Zero();
  std::unique_ptr<PathFollower> path;
  std::unique_ptr<RightOfWay> way;
  double next_plan_s = 0.0;
  bool lost = false;  ///< cannot reach its path on a straight line
  bool arrived = false;
};

void find_path(const FreeSpace& space, const OrcaConfig& config, Agent& agent) {
  planning3d::PlanRequest request;
  request.start_m = agent.state.position_m;
  request.goal_m = agent.plan.goal_m;
  const auto plan = planning3d::make_planner("astar")->plan(space, request);
  if (plan.status != planning3d::PlanStatus::kReached) return;
  agent.path = std::make_unique<PathFollower>(plan.path_m, config.limits, agent.plan.cruise_mps);
  const double abreast_m = 2.0 * (space.robot().radius_m + config.margin_m);
  agent.way = std::make_unique<RightOfWay>(narrow_sections(space, *agent.path, abreast_m), abreast_m);
}

void decide(const FreeSpace& space, const OrcaConfig& config, Agent& agent, const std::vector<SeenUav>& fellows,
            AvoidanceOutcome& outcome) {
  const double begin_s = thread_time_s();
  agent.path->update(agent.state.position_m);
  const double stop_m = agent.way->stop_arc_m(*agent.path, agent.state, fellows, config);
  const auto wish_mps = agent.path->wish_mps(space, agent.state.position_m, stop_m);
  const auto choice =
      planning3d::choose_velocity(space, config, agent.state, wish_mps.value_or(Eigen::Vector3d::Zero()), fellows);
  outcome.step_us.push_back(1e6 * (thread_time_s() - begin_s));
  outcome.brakings += choice.braking ? 1 : 0;
  agent.next_mps = choice.velocity_mps;
  agent.lost = !wish_mps;
}

class Referee {
 public:
  Referee(const FreeSpace& space, AvoidanceOutcome& outcome) : space_(space), outcome_(outcome) {}
  void look(const std::vector<Eigen::Vector3d>& positions_m) {
    const double radius_m = space_.robot().radius_m;
    for (std::size_t i = 0; i < positions_m.size(); ++i) {
      if (!space_.sphere_free(positions_m[i], radius_m)) hit_.insert({i, i});
      for (std::size_t j = i + 1; j < positions_m.size(); ++j) {
        const double distance_m = (positions_m[i] - positions_m[j]).norm();
        outcome_.min_distance_m = std::min(outcome_.min_distance_m, distance_m);
        if (distance_m < 2.0 * radius_m) hit_.insert({i, j});
      }
    }
    outcome_.collisions = static_cast<int>(hit_.size());
  }

 private:
  const FreeSpace& space_;
  AvoidanceOutcome& outcome_;
  std::set<std::pair<std::size_t, std::size_t>> hit_;
};

/// All move at once, at constant acceleration.
void move(std::vector<Agent>& agents, const OrcaConfig& config, Referee& referee, AvoidanceOutcome& outcome) {
  for (int k = 1; k <= kMoments; ++k) {
    const double t_s = config.period_s * k / kMoments;
    std::vector<Eigen::Vector3d> positions_m;
    for (const Agent& agent : agents) {
      const Eigen::Vector3d acceleration_mps2 = (agent.next_mps - agent.state.velocity_mps) / config.period_s;
      positions_m.push_back(agent.state.position_m + t_s * agent.state.velocity_mps +
                            0.5 * t_s * t_s * acceleration_mps2);
    }
    referee.look(positions_m);
    if (k < kMoments) continue;
    for (std::size_t i = 0; i < agents.size(); ++i) {
      SeenUav& state = agents[i].state;
      const double change_mps = (agents[i].next_mps - state.velocity_mps).norm();
      outcome.max_acceleration_mps2 = std::max(outcome.max_acceleration_mps2, change_mps / config.period_s);
      outcome.max_speed_mps = std::max(outcome.max_speed_mps, agents[i].next_mps.norm());
      state.position_m = positions_m[i];
      state.velocity_mps = agents[i].next_mps;
    }
  }
}

}  // namespace

const std::vector<std::string_view>& avoidance_scenario_names() {
  static const std::vector<std::string_view> names = {"head_on", "head_on_corridor", "doorway", "crossing",
                                                      "sphere_swap"};
  return names;
}

AvoidanceScenario make_avoidance_scenario(std::string_view name, std::uint64_t seed) {
  AvoidanceScenario scenario;
  if (name == "head_on" || name == "head_on_corridor") scenario = head_on(name == "head_on_corridor");
  if (name == "doorway") scenario = doorway();
  if (name == "crossing") scenario = crossing();
  if (name == "sphere_swap") scenario = sphere_swap();
  if (scenario.uavs.empty()) throw InputError("unknown avoidance scenario '" + std::string(name) + "'");
  if (seed == 0) return scenario;
  Rng rng = make_rng(seed, "avoidance scenario");
  const double jitter_m = jitter_of(name);
  for (ScenarioUav& uav : scenario.uavs) {
    for (Eigen::Vector3d* place_m : {&uav.start_m, &uav.goal_m}) {
      for (int axis = 0; axis < 3; ++axis) (*place_m)[axis] += rng.uniform(-jitter_m, jitter_m);
    }
    uav.cruise_mps = rng.uniform(1.2, 2.0);
  }
  return scenario;
}

AvoidanceOutcome run_avoidance(const AvoidanceScenario& scenario, const OrcaConfig& config) {
  AvoidanceOutcome outcome;
  const FreeSpace space = scenario.world->space();
  std::vector<Agent> agents;
  for (std::size_t i = 0; i < scenario.uavs.size(); ++i) {
    agents.emplace_back(scenario.uavs[i], i);
    find_path(space, config, agents.back());
    if (!agents.back().path) throw InputError("no path in an avoidance scenario");
    const double cruise_mps = std::min(scenario.uavs[i].cruise_mps, config.limits.speed_mps);
    const double ramps_s = cruise_mps / config.limits.acceleration_mps2;
    outcome.least_s = std::max(outcome.least_s, agents.back().path->length_m() / cruise_mps + ramps_s);
  }
  Referee referee(space, outcome);
  const auto away = [](const Agent& agent) { return !agent.arrived; };
  for (double time_s = 0.0; time_s < scenario.time_limit_s; time_s += config.period_s) {
    std::vector<SeenUav> all;
    for (const Agent& agent : agents) all.push_back(agent.state);
    for (std::size_t i = 0; i < agents.size(); ++i) {
      std::vector<SeenUav> fellows = all;
      fellows.erase(fellows.begin() + static_cast<std::ptrdiff_t>(i));
      if (agents[i].lost && time_s >= agents[i].next_plan_s) {
        agents[i].next_plan_s = time_s + kReplan_s;
        find_path(space, config, agents[i]);
      }
      decide(space, config, agents[i], fellows, outcome);
    }
    move(agents, config, referee, outcome);
    for (Agent& agent : agents) {
      agent.arrived = agent.arrived || (agent.state.position_m - agent.plan.goal_m).norm() < kArrived_m;
    }
    outcome.finish_s = time_s + config.period_s;
    if (std::none_of(agents.begin(), agents.end(), away)) break;
  }
  outcome.not_arrived = static_cast<int>(std::count_if(agents.begin(), agents.end(), away));
  return outcome;
}

}  // namespace stairwell::test
