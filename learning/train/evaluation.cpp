#include "learning/train/evaluation.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "learning/train/teacher.hpp"
#include "learning/train/training_world.hpp"
#include "learning/train/widest_planner.hpp"
#include "planning3d/agent_planner.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/shorten_path.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace stairwell::train {

using planning3d::FreeSpace;
using planning3d::PlanRequest;
using planning3d::PlanResult;
using planning3d::PlanStatus;

namespace {

constexpr double kStep_m = 0.12;
constexpr double kSolidReach_m = 2.0;
constexpr double kLeastLong_m = 17.0, kMostLong_m = 23.0;  // a path of about 20 m

/// Flies as the agents do, without a network: down the way that they are shown, or where the teacher points.
class Follower final : public planning3d::Planner {
 public:
  Follower(bool plane, bool taught)
      : input_(plane ? planning3d::AgentInput::slice() : planning3d::AgentInput::volume()),
        taught_(taught),
        teacher_(Teacher::Config{.plane = plane}) {
    input_.samples = {1, 1, 1};  // looks at nothing
    input_.spacings_m = {0.1};
  }
  std::string_view name() const override { return taught_ ? "teacher" : "way"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override {
    PlanResult result;
    const planning3d::SegmentCheck check(space, request.keep_out, request.start_m);
    planning3d::ArrivalField field({.plane = input_.plane});
    field.compute(space, check, request.goal_m, request.start_m);
    if (taught_) teacher_.begin(space, check, request.goal_m, request.start_m);
    planning3d::AgentView view(input_);
    view.begin(space, request.keep_out, field);
    planning3d::Rollout rollout(check, view, field, {}, request.start_m);
    planning3d::Observation seen;
    while (rollout.look(seen)) {
      Eigen::Vector3d direction = view.way_ahead();
      if (taught_ && !teacher_.direction(rollout.path_m().back(), direction)) return result;
      rollout.move(direction);
    }
    if (rollout.end() != planning3d::RolloutEnd::kReached) return result;
    result.path_m =
        planning3d::straighten_path(check, planning3d::smooth_path(check, rollout.path_m(), planning3d::kSmoothings));
    result.length_m = planning3d::path_length_m(result.path_m);
    result.status = PlanStatus::kReached;
    return result;
  }

 private:
  planning3d::AgentInput input_;
  bool taught_;
  Teacher teacher_;
};

/// Metres from a point to the nearest solid voxel's face, about: trilinear, less half a voxel.
double clearance_m(const mapping::DistanceField& solid, const Eigen::Vector3d& at_m) {
  const GridSpec& grid = solid.grid();
  const double res = grid.resolution_m();
  const VoxelIndex low = grid.index_of(at_m - Eigen::Vector3d::Constant(0.5 * res));
  const Eigen::Vector3d u = (at_m - grid.center_of(low)) / res;
  double cells = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const VoxelIndex v = low + VoxelIndex{corner & 1, corner >> 1 & 1, corner >> 2 & 1};
    const double weight = ((corner & 1) != 0 ? u.x() : 1.0 - u.x()) * ((corner & 2) != 0 ? u.y() : 1.0 - u.y()) *
                          ((corner & 4) != 0 ? u.z() : 1.0 - u.z());
    const double distance =
        grid.contains(v) ? std::sqrt(static_cast<double>(solid.squared_cells(v))) : solid.truncation_cells();
    cells += weight * distance;
  }
  return std::max(0.0, (cells - 0.5) * res);
}

/// Points every 0.12 m along a path, and its end.
std::vector<Eigen::Vector3d> resampled(const std::vector<Eigen::Vector3d>& path_m) {
  std::vector<Eigen::Vector3d> points{path_m.front()};
  double wanted = kStep_m;
  for (std::size_t i = 1; i < path_m.size(); ++i) {
    const Eigen::Vector3d leg = path_m[i] - path_m[i - 1];
    const double length = leg.norm();
    for (; wanted <= length; wanted += kStep_m) points.emplace_back(path_m[i - 1] + leg * (wanted / length));
    wanted -= length;
  }
  return points;
}

double mean_turn_deg(const std::vector<Eigen::Vector3d>& points) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 2; i < points.size(); ++i, ++count) {
    const Eigen::Vector3d a = points[i - 1] - points[i - 2], b = points[i] - points[i - 1];
    sum += std::atan2(a.cross(b).norm(), a.dot(b));
  }
  return count > 0 ? deg_from_rad(sum / static_cast<double>(count)) : 0.0;
}

/// Adds up one planner's answers.
struct Tally {
  explicit Tally(std::string name) { figures.planner = std::move(name); }
  PlannerFigures figures;
  double length = 0.0, clearance = 0.0, turn = 0.0;
  std::vector<double> ms, long_ms;

  void add(const PlanResult& plan, double optimum_m, const mapping::DistanceField& solid, double took_s) {
    ++figures.episodes;
    ms.push_back(1e3 * took_s);
    if (plan.status != PlanStatus::kReached) return;
    ++figures.reached;
    if (plan.length_m >= kLeastLong_m && plan.length_m <= kMostLong_m) long_ms.push_back(1e3 * took_s);
    const auto points = resampled(plan.path_m);
    double least = kSolidReach_m;
    for (const Eigen::Vector3d& p : points) least = std::min(least, clearance_m(solid, p));
    length += plan.length_m / optimum_m;
    clearance += least;
    turn += mean_turn_deg(points);
    figures.least_clearance_m =
        std::isnan(figures.least_clearance_m) ? least : std::min(figures.least_clearance_m, least);
  }
  static void median_and_most(std::vector<double>& values, double& median, double& most) {
    if (values.empty()) return;
    std::ranges::sort(values);
    median = values[values.size() / 2];
    most = values.back();
  }
  PlannerFigures finish() {
    const double n = static_cast<double>(figures.reached);
    if (figures.episodes > 0) figures.success = n / static_cast<double>(figures.episodes);
    if (figures.reached > 0) {
      figures.length_over_optimum = length / n;
      figures.min_clearance_m = clearance / n;
      figures.mean_turn_deg = turn / n;
    }
    median_and_most(ms, figures.plan_ms, figures.max_plan_ms);
    median_and_most(long_ms, figures.long_plan_ms, figures.max_long_plan_ms);
    figures.long_paths = long_ms.size();
    return figures;
  }
};

TrainingWorld make_world(const EvaluationSuite& suite, Rng& rng, std::unique_ptr<mapping::DistanceField>& solid) {
  const Robot robot{suite.robot_radius_m, 0.0};
  const VoxelScene scene = [&] {
    if (suite.plane) {
      SliceWorldConfig config;
      config.size_m = rng.uniform(suite.least_size_m, suite.most_size_m);
      config.resolution_m = suite.resolution_m;
      config.least_obstacles = suite.least_obstacles;
      config.most_obstacles = suite.most_obstacles;
      return make_slice_scene(config, rng);
    }
    StoreyWorldConfig config;
    config.least_size_m = suite.least_size_m;
    config.most_size_m = suite.most_size_m;
    config.resolution_m = suite.resolution_m;
    config.least_storeys = suite.least_storeys;
    config.most_storeys = suite.most_storeys;
    return make_storey_scene(config, rng);
  }();
  TrainingWorld known(scene, robot);
  solid = std::make_unique<mapping::DistanceField>(scene.grid, kSolidReach_m, mapping::Obstacles::kOccupied);
  solid->update(known.map());
  if (!suite.partial) return known;
  std::vector<Eigen::Vector3d> places;
  for (int i = rng.uniform_int(3, 10); i > 0; --i) {
    if (const auto place = random_place(known.space(), std::nullopt, rng)) places.push_back(*place);
  }
  const auto seen = seen_from(scene, places, 4.5);
  return {scene, robot, &seen};
}

/// A task that the exact search can solve. False: none was found.
bool find_task(const EvaluationSuite& suite, const FreeSpace& space, Rng& rng, PlanRequest& request,
               double& optimum_m) {
  const Aabb box = space.grid().box();
  std::optional<double> height_m;
  if (suite.plane) height_m = 0.5 * (box.min_m.z() + box.max_m.z());
  planning3d::AstarPlanner::Config exact;
  for (int attempt = 0; attempt < 20; ++attempt) {
    const auto start = random_place(space, height_m, rng), goal = random_place(space, height_m, rng);
    if (!start || !goal || (*goal - *start).norm() < 0.5 * suite.least_way_m) continue;
    if (suite.cross_storey && std::abs(start->z() - goal->z()) < 2.0) continue;
    request.start_m = *start;
    request.goal_m = *goal;
    PlanRequest shortest = request;
    shortest.clearance_weight = 0.0;
    const PlanResult plan = planning3d::AstarPlanner(exact).plan(space, shortest);
    if (plan.status != PlanStatus::kReached || plan.length_m < suite.least_way_m) continue;
    optimum_m = plan.length_m;
    return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> EvaluationSuite::problems() const {
  std::vector<std::string> list;
  const auto require = [&](bool usable, const char* what) {
    if (!usable) list.emplace_back(what);
  };
  require(worlds >= 1 && worlds <= 100'000, "worlds must be 1 to 100000");
  require(tasks_per_world >= 1 && tasks_per_world <= 10'000, "tasks_per_world must be 1 to 10000");
  require(least_size_m >= 4.0 && most_size_m >= least_size_m && most_size_m <= 100.0,
          "size_m must be 4 to 100, in order");
  require(resolution_m >= 0.05 && resolution_m <= 0.5, "resolution_m must be 0.05 to 0.5");
  require(least_obstacles >= 0.0 && most_obstacles >= least_obstacles && most_obstacles <= 0.6,
          "obstacles must be 0 to 0.6, in order");
  require(least_storeys >= 1 && most_storeys >= least_storeys && most_storeys <= 20,
          "storeys must be 1 to 20, in order");
  require(robot_radius_m > 0.0 && robot_radius_m <= 1.0, "robot_radius_m must be above 0, at most 1");
  require(!cross_storey || (!plane && least_storeys > 1), "cross_storey needs several storeys");
  return list;
}

EvaluationResult evaluate(const EvaluationSuite& suite, const nn::Model& model, const EvaluationOptions& options) {
  if (const auto list = suite.problems(); !list.empty()) throw InputError("suite " + suite.name + ": " + list.front());
  if (planning3d::AgentInput::parse(model.input).plane != suite.plane) {
    throw InputError("suite " + suite.name + ": for another agent than " + model.agent);
  }
  planning3d::AgentPlanner::Config unforgiving;
  unforgiving.rollout.slide = false;
  unforgiving.second_keep = 0.0;
  planning3d::AgentPlanner agent(model), exacting(model, unforgiving);
  const auto astar = planning3d::make_planner("astar");
  Follower way(suite.plane, false), teacher(suite.plane, true);
  WidestPlanner roomiest(suite.plane);
  const planning3d::SafetyCheck check;
  Tally raw("agent"), strict("strict"), net("agent+net"), search("astar"), follower("way"), taught("teacher"),
      widest("widest");
  std::map<std::string, int> failures;
  const auto now_s = [&] { return options.clock_s ? options.clock_s() : 0.0; };
  const auto all = static_cast<std::size_t>(suite.worlds) * static_cast<std::size_t>(suite.tasks_per_world);
  Rng rng = make_rng(suite.seed, "evaluation-" + suite.name);
  for (std::size_t done = 0; done < all;) {
    std::unique_ptr<mapping::DistanceField> solid;
    const TrainingWorld world = make_world(suite, rng, solid);
    const FreeSpace space = world.space();
    for (int t = 0; t < suite.tasks_per_world; ++t, ++done) {
      if (options.interrupted && options.interrupted()) break;
      PlanRequest request;
      double optimum_m = 0.0;
      if (!find_task(suite, space, rng, request, optimum_m)) continue;
      const auto measure = [&](planning3d::Planner& planner, Tally& tally) {
        const double begin_s = now_s();
        PlanResult plan = planner.plan(space, request);
        const double took_s = now_s() - begin_s;
        if (plan.status == PlanStatus::kReached && !check.check_path(space, plan.path_m).safe()) plan = {};
        tally.add(plan, optimum_m, *solid, took_s);
        return std::pair(plan, took_s);
      };
      const auto flown = measure(agent, raw);
      const bool fell_back = flown.first.status != PlanStatus::kReached;
      if (fell_back) ++failures[to_string(agent.last_end())];
      measure(exacting, strict);
      const auto searched = measure(*astar, search);
      net.add(fell_back ? searched.first : flown.first, optimum_m, *solid,
              flown.second + (fell_back ? searched.second : 0.0));
      measure(way, follower);
      measure(teacher, taught);
      if (options.widest) {
        roomiest.set_solid(*solid);
        measure(roomiest, widest);
      }
      if (options.progress) options.progress(done, all);
    }
    if (options.interrupted && options.interrupted()) break;
  }
  EvaluationResult result{raw.finish(),      strict.finish(), net.finish(),    search.finish(),
                          follower.finish(), taught.finish(), widest.finish(), {}};
  for (const auto& [reason, count] : failures) result.failures.push_back(reason + ": " + std::to_string(count));
  return result;
}

}  // namespace stairwell::train
