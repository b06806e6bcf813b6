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
  if (!cost_.empty() && lattice.grid() == grid_ && lattice.size() == size_) return;
  grid_ = lattice.grid();
  cell_voxels_ = lattice.cell_voxels();
  size_ = lattice.size();
  direction_.assign(lattice.cell_count(), kSource);
  const auto row = static_cast<std::ptrdiff_t>(size_[0]);
  steps_ = std::make_unique<Steps>(Steps{useful_steps(row, row * size_[1])});
}

std::size_t TravelCosts::cell_of(const VoxelIndex& v) const {
  const auto x = static_cast<std::size_t>(v.x / cell_voxels_ + 1);
  const auto y = static_cast<std::size_t>(v.y / cell_voxels_ + 1);
  const auto z = static_cast<std::size_t>(v.z / cell_voxels_ + 1);
  return (z * static_cast<std::size_t>(size_[1]) + y) * static_cast<std::size_t>(size_[0]) + x;
}

Eigen::Vector3d TravelCosts::center_of_cell(std::size_t cell) const {
  const auto nx = static_cast<std::size_t>(size_[0]);
  const auto ny = static_cast<std::size_t>(size_[1]);
  const std::size_t row = cell / nx;
  const std::size_t layer = row / ny;
  const Eigen::Vector3d at(static_cast<double>(cell % nx), static_cast<double>(row % ny), static_cast<double>(layer));
  const double edge_m = cell_voxels_ * grid_.resolution_m();
  return grid_.box().min_m + (at - Eigen::Vector3d::Constant(0.5)) * edge_m;
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
  cost_.resize(lattice.cell_count());
  std::transform(lattice.flags().begin(), lattice.flags().end(), cost_.begin(),
                 [](std::uint8_t flags) { return flags != 0 ? kUnreachable : kImpassable; });
  source_m_ = source_m;
  VoxelIndex source;
  if (!space.nearest_traversable(source_m, std::max(kSnap_m, 2.0 * grid_.resolution_m()), source)) return;
  const double limit_cells = limit_m / (cell_voxels_ * grid_.resolution_m());
  lower(cell_of(source), 0.0F, kSource);
  if (rule.kind == MotionRule::Kind::kSlice) {
    spread_slice(lattice, static_cast<float>(limit_cells));
  } else {
    spread_volume(static_cast<float>(limit_cells));
  }
}

float TravelCosts::distance_m(const VoxelIndex& v) const {
  if (cost_.empty() || !grid_.contains(v)) return kUnreachable;
  const float cost = cost_[cell_of(v)];
  if (cost < 0.0F || cost == kUnreachable) return kUnreachable;
  return cost * static_cast<float>(cell_voxels_ * grid_.resolution_m());
}

float TravelCosts::distance_m(const Eigen::Vector3d& point_m) const {
  if (cost_.empty() || !grid_.box().contains(point_m)) return kUnreachable;
  return distance_m(grid_.index_of(point_m));
}

std::vector<Eigen::Vector3d> TravelCosts::path_to(const Eigen::Vector3d& point_m) const {
  std::vector<Eigen::Vector3d> path_m;
  if (distance_m(point_m) == kUnreachable) return path_m;
  path_m.push_back(point_m);
  std::size_t cell = cell_of(grid_.index_of(point_m));
  while (direction_[cell] != kSource) {
    const GridMove& m = kGridMoves[direction_[cell]];
    const auto row = static_cast<std::ptrdiff_t>(size_[0]);
    cell = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) - (m.x + m.y * row + m.z * row * size_[1]));
    if (direction_[cell] != kSource) path_m.push_back(center_of_cell(cell));
  }
  path_m.push_back(source_m_);
  std::reverse(path_m.begin(), path_m.end());
  return path_m;
}

}  // namespace stairwell::planning3d
