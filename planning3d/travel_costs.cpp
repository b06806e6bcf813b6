#include "planning3d/travel_costs.hpp"

#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace stairwell::planning3d {

namespace {

constexpr float kImpassable = -1.0F;
constexpr std::uint8_t kSource = kGridMoves.size();
constexpr double kSnap_m = 0.3;  // a source just inside an obstacle's margin counts as beside it

struct Step {
  std::ptrdiff_t offset;
  float length;
  std::uint8_t direction;
};

/// Moves worth trying from a cell that was entered by `direction`: a neighbour that also touches the cell before
/// was reached from there already, and no longer way (triangle inequality; there is no corner rule).
std::array<std::vector<Step>, 27> useful_steps(std::ptrdiff_t row, std::ptrdiff_t slab) {
  std::array<std::vector<Step>, 27> steps;
  for (std::size_t from = 0; from < steps.size(); ++from) {
    for (std::size_t to = 0; to < kGridMoves.size(); ++to) {
      const GridMove& m = kGridMoves[to];
      if (from < kSource) {
        const GridMove& p = kGridMoves[from];
        if (std::abs(m.x + p.x) <= 1 && std::abs(m.y + p.y) <= 1 && std::abs(m.z + p.z) <= 1) continue;
      }
      steps[from].push_back({m.x + m.y * row + m.z * slab, m.length, static_cast<std::uint8_t>(to)});
    }
  }
  return steps;
}

}  // namespace

struct TravelCosts::Steps {
  std::array<std::vector<Step>, 27> after;
};

TravelCosts::TravelCosts(int stride) : own_(stride) {}
TravelCosts::~TravelCosts() = default;
TravelCosts::TravelCosts(TravelCosts&&) noexcept = default;
TravelCosts& TravelCosts::operator=(TravelCosts&&) noexcept = default;

void TravelCosts::resize(const PassableLattice& lattice) {
  if (!cost_.empty() && lattice.frame() == frame_) return;
  frame_ = lattice.frame();
  direction_.assign(frame_.cell_count(), kSource);
  const auto row = static_cast<std::ptrdiff_t>(frame_.size[0]);
  steps_ = std::make_unique<Steps>(Steps{useful_steps(row, row * frame_.size[1])});
}

void TravelCosts::lower(std::size_t cell, float cost, std::uint8_t direction) {
  const float before = cost_[cell];
  const auto bucket = static_cast<std::uint32_t>(cost);
  cost_[cell] = cost;
  direction_[cell] = direction;
  if (before != kUnreachable && static_cast<std::uint32_t>(before) == bucket) return;  // waits there already
  buckets_[bucket % 3].push_back(static_cast<std::uint32_t>(cell));
}

// No move is shorter than a bucket is wide (one cell), so a bucket's costs are final when its turn comes, and no
// move is longer than two buckets: three of them in a ring are enough.
void TravelCosts::spread_volume(float limit_cells) {
  std::uint32_t turn = 0;
  for (int empty = 0; empty < 3; ++turn) {
    auto& bucket = buckets_[turn % 3];
    empty = bucket.empty() ? empty + 1 : 0;
    for (const std::uint32_t cell : bucket) {
      const float cost = cost_[cell];
      if (static_cast<std::uint32_t>(cost) != turn) continue;  // lowered since
      for (const Step& step : steps_->after[direction_[cell]]) {
        const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + step.offset);
        const float through = cost + step.length;
        if (through < cost_[next] && through <= limit_cells) lower(next, through, step.direction);
      }
    }
    bucket.clear();
  }
}

void TravelCosts::spread_slice(const PassableLattice& lattice, float limit_cells) {
  const std::vector<std::uint8_t>& flags = lattice.flags();
  std::uint32_t turn = 0;
  for (int empty = 0; empty < 3; ++turn) {
    auto& bucket = buckets_[turn % 3];
    empty = bucket.empty() ? empty + 1 : 0;
    for (const std::uint32_t cell : bucket) {
      const float cost = cost_[cell];
      if (static_cast<std::uint32_t>(cost) != turn) continue;
      for (const Step& step : steps_->after[kSource]) {
        const GridMove& move = kGridMoves[step.direction];
        const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + step.offset);
        const bool allowed =
            move.z == 0 ? (flags[cell] & flags[next] & PassableLattice::kLevel) != 0 : move.x == 0 && move.y == 0;
        const float through = cost + step.length;
        if (allowed && through < cost_[next] && through <= limit_cells) lower(next, through, step.direction);
      }
    }
    bucket.clear();
  }
}

void TravelCosts::compute(const FreeSpace& space, const Eigen::Vector3d& source_m, const MotionRule& rule,
                          double limit_m, PassableLattice* shared) {
  PassableLattice& lattice = shared != nullptr ? *shared : own_;
  lattice.update(space, rule);
  resize(lattice);
  cost_.resize(frame_.cell_count());
  std::transform(lattice.flags().begin(), lattice.flags().end(), cost_.begin(),
                 [](std::uint8_t flags) { return flags != 0 ? kUnreachable : kImpassable; });
  source_m_ = source_m;
  VoxelIndex source;
  if (!space.nearest_traversable(source_m, std::max(kSnap_m, 2.0 * frame_.grid.resolution_m()), source)) return;
  const double limit_cells = limit_m / (frame_.cell_voxels * frame_.grid.resolution_m());
  lower(frame_.cell_of(source), 0.0F, kSource);
  if (rule.kind == MotionRule::Kind::kSlice) {
    spread_slice(lattice, static_cast<float>(limit_cells));
  } else {
    spread_volume(static_cast<float>(limit_cells));
  }
}

float TravelCosts::distance_m(const VoxelIndex& v) const {
  if (cost_.empty() || !frame_.grid.contains(v)) return kUnreachable;
  const float cost = cost_[frame_.cell_of(v)];
  if (cost < 0.0F || cost == kUnreachable) return kUnreachable;
  return cost * static_cast<float>(frame_.cell_voxels * frame_.grid.resolution_m());
}

float TravelCosts::distance_m(const Eigen::Vector3d& point_m) const {
  if (cost_.empty() || !frame_.grid.box().contains(point_m)) return kUnreachable;
  return distance_m(frame_.grid.index_of(point_m));
}

std::vector<Eigen::Vector3d> TravelCosts::path_to(const Eigen::Vector3d& point_m) const {
  std::vector<Eigen::Vector3d> path_m;
  if (distance_m(point_m) == kUnreachable) return path_m;
  path_m.push_back(point_m);
  std::size_t cell = frame_.cell_of(frame_.grid.index_of(point_m));
  while (direction_[cell] != kSource) {
    const GridMove& m = kGridMoves[direction_[cell]];
    const auto row = static_cast<std::ptrdiff_t>(frame_.size[0]);
    cell = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) - (m.x + m.y * row + m.z * row * frame_.size[1]));
    if (direction_[cell] != kSource) path_m.push_back(frame_.center_of(cell));
  }
  path_m.push_back(source_m_);
  std::reverse(path_m.begin(), path_m.end());
  return path_m;
}

}  // namespace stairwell::planning3d
