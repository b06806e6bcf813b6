#include "planning3d/layer_graph.hpp"

#include "planning3d/cost_tables.hpp"
#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace stairwell::planning3d {

namespace {

constexpr float kOtherLayer = 1.02F;  // price of layers between, over that of the start's and the goal's
constexpr std::size_t kClockEvery = 1024;
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

}  // namespace

struct LayerGraph::Node {
  float cost = std::numeric_limits<float>::infinity();  ///< voxel lengths
  std::uint32_t from = kNowhere;
};

struct LayerGraph::Search {
  using Entry = std::pair<float, std::uint32_t>;
  std::vector<Node> nodes;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;

  void offer(std::uint32_t to, float cost, std::uint32_t from) {
    if (cost >= nodes[to].cost) return;
    nodes[to] = {cost, from};
    open.push({cost, to});
  }
};

LayerGraph::LayerGraph(const FreeSpace& space, const SegmentCheck& check, const MotionRule& rule,
                       const VoxelIndex& start, const VoxelIndex& goal)
    : space_(space), check_(check), start_(start), goal_(goal) {
  const std::vector<std::uint8_t> level = level_table(space.grid(), rule);
  for (int z = 0; z < static_cast<int>(level.size()); ++z) {
    const bool end = z == start.z || z == goal.z;
    const bool horizontal = level[static_cast<std::size_t>(z)] != 0;
    if (end || horizontal) floors_.push_back({z, horizontal, end ? 1.0F : kOtherLayer});
  }
}

std::uint32_t LayerGraph::node_of(std::size_t floor, int x, int y) const {
  const auto& size = space_.grid().size();
  return static_cast<std::uint32_t>((floor * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
                                        static_cast<std::size_t>(size[0]) +
                                    static_cast<std::size_t>(x));
}

VoxelIndex LayerGraph::voxel_of(std::uint32_t node) const {
  const auto nx = static_cast<std::uint32_t>(space_.grid().size()[0]);
  const auto ny = static_cast<std::uint32_t>(space_.grid().size()[1]);
  return {static_cast<int>(node % nx), static_cast<int>(node / nx % ny), floors_[node / (nx * ny)].z};
}

std::size_t LayerGraph::floor_of(int z) const {
  const auto floor = std::find_if(floors_.begin(), floors_.end(), [z](const Floor& f) { return f.z == z; });
  return static_cast<std::size_t>(floor - floors_.begin());
}

bool LayerGraph::open(const VoxelIndex& from, int to_z) const {
  const int step = to_z > from.z ? 1 : -1;
  for (int z = from.z;; z += step) {
    if (!check_.voxel_free({from.x, from.y, z})) return false;
    if (z == to_z) return true;
  }
}

void LayerGraph::expand(Search& search, std::uint32_t node) const {
  const VoxelIndex v = voxel_of(node);
  const std::size_t floor = floor_of(v.z);
  const float cost = search.nodes[node].cost;
  for (const GridMove& move : kGridMoves) {
    const VoxelIndex to = v + VoxelIndex{move.x, move.y, 0};
    if (move.z != 0 || !floors_[floor].level || !check_.voxel_free(to)) continue;
    // Two places that fit do not make the diagonal between them fit where it is tight.
    if (move.length > 1.0F && !check_.roomy(v) &&
        !check_.fits(0.5 * (space_.grid().center_of(v) + space_.grid().center_of(to)))) {
      continue;
    }
    search.offer(node_of(floor, to.x, to.y), cost + floors_[floor].price * move.length, node);
  }
  for (const std::size_t next : {floor - 1, floor + 1}) {
    if (next >= floors_.size() || !open(v, floors_[next].z)) continue;
    search.offer(node_of(next, v.x, v.y), cost + static_cast<float>(std::abs(floors_[next].z - v.z)), node);
  }
}

LayerGraph::Route LayerGraph::route(const PlanRequest& limits) const {
  Route found;
  Search search;
  search.nodes.resize(node_of(floors_.size(), 0, 0));
  const std::uint32_t last = node_of(floor_of(goal_.z), goal_.x, goal_.y);
  search.offer(node_of(floor_of(start_.z), start_.x, start_.y), 0.0F, kNowhere);
  while (!search.open.empty()) {
    const auto [cost, node] = search.open.top();
    search.open.pop();
    if (cost > search.nodes[node].cost) continue;
    if (node == last) {
      found.status = PlanStatus::kReached;
      found.legs = trace(search, last);
      return found;
    }
    const bool late = found.expansions % kClockEvery == 0 && limits.late();
    if (late || found.expansions++ >= limits.max_expansions) {
      found.status = PlanStatus::kTimedOut;
      return found;
    }
    expand(search, node);
  }
  return found;
}

std::vector<LayerGraph::Leg> LayerGraph::trace(const Search& search, std::uint32_t last) const {
  std::vector<VoxelIndex> way;
  for (std::uint32_t node = last; node != kNowhere; node = search.nodes[node].from) way.push_back(voxel_of(node));
  std::reverse(way.begin(), way.end());
  std::vector<Leg> legs{{way.front(), way.front()}};
  for (const VoxelIndex& v : way) {
    const VoxelIndex before = legs.back().to;
    if (v == before) continue;
    const bool level = v.z == before.z;
    if (level != legs.back().level()) legs.push_back({before, before});
    legs.back().to = v;
  }
  if (!legs.back().level()) legs.push_back({way.back(), way.back()});
  return legs;
}

}  // namespace stairwell::planning3d
