#include "apps/known_roads.hpp"

#include "planning3d/astar_planner.hpp"
#include "planning3d/segment_check.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace stairwell::apps {

namespace {

constexpr double kFar_m = 8.0;           // farther points are not tried for a straight way
constexpr std::size_t kNeighbours = 40;  // nearest points in sight that a way may go to next
constexpr float kNoWay_s = std::numeric_limits<float>::infinity();

/// [point]: a number for all that are connected.
std::vector<std::size_t> components(const std::vector<std::vector<std::uint32_t>>& beside) {
  std::vector<std::size_t> component(beside.size(), beside.size());
  for (std::size_t first = 0; first < beside.size(); ++first) {
    if (component[first] != beside.size()) continue;
    std::vector<std::size_t> open{first};
    component[first] = first;
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      for (const std::uint32_t next : beside[at]) {
        if (component[next] != beside.size()) continue;
        component[next] = first;
        open.push_back(next);
      }
    }
  }
  return component;
}

}  // namespace

KnownRoads::KnownRoads(const planning3d::FreeSpace& space, const MotionLimits& limits,
                       std::vector<Eigen::Vector3d> points_m, std::size_t starts)
    : limits_(limits), point_m_(std::move(points_m)) {
  find_straights(space);
  connect(space, starts);
  const std::size_t count = point_m_.size();
  cruise_s_.assign(count * count, kNoWay_s);
  before_.assign(count * count, 0);
  for (std::size_t source = 0; source < count; ++source) find_ways_from(source);
}

double KnownRoads::straight_s(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const {
  const Eigen::Vector3d offset_m = to_m - from_m;
  const double length_m = offset_m.norm();
  return length_m > 0.0 ? length_m / (limits_.speed_mps * limits_.stretch(offset_m)) : 0.0;
}

void KnownRoads::find_straights(const planning3d::FreeSpace& space) {
  const std::size_t count = point_m_.size();
  straight_.assign((count * count + 63) / 64, 0);
  std::vector<std::vector<std::pair<double, std::uint32_t>>> in_sight(count);
  const planning3d::SegmentCheck check(space, {}, Eigen::Vector3d::Zero());
  const auto mark = [&](std::size_t a, std::size_t b, double apart_m) {
    straight_[(a * count + b) / 64] |= std::uint64_t{1} << ((a * count + b) % 64);
    in_sight[a].emplace_back(apart_m, static_cast<std::uint32_t>(b));
  };
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) {
      const double apart_m = (point_m_[b] - point_m_[a]).norm();
      if (apart_m > kFar_m || !check.sweep_free(point_m_[a], point_m_[b])) continue;
      mark(a, b, apart_m);
      mark(b, a, apart_m);
    }
  }
  beside_.assign(count, {});
  for (std::size_t a = 0; a < count; ++a) {
    std::ranges::sort(in_sight[a]);
    for (std::size_t i = 0; i < std::min(kNeighbours, in_sight[a].size()); ++i) {
      beside_[a].push_back(in_sight[a][i].second);
      beside_[in_sight[a][i].second].push_back(static_cast<std::uint32_t>(a));
    }
  }
  for (auto& neighbours : beside_) {
    std::ranges::sort(neighbours);
    const auto repeats = std::ranges::unique(neighbours);
    neighbours.erase(repeats.begin(), repeats.end());
  }
}

/// Adds the corners of ways to what no straight way leads to.
void KnownRoads::connect(const planning3d::FreeSpace& space, std::size_t starts) {
  const std::size_t given = point_m_.size();
  const std::vector<std::size_t> component = components(beside_);
  planning3d::AstarPlanner planner;
  std::vector<std::size_t> reached;
  for (std::size_t k = given - starts; k < given; ++k) reached.push_back(component[k]);
  for (std::size_t point = 0; point < given; ++point) {
    if (std::ranges::find(reached, component[point]) != reached.end()) continue;
    reached.push_back(component[point]);  // tried once
    planning3d::PlanRequest request;
    request.start_m = point_m_[given - starts];
    request.goal_m = point_m_[point];
    request.clearance_weight = 0.0;
    const planning3d::PlanResult result = planner.plan(space, request);
    if (result.status != planning3d::PlanStatus::kReached) continue;
    for (std::size_t i = 1; i + 1 < result.path_m.size(); ++i) {
      const Eigen::Vector3d part_m = result.path_m[i] - result.path_m[i - 1];
      const int parts = std::max(1, static_cast<int>(std::ceil(part_m.norm() / (0.5 * kFar_m))));
      for (int k = 1; k <= parts; ++k) point_m_.push_back(result.path_m[i - 1] + part_m * k / parts);
    }
  }
  if (point_m_.size() > given) find_straights(space);
}

/// Dijkstra over the neighbours, with the line-of-sight shortcut of Theta* (Nash et al. 2007).
void KnownRoads::find_ways_from(std::size_t source) {
  const std::size_t count = point_m_.size();
  float* cost_s = &cruise_s_[source * count];
  std::uint16_t* before = &before_[source * count];
  using Entry = std::pair<float, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost_s[source] = 0.0F;
  before[source] = static_cast<std::uint16_t>(source);
  open.emplace(0.0F, static_cast<std::uint32_t>(source));
  while (!open.empty()) {
    const auto [at_s, at] = open.top();
    open.pop();
    if (at_s > cost_s[at]) continue;
    for (const std::uint32_t next : beside_[at]) {
      const std::size_t from = before[at] == next || straight(before[at], next) ? before[at] : at;
      const float next_s = cost_s[from] + static_cast<float>(straight_s(point_m_[from], point_m_[next]));
      if (next_s >= cost_s[next]) continue;
      cost_s[next] = next_s;
      before[next] = static_cast<std::uint16_t>(from);
      open.emplace(next_s, next);
    }
  }
}

void KnownRoads::way(std::size_t from, std::size_t to, std::vector<std::uint32_t>& way) const {
  way.clear();
  if (cruise_s_[from * point_m_.size() + to] == kNoWay_s) return;
  way.push_back(static_cast<std::uint32_t>(to));
  for (std::size_t at = before_[from * point_m_.size() + to]; at != from; at = before_[from * point_m_.size() + at])
    way.push_back(static_cast<std::uint32_t>(at));
  way.push_back(static_cast<std::uint32_t>(from));
  std::ranges::reverse(way);
}

}  // namespace stairwell::apps
