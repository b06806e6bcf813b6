// own_planner: a fleet explores with a planner of one's own: straight lines where they are free, and A* where not.
#include "building.hpp"
#include "planning3d/planner.hpp"

#include <cstdio>
#include <exception>

namespace {

using namespace stairwell;

/// Flies straight or not at all.
class Beeline final : public planning3d::Planner {
 public:
  explicit Beeline(std::size_t& answers) : answers_(answers) {}

  std::string_view name() const override { return "beeline"; }

  planning3d::PlanResult plan(const planning3d::FreeSpace& space, const planning3d::PlanRequest& request) override {
    planning3d::PlanResult result;
    const bool in_slices = request.rule.kind == planning3d::MotionRule::Kind::kSlice;
    if (in_slices || !space.swept_sphere_free(request.start_m, request.goal_m, space.robot().clearance_m())) {
      return result;  // kNoPath: the fallback is asked
    }
    result.status = planning3d::PlanStatus::kReached;
    result.path_m = {request.start_m, request.goal_m};
    result.length_m = (request.goal_m - request.start_m).norm();
    ++answers_;
    return result;
  }

 private:
  std::size_t& answers_;
};

}  // namespace

int main() {
  try {
    std::size_t answers = 0;
    explore::ExplorationLog silent;
    const auto explored = example::explore_building(silent, [&answers](explore::FleetConfig& config) {
      config.own_planner = [&answers] { return std::make_unique<Beeline>(answers); };
      config.fallback = "astar";
    });
    std::printf("%.1f m3 known after %.1f s; %zu straight paths, %zu answers of the fallback\n", explored.known_m3,
                explored.time_s, answers, explored.fallbacks);
    return answers > 0 && explored.known_m3 > 50.0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "own_planner: %s\n", error.what());
    return 1;
  }
}
