#include "planning3d/agent_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr double kSpacing_m = 0.06;  // of the places where the room along a line is asked for
constexpr double kGive_m = 0.005;    // so much nearer to obstacles than before is no loss

double least_room_m(const FreeSpace& space, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const int pieces = std::max(1, static_cast<int>(std::ceil((to_m - from_m).norm() / kSpacing_m)));
  double room_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= pieces; ++i) {
    room_m = std::min(room_m, space.room_m(from_m + static_cast<double>(i) / pieces * (to_m - from_m)));
  }
  return room_m;
}

/// A path's corner, and the room that the leg to it has to leave.
struct Corner {
  Eigen::Vector3d at_m;
  double room_before_m;
};

bool may_be(const SegmentCheck& check, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double room_m,
            double comfort_m) {
  if (check.sweep_free(from_m, to_m, comfort_m)) return true;
  return least_room_m(check.space(), from_m, to_m) >= room_m && check.sweep_free(from_m, to_m);
}

/// From each point on to one that can be flown to straight, as far on as that goes.
std::vector<Corner> corners(const SegmentCheck& check, const std::vector<Eigen::Vector3d>& path_m, double comfort_m) {
  constexpr std::size_t kMisses = 6;  // around round corners sight comes and goes
  std::vector<double> room_m;         // of each leg
  for (std::size_t i = 1; i < path_m.size(); ++i) {
    room_m.push_back(least_room_m(check.space(), path_m[i - 1], path_m[i]) - kGive_m);
  }
  std::vector<Corner> kept{{path_m.front(), 0.0}};
  for (std::size_t i = 0; i + 1 < path_m.size();) {
    std::size_t reach = i + 1;
    double along_m = room_m[i], reached_m = along_m;
    for (std::size_t j = i + 2; j < path_m.size() && j - reach <= kMisses; ++j) {
      along_m = std::min(along_m, room_m[j - 1]);
      if (!may_be(check, path_m[i], path_m[j], along_m, comfort_m)) continue;
      reach = j;
      reached_m = along_m;
    }
    kept.push_back({path_m[reach], reached_m});
    i = reach;
  }
  return kept;
}

/// Leaves out corners that are not needed, draws the others in towards the line between their neighbours.
void draw_in(const SegmentCheck& check, std::vector<Corner>& path, double comfort_m) {
  for (std::size_t k = 1; k + 1 < path.size();) {
    const Eigen::Vector3d before_m = path[k - 1].at_m, after_m = path[k + 1].at_m, here_m = path[k].at_m;
    const double least_m = std::min(path[k].room_before_m, path[k + 1].room_before_m);
    if (may_be(check, before_m, after_m, least_m, comfort_m)) {
      path[k + 1].room_before_m = least_m;
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(k));
      continue;
    }
    const Eigen::Vector3d line = (after_m - before_m).normalized();
    const Eigen::Vector3d foot_m = before_m + line * (here_m - before_m).dot(line);
    for (double part = 0.5; part > 0.05; part *= 0.5) {
      const Eigen::Vector3d to_m = path[k].at_m + part * (foot_m - here_m);
      if (may_be(check, before_m, to_m, path[k].room_before_m, comfort_m) &&
          may_be(check, to_m, after_m, path[k + 1].room_before_m, comfort_m)) {
        path[k].at_m = to_m;
      }
    }
    ++k;
  }
}

std::vector<Eigen::Vector3d> subdivided(const std::vector<Eigen::Vector3d>& path_m) {
  constexpr double kStep_m = 0.12;
  std::vector<Eigen::Vector3d> points_m{path_m.front()};
  for (std::size_t i = 1; i < path_m.size(); ++i) {
    const Eigen::Vector3d leg_m = path_m[i] - path_m[i - 1];
    const int pieces = std::max(1, static_cast<int>(std::ceil(leg_m.norm() / kStep_m)));
    for (int k = 1; k <= pieces; ++k) {
      points_m.emplace_back(k == pieces ? path_m[i] : path_m[i - 1] + static_cast<double>(k) / pieces * leg_m);
    }
  }
  return points_m;
}

}  // namespace

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

std::vector<Eigen::Vector3d> straighten_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m,
                                             double comfort_m) {
  constexpr int kRounds = 4;
  if (path_m.size() < 3) return path_m;
  for (int pass = 0; pass < 2; ++pass) {  // there and back: the corners found first are the freest
    std::vector<Corner> path = corners(check, subdivided(path_m), comfort_m);
    for (int round = 0; round < kRounds; ++round) draw_in(check, path, comfort_m);
    path_m.clear();
    for (const Corner& corner : path) path_m.insert(path_m.begin(), corner.at_m);
  }
  return path_m;
}

}  // namespace stairwell::planning3d
