#include "planning3d/ompl_planner.hpp"

#include "core/rng.hpp"
#include "planning3d/connectivity.hpp"
#include "planning3d/lazy_array.hpp"
#include "planning3d/plan_ends.hpp"
#include "planning3d/segment_check.hpp"
#include "planning3d/shorten_path.hpp"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/informedtrees/ABITstar.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/prm/PRMstar.h>
#include <ompl/geometric/planners/rrt/InformedRRTstar.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

namespace stairwell::planning3d {

namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

constexpr double kLeastExtent_m = 1e-3;  // OMPL wants bounds with a volume
constexpr double kGoodEnough = 1.001;    // of the straight line: nothing left to gain
constexpr double kSolveShare = 0.9;      // of the time left; the rest is for shortening
constexpr std::size_t kFirstMilestones = 100;

using Named = std::pair<std::string_view, OmplPlanner::Algorithm>;
constexpr std::array<Named, 6> kNamed{{{"rrtconnect", OmplPlanner::Algorithm::kRrtConnect},
                                       {"rrtstar", OmplPlanner::Algorithm::kRrtStar},
                                       {"informed_rrtstar", OmplPlanner::Algorithm::kInformedRrtStar},
                                       {"bitstar", OmplPlanner::Algorithm::kBitStar},
                                       {"abitstar", OmplPlanner::Algorithm::kAbitStar},
                                       {"prmstar", OmplPlanner::Algorithm::kPrmStar}}};

bool finite(const Eigen::Vector3d& v) { return v.array().isFinite().all(); }

/// What the planner may still spend. Every question it asks counts, and once it is spent it stays so: OMPL's planners
/// look at their termination condition too seldom, and unwind when they are told that nothing is free any more.
class Budget {
 public:
  explicit Budget(const PlanRequest& request) : most_(request.max_checks), clock_s_(request.clock_s) {
    if (!clock_s_) return;
    const double now_s = clock_s_();
    deadline_s_ = request.deadline_s;
    solve_until_s_ = now_s + kSolveShare * (deadline_s_ - now_s);
    spent_ = now_s >= deadline_s_;
  }

  /// @return whether nothing is left
  bool spend() {
    if (spent_) return true;
    spent_ = ++used_ > most_ || (clock_s_ && clock_s_() >= solve_until_s_);
    return spent_;
  }
  /// Asked very often, therefore looks at the clock only now and then. @return whether the time is up
  bool time_up() {
    constexpr unsigned kEvery = 256;
    if (!clock_s_ || ++glances_ % kEvery != 0) return false;
    spent_ = spent_ || clock_s_() >= solve_until_s_;
    return spent_;
  }
  bool spent() const { return spent_; }
  bool late() const { return clock_s_ && clock_s_() >= deadline_s_; }
  std::size_t used() const { return used_; }

 private:
  std::size_t most_;
  const std::function<double()>& clock_s_;
  double deadline_s_ = std::numeric_limits<double>::infinity();
  double solve_until_s_ = std::numeric_limits<double>::infinity();
  std::size_t used_ = 0;
  unsigned glances_ = 0;
  bool spent_ = false;
};

/// One call of plan: what OMPL's callbacks need. States have two coordinates where `plane_m` is set.
struct Problem {
  const FreeSpace& space;
  SegmentCheck check;
  Aabb box;
  Budget budget;
  std::optional<double> plane_m;
  Eigen::Vector3d root_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();

  Eigen::Vector3d point(const ob::State* state) const {
    const double* at = state->as<ob::RealVectorStateSpace::StateType>()->values;
    return {at[0], at[1], plane_m ? *plane_m : at[2]};
  }
  bool place_free(const Eigen::Vector3d& at_m) const {
    if (!box.contains(at_m)) return false;
    const VoxelIndex v = space.grid().index_of(at_m);
    return space.traversable(v) && check.outside_keep_out(at_m) && (check.roomy(v) || check.fits(at_m));
  }
};

class States final : public ob::StateValidityChecker {
 public:
  States(const ob::SpaceInformationPtr& si, Problem& problem) : ob::StateValidityChecker(si), problem_(problem) {}
  bool isValid(const ob::State* state) const override {
    return !problem_.budget.spend() && problem_.place_free(problem_.point(state));
  }

 private:
  Problem& problem_;
};

class Motions final : public ob::MotionValidator {
 public:
  Motions(const ob::SpaceInformationPtr& si, Problem& problem) : ob::MotionValidator(si), problem_(problem) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    if (problem_.budget.spend()) return false;
    return problem_.check.segment_free(problem_.point(from), problem_.point(to));
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last_valid) const override {
    if (checkMotion(from, to)) return true;
    if (last_valid.first != nullptr) si_->copyState(last_valid.first, from);
    last_valid.second = 0.0;
    return false;
  }

 private:
  Problem& problem_;
};

/// Leaves BIT* in the middle of an iteration.
struct TimeUp {};

/// BIT* sorts and prunes for many times the budget in one iteration without asking anything; distances are what it
/// needs all the time. What it holds, it holds by smart pointers.
class TimedStates final : public ob::RealVectorStateSpace {
 public:
  TimedStates(Problem& problem, unsigned dimensions, bool leave)
      : ob::RealVectorStateSpace(dimensions), problem_(problem), leave_(leave) {}
  double distance(const ob::State* a, const ob::State* b) const override {
    if (leave_ && problem_.budget.time_up()) throw TimeUp{};
    return ob::RealVectorStateSpace::distance(a, b);
  }

 private:
  Problem& problem_;
  bool leave_;
};

/// PRM* without the thread that OMPL's own `solve` starts to look for solutions, and without its parts that are timed
/// by the wall clock: looks whenever the roadmap has grown by a half.
class PrmStar final : public og::PRMstar {
 public:
  using og::PRMstar::PRMstar;

  ob::PlannerStatus solve(const ob::PlannerTerminationCondition& stop) override {
    checkValidity();
    if (!sampler_) sampler_ = si_->allocValidStateSampler();
    while (const ob::State* state = pis_.nextStart()) startM_.push_back(addMilestone(si_->cloneState(state)));
    while (const ob::State* state = pis_.nextGoal()) goalM_.push_back(addMilestone(si_->cloneState(state)));
    if (startM_.empty()) return ob::PlannerStatus::INVALID_START;
    if (goalM_.empty()) return ob::PlannerStatus::INVALID_GOAL;
    ob::PathPtr path;
    unsigned long target = kFirstMilestones;
    for (bool good = false; !good && !stop(); target += target / 2) {
      growRoadmap(ob::PlannerTerminationCondition([&] { return stop() || milestoneCount() >= target; }));
      good = maybeConstructSolution(startM_, goalM_, path);
    }
    if (!path) return ob::PlannerStatus::TIMEOUT;
    pdef_->addSolutionPath(path);
    return ob::PlannerStatus::EXACT_SOLUTION;
  }
};

ob::PlannerPtr make_vendor_planner(OmplPlanner::Algorithm algorithm, const ob::SpaceInformationPtr& si) {
  using Algorithm = OmplPlanner::Algorithm;
  switch (algorithm) {
    case Algorithm::kRrtConnect:
      return std::make_shared<og::RRTConnect>(si);
    case Algorithm::kRrtStar:
      return std::make_shared<og::RRTstar>(si);
    case Algorithm::kInformedRrtStar:
      return std::make_shared<og::InformedRRTstar>(si);
    case Algorithm::kBitStar:
      return std::make_shared<og::BITstar>(si);
    case Algorithm::kAbitStar:
      return std::make_shared<og::ABITstar>(si);
    case Algorithm::kPrmStar:
      return std::make_shared<PrmStar>(si);
  }
  return nullptr;
}

/// Every generator that OMPL makes from here on takes its seed from this one.
void seed_ompl(std::uint64_t seed) {
  static const bool quiet = [] {
    ompl::msg::noOutputHandler();  // among others it complains about every seed but the first
    return true;
  }();
  static_cast<void>(quiet);
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(make_rng(seed, "ompl")() >> 33) + 1);
}

ob::StateSpacePtr make_state_space(Problem& problem, bool leave) {
  const unsigned dimensions = problem.plane_m ? 2 : 3;
  auto states = std::make_shared<TimedStates>(problem, dimensions, leave);
  ob::RealVectorBounds bounds(dimensions);
  for (unsigned axis = 0; axis < dimensions; ++axis) {
    bounds.setLow(axis, problem.box.min_m[axis]);
    bounds.setHigh(axis, std::max(problem.box.max_m[axis], problem.box.min_m[axis] + kLeastExtent_m));
  }
  states->setBounds(bounds);
  return states;
}

/// From root to target by OMPL; empty if it found nothing exact.
std::vector<Eigen::Vector3d> solve(OmplPlanner::Algorithm algorithm, Problem& problem, std::uint64_t seed) {
  static std::mutex seeding;
  std::unique_lock<std::mutex> lock(seeding);
  seed_ompl(seed);
  using Algorithm = OmplPlanner::Algorithm;
  const bool leave = algorithm == Algorithm::kBitStar || algorithm == Algorithm::kAbitStar;
  const ob::StateSpacePtr states = make_state_space(problem, leave);
  const auto si = std::make_shared<ob::SpaceInformation>(states);
  si->setStateValidityChecker(std::make_shared<States>(si, problem));
  si->setMotionValidator(std::make_shared<Motions>(si, problem));
  si->setup();
  ob::ScopedState<ob::RealVectorStateSpace> from(states);
  ob::ScopedState<ob::RealVectorStateSpace> to(states);
  for (unsigned axis = 0; axis < states->getDimension(); ++axis) {
    from[axis] = problem.root_m[axis];
    to[axis] = problem.target_m[axis];
  }
  const auto definition = std::make_shared<ob::ProblemDefinition>(si);
  definition->setStartAndGoalStates(from, to);
  const auto objective = std::make_shared<ob::PathLengthOptimizationObjective>(si);
  objective->setCostThreshold(ob::Cost(kGoodEnough * (problem.target_m - problem.root_m).norm()));
  definition->setOptimizationObjective(objective);
  std::vector<Eigen::Vector3d> best_m;
  if (leave) {  // it publishes its answer only at the end
    definition->setIntermediateSolutionCallback(
        [&](const ob::Planner*, const std::vector<const ob::State*>& from_goal, const ob::Cost) {
          best_m.assign(1, problem.root_m);
          for (auto state = from_goal.rbegin(); state != from_goal.rend(); ++state) {
            best_m.push_back(problem.point(*state));
          }
          best_m.push_back(problem.target_m);
        });
  }
  const ob::PlannerPtr planner = make_vendor_planner(algorithm, si);
  try {
    planner->setProblemDefinition(definition);
    planner->setup();
    lock.unlock();
    planner->solve(ob::PlannerTerminationCondition([&problem] { return problem.budget.spend(); }));
  } catch (const TimeUp&) {
    return best_m;
  }
  // `bool(status)` is true for approximate answers as well.
  if (!definition->hasExactSolution()) return {};
  const auto* path = definition->getSolutionPath()->as<og::PathGeometric>();
  std::vector<Eigen::Vector3d> points_m;
  points_m.reserve(path->getStateCount());
  for (std::size_t i = 0; i < path->getStateCount(); ++i) {
    points_m.push_back(problem.point(path->getState(static_cast<unsigned>(i))));
  }
  return points_m;
}

/// Whether one of the ends lies in a pocket of at most `most` traversable voxels without the other. Straight segments
/// pass voxels face by face, so that none leads out.
bool cut_off(const Problem& problem, std::size_t most) {
  const GridSpec& grid = problem.space.grid();
  LazyArray<std::uint8_t> side(grid.voxel_count());
  std::array<std::vector<VoxelIndex>, 2> open;
  for (std::uint8_t end = 0; end < 2; ++end) {
    open[end].push_back(grid.index_of(end == 0 ? problem.root_m : problem.target_m));
    side[grid.linear(open[end].back())] = static_cast<std::uint8_t>(end + 1);
  }
  if (open[0].back() == open[1].back()) return false;
  for (std::size_t step = 0; step < most; ++step) {
    for (std::uint8_t end = 0; end < 2; ++end) {
      if (open[end].empty()) return true;
      const VoxelIndex v = open[end].back();
      open[end].pop_back();
      for (const VoxelIndex& to : {v + VoxelIndex{1, 0, 0}, v - VoxelIndex{1, 0, 0}, v + VoxelIndex{0, 1, 0},
                                   v - VoxelIndex{0, 1, 0}, v + VoxelIndex{0, 0, 1}, v - VoxelIndex{0, 0, 1}}) {
        if ((problem.plane_m && to.z != v.z) || !problem.space.traversable(to)) continue;
        std::uint8_t& there = side[grid.linear(to)];
        if (there == 2 - end) return false;  // the other's
        if (there != 0) continue;
        there = static_cast<std::uint8_t>(end + 1);
        open[end].push_back(to);
      }
    }
  }
  return false;
}

/// The height nearest to both ends to which both can be led straight up or down.
std::optional<double> common_layer_m(const Problem& problem, const MotionRule& rule) {
  const GridSpec& grid = problem.space.grid();
  std::optional<double> best_m;
  double least_m = std::numeric_limits<double>::infinity();
  for (const double layer_m : rule.layers_m) {
    if (!std::isfinite(layer_m)) continue;
    const double z_m = grid.center_of(grid.index_of({problem.root_m.x(), problem.root_m.y(), layer_m})).z();
    const double way_m = std::abs(problem.root_m.z() - z_m) + std::abs(problem.target_m.z() - z_m);
    if (way_m >= least_m) continue;
    const auto reaches = [&](const Eigen::Vector3d& end_m) {
      const Eigen::Vector3d there_m(end_m.x(), end_m.y(), z_m);
      return problem.place_free(there_m) && problem.check.segment_free(end_m, there_m);
    };
    if (!reaches(problem.root_m) || !reaches(problem.target_m)) continue;
    least_m = way_m;
    best_m = z_m;
  }
  return best_m;
}

bool same_column(const GridSpec& grid, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
  const VoxelIndex a = grid.index_of(a_m);
  const VoxelIndex b = grid.index_of(b_m);
  return a.x == b.x && a.y == b.y;
}

void append(std::vector<Eigen::Vector3d>& path_m, const Eigen::Vector3d& point_m) {
  if (path_m.empty() || (path_m.back() - point_m).norm() > 1e-9) path_m.push_back(point_m);
}

bool every_segment_free(const Problem& problem, const std::vector<Eigen::Vector3d>& path_m) {
  for (const Eigen::Vector3d& point_m : path_m) {
    if (!finite(point_m) || !problem.place_free(point_m)) return false;
  }
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    if (!problem.check.segment_free(path_m[i], path_m[i + 1])) return false;
  }
  return true;
}

/// Where planning begins and ends: as asked where the robot fits, else the nearest voxel's centre.
/// @return kReached if there are such places
PlanStatus find_root_and_target(Problem& problem, const PlanRequest& request) {
  const FreeSpace& space = problem.space;
  const auto led_in = [&](const Eigen::Vector3d& wanted_m, Eigen::Vector3d& end_m) {
    VoxelIndex v;
    if (!space.nearest_traversable(wanted_m, kSnap_m, v)) return false;
    end_m = wanted_m;
    if (space.grid().index_of(wanted_m) == v && problem.place_free(end_m)) return true;
    end_m = space.grid().center_of(v).cwiseMax(problem.box.min_m).cwiseMin(problem.box.max_m);
    return problem.place_free(end_m);
  };
  if (!led_in(request.start_m, problem.root_m)) return PlanStatus::kStartBlocked;
  if (!led_in(request.goal_m, problem.target_m)) return PlanStatus::kGoalBlocked;
  return PlanStatus::kReached;
}

/// @return kReached if root and target can be led to one plane, or need none
PlanStatus choose_plane(Problem& problem, const MotionRule& rule) {
  if (rule.kind != MotionRule::Kind::kSlice) return PlanStatus::kReached;
  if (same_column(problem.space.grid(), problem.root_m, problem.target_m) &&
      problem.check.segment_free(problem.root_m, problem.target_m)) {
    return PlanStatus::kReached;
  }
  problem.plane_m = common_layer_m(problem, rule);
  if (!problem.plane_m) return PlanStatus::kNoPath;
  problem.root_m.z() = problem.target_m.z() = *problem.plane_m;
  return PlanStatus::kReached;
}

}  // namespace

std::vector<std::string_view> OmplPlanner::names() {
  std::vector<std::string_view> all;
  for (const auto& [name, algorithm] : kNamed) all.push_back(name);
  return all;
}

std::unique_ptr<OmplPlanner> OmplPlanner::make(std::string_view name) {
  for (const auto& [known, algorithm] : kNamed) {
    if (known == name) return std::make_unique<OmplPlanner>(algorithm);
  }
  return nullptr;
}

std::string_view OmplPlanner::name() const {
  for (const auto& [name, algorithm] : kNamed) {
    if (algorithm == algorithm_) return name;
  }
  return "?";
}

PlanResult OmplPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  const GivingUp giving_up(space, request);
  Problem problem{space,
                  SegmentCheck(space, request.keep_out, request.start_m),
                  space.flight_box().intersection(space.grid().box()),
                  Budget(request),
                  {}};
  result.status = find_root_and_target(problem, request);
  if (result.status != PlanStatus::kReached) return result;
  const Eigen::Vector3d first_m = problem.root_m;
  const Eigen::Vector3d last_m = problem.target_m;
  result.status = choose_plane(problem, request.rule);
  if (result.status != PlanStatus::kReached) return result;
  std::vector<Eigen::Vector3d> way_m{problem.root_m, problem.target_m};
  if (!problem.check.segment_free(problem.root_m, problem.target_m)) {
    result.status = PlanStatus::kNoPath;
    if (cut_off(problem, config_.flood_voxels)) return result;
    way_m = solve(algorithm_, problem, request.seed);
    result.expansions = problem.budget.used();
    if (way_m.empty()) {
      if (problem.budget.spent()) result.status = PlanStatus::kTimedOut;
      const GridSpec& grid = space.grid();
      if (config_.flood_voxels > 0) {
        result.status = giving_up.status(result.status, grid.index_of(problem.root_m), grid.index_of(problem.target_m));
      }
      return result;
    }
    Rng rng = make_rng(request.seed, "ompl.shorten");
    if (config_.shorten) way_m = shorten_path(problem.check, way_m, rng, [&problem] { return problem.budget.late(); });
  }
  std::vector<Eigen::Vector3d> free_m;
  append(free_m, first_m);
  for (const Eigen::Vector3d& point_m : way_m) append(free_m, point_m);
  append(free_m, last_m);
  result.status = PlanStatus::kNoPath;
  if (!every_segment_free(problem, free_m)) return result;
  append(result.path_m, request.start_m);
  for (const Eigen::Vector3d& point_m : free_m) append(result.path_m, point_m);
  if (result.path_m.size() == 1) result.path_m.push_back(result.path_m.front());
  result.length_m = path_length_m(result.path_m);
  result.status = PlanStatus::kReached;
  return result;
}

}  // namespace stairwell::planning3d
