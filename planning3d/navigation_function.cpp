#include "planning3d/navigation_function.hpp"

#include "planning3d/cost_tables.hpp"
#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr std::uint8_t kNoMove = kGridMoves.size();
constexpr float kBeyond_m = 0.5F;  // past `until`, so that it can be interpolated there
constexpr std::size_t kClockEvery = 1024;

}  // namespace

struct NavigationFunction::Wave {
  const FreeSpace& space;
  const SegmentCheck& check;
  const Source& source;
  HeightRange heights;

  float hill(const VoxelIndex& v) const { return source.hill ? static_cast<float>(source.hill(v)) : 0.0F; }
  float length(const GridMove& move) const {
    return move.length * static_cast<float>(source.per_metre * space.grid().resolution_m());
  }
};

PlanStatus NavigationFunction::compute(const FreeSpace& space, const PlanRequest& request, const SegmentCheck& check,
                                       const Source& source) {
  slice_ = request.rule.kind == MotionRule::Kind::kSlice;
  level_ = level_table(space.grid(), request.rule);
  nodes_.renew(space.grid());
  const int until_z = source.until ? source.until->z : source.goal.z;
  const HeightRange heights =
      source.until ? useful_heights(level_, source.goal.z, until_z) : HeightRange{0, space.grid().size()[2] - 1};
  const Wave wave{space, check, source, heights};
  const auto first = static_cast<std::uint32_t>(space.grid().linear(source.goal));
  nodes_[first] = {0.0F, wave.hill(source.goal), nodes_.stamp(), kNoMove, false};
  nodes_.push({0.0F, 0.0F, first});
  float limit = std::numeric_limits<float>::infinity();
  bool timed_out = false;
  for (expansions_ = 0; !nodes_.nothing_open() && !timed_out;) {
    const OpenVoxel best = nodes_.pop_best();
    Node& node = nodes_[best.cell];
    if (node.closed || best.g > node.cost) continue;
    if (best.g > limit) break;
    const bool late = expansions_ % kClockEvery == 0 && request.late();
    timed_out = late || expansions_++ >= request.max_expansions;
    node.closed = true;
    if (source.until && space.grid().voxel(best.cell) == *source.until) {
      limit = best.g + kBeyond_m * static_cast<float>(source.per_metre);
    }
    expand(wave, best.cell);
  }
  nodes_.count(expansions_);
  if (timed_out) return PlanStatus::kTimedOut;
  const bool arrived = !source.until || at(*source.until) != kUnreachable;
  return arrived ? PlanStatus::kReached : PlanStatus::kNoPath;
}

void NavigationFunction::expand(const Wave& wave, std::uint32_t cell) {
  const GridSpec& grid = wave.space.grid();
  const VoxelIndex v = grid.voxel(cell);
  const Node here = nodes_[cell];
  const bool roomy = wave.check.roomy(v);
  for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
    const GridMove& move = kGridMoves[m];
    if (slice_ && (move.z == 0 ? !level(v.z) : move.x != 0 || move.y != 0)) continue;
    const VoxelIndex to = v + VoxelIndex{move.x, move.y, move.z};
    if (!wave.heights.contains(to.z) || !wave.check.voxel_free(to)) continue;
    const auto next = static_cast<std::uint32_t>(grid.linear(to));
    Node& there = nodes_[next];
    const bool seen = nodes_.seen(there);
    if (seen && there.closed) continue;
    const float hill = seen ? there.hill : wave.hill(to);
    const float cost = here.cost + wave.length(move) + std::max(0.0F, here.hill - hill);
    if (seen && cost >= there.cost) continue;
    // Two places that fit do not make the diagonal between them fit where it is tight.
    if (move.length > 1.0F && !roomy && !wave.check.roomy(to) &&
        !wave.check.fits(0.5 * (grid.center_of(v) + grid.center_of(to)))) {
      continue;
    }
    there = {cost, hill, nodes_.stamp(), static_cast<std::uint8_t>(m), false};
    nodes_.push({cost, cost, next});
  }
}

double NavigationFunction::at(const VoxelIndex& v) const {
  if (!nodes_.grid().contains(v)) return kUnreachable;
  const Node& node = nodes_[nodes_.grid().linear(v)];
  return nodes_.seen(node) && node.closed ? static_cast<double>(node.cost) : kUnreachable;
}

double NavigationFunction::value(const Eigen::Vector3d& point_m) const {
  const GridSpec& grid = nodes_.grid();
  const VoxelIndex inside = grid.index_of(point_m);
  if (at(inside) == kUnreachable) return kUnreachable;
  VoxelIndex low = grid.index_of(point_m - Eigen::Vector3d::Constant(0.5 * grid.resolution_m()));
  Eigen::Vector3d u = (point_m - grid.center_of(low)) / grid.resolution_m();
  if (slice_) {
    low.z = inside.z;
    u.z() = 0.0;
  }
  double sum = 0.0;
  double weights = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const double weight = ((corner & 1) != 0 ? u.x() : 1.0 - u.x()) * ((corner & 2) != 0 ? u.y() : 1.0 - u.y()) *
                          ((corner & 4) != 0 ? u.z() : 1.0 - u.z());
    const double there = weight > 0.0 ? at(low + VoxelIndex{corner & 1, corner >> 1 & 1, corner >> 2 & 1}) : 0.0;
    if (weight <= 0.0 || there == kUnreachable) continue;
    sum += weight * there;
    weights += weight;
  }
  return weights > 1e-9 ? sum / weights : at(inside);
}

std::optional<VoxelIndex> NavigationFunction::next(const VoxelIndex& v) const {
  if (at(v) == kUnreachable) return std::nullopt;
  const std::uint8_t move = nodes_[nodes_.grid().linear(v)].move;
  if (move == kNoMove) return std::nullopt;
  return v - VoxelIndex{kGridMoves[move].x, kGridMoves[move].y, kGridMoves[move].z};
}

}  // namespace stairwell::planning3d
