// explore_programmatically: one simulated UAV explores a generated single-storey building, without the command line.
// How world, sensor, vehicle and fleet are put together is in building.hpp.
#include "building.hpp"

#include <cstdio>
#include <exception>

namespace {

using namespace stairwell;

/// Says what the fleet decides.
class PrintingLog final : public explore::ExplorationLog {
 public:
  void on_goal(double time_s, std::size_t, const Eigen::Vector3d& goal_m, double gain_m3, std::string_view) override {
    std::printf("%6.1f s  fly to %.1f, %.1f, %.1f to see %.1f m3\n", time_s, goal_m.x(), goal_m.y(), goal_m.z(),
                gain_m3);
  }
};

}  // namespace

int main() {
  try {
    PrintingLog log;
    const auto explored = example::explore_building(log);
    std::printf("%s after %.1f s: %.1f m3 known\n", explored.stop_reason, explored.time_s, explored.known_m3);
    return explored.known_m3 > 50.0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "explore_programmatically: %s\n", error.what());
    return 1;
  }
}
