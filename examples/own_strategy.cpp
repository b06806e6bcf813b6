// own_strategy: a fleet explores with a coverage strategy of one's own: always to the nearest frontier (Yamauchi 1997).
#include "building.hpp"
#include "coverage3d/frontier_finder.hpp"
#include "coverage3d/strategy.hpp"

#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <vector>

namespace {

using namespace stairwell;

class NearestFrontier final : public coverage3d::CoverageStrategy {
 public:
  explicit NearestFrontier(const coverage3d::CoverageConfig& config) : config_(config) {}

  std::string_view name() const override { return "nearest"; }
  planning3d::MotionRule motion_rule() const override { return planning3d::MotionRule::volume(); }

  coverage3d::Assignment assign(const planning3d::FreeSpace& space,
                                const coverage3d::AssignmentRequest& request) override {
    update(space);
    coverage3d::Assignment assignment;
    for (const auto& [id, cluster] : finder_->clusters()) {
      assignment.open_targets += finder_->worth_a_visit(cluster) ? 1 : 0;
    }
    for (const coverage3d::UavView& uav : request.uavs) {
      assignment.goals.push_back(uav.wants_goal ? nearest(space, uav.position_m) : uav.goal);
    }
    return assignment;
  }

  bool still_useful(const planning3d::FreeSpace& space, const coverage3d::Goal& goal) override {
    update(space);
    for (const auto& [id, cluster] : finder_->clusters()) {
      if (finder_->worth_a_visit(cluster) && (cluster.center_m - goal.target_m).norm() < kNear_m) return true;
    }
    return false;
  }

  void report_failure(const coverage3d::Goal& goal, double) override { avoided_m_.push_back(goal.target_m); }
  std::string save_state() const override { return ""; }
  void load_state(const std::string&) override {}

 private:
  static constexpr double kNear_m = 0.6;

  void update(const planning3d::FreeSpace& space) {
    if (!finder_) {
      coverage3d::FrontierConfig frontiers;
      frontiers.box = config_.box;
      finder_.emplace(space.grid(), frontiers);
    }
    finder_->update(space.map());
  }

  bool avoided(const Eigen::Vector3d& target_m) const {
    for (const Eigen::Vector3d& p : avoided_m_) {
      if ((p - target_m).norm() < kNear_m) return true;
    }
    return false;
  }

  /// A place to stand near the nearest cluster, looking at it.
  std::optional<coverage3d::Goal> nearest(const planning3d::FreeSpace& space, const Eigen::Vector3d& from_m) const {
    std::optional<coverage3d::Goal> best;
    for (const auto& [id, cluster] : finder_->clusters()) {
      VoxelIndex stand;
      if (!finder_->worth_a_visit(cluster) || avoided(cluster.center_m)) continue;
      if (!space.nearest_traversable(cluster.center_m, 1.5, stand)) continue;
      coverage3d::Goal goal;
      goal.position_m = space.grid().center_of(stand);
      goal.target_m = cluster.center_m;
      goal.yaw_rad = std::atan2(goal.target_m.y() - from_m.y(), goal.target_m.x() - from_m.x());
      goal.gain_m3 = cluster.pocket_m3;
      goal.travel_m = (goal.position_m - from_m).norm();
      if (!best || goal.travel_m < best->travel_m) best = goal;
    }
    return best;
  }

  coverage3d::CoverageConfig config_;
  std::optional<coverage3d::FrontierFinder> finder_;
  std::vector<Eigen::Vector3d> avoided_m_;
};

}  // namespace

int main() {
  try {
    explore::ExplorationLog silent;
    const auto usual = example::explore_building(silent);
    const auto nearest = example::explore_building(silent, [](explore::FleetConfig& config) {
      config.own_coverage = [](const coverage3d::CoverageConfig& coverage) {
        return std::make_unique<NearestFrontier>(coverage);
      };
    });
    std::printf("frontiers: %6.1f m3 known after %5.1f s, %s\n", usual.known_m3, usual.time_s, usual.stop_reason);
    std::printf("nearest:   %6.1f m3 known after %5.1f s, %s\n", nearest.known_m3, nearest.time_s, nearest.stop_reason);
    return nearest.known_m3 > 0.5 * usual.known_m3 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "own_strategy: %s\n", error.what());
    return 1;
  }
}
