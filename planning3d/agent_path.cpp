#include "planning3d/agent_path.hpp"

namespace stairwell::planning3d {

std::vector<Eigen::Vector3d> smooth_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, int rounds) {
  constexpr int kRepairs = 4;
  std::vector<Eigen::Vector3d> next = path_m;
  std::vector<bool> pinned(path_m.size(), false);
  for (int round = 0; round < rounds && path_m.size() > 2; ++round) {
    for (std::size_t i = 1; i + 1 < path_m.size(); ++i) {
      next[i] = pinned[i] ? path_m[i] : Eigen::Vector3d(0.25 * path_m[i - 1] + 0.5 * path_m[i] + 0.25 * path_m[i + 1]);
    }
    bool touches = true;
    for (int repair = 0; repair < kRepairs && touches; ++repair) {
      touches = false;
      for (std::size_t i = 1; i < next.size(); ++i) {
        if (check.sweep_free(next[i - 1], next[i])) continue;
        touches = true;
        for (const std::size_t k : {i - 1, i}) {
          next[k] = path_m[k];
          pinned[k] = true;
        }
      }
    }
    if (touches) return path_m;
    path_m = next;
  }
  return path_m;
}

}  // namespace stairwell::planning3d
