#include "planning3d/travel_costs.hpp"

#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

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

void TravelCosts::open_window(const PassableLattice& lattice, double limit_cells, bool with_flags) {
  const bool same_frame = lattice.frame() == frame_;
  frame_ = lattice.frame();
  const int at[3] = {source_.x, source_.y, source_.z};
  Window window;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int center = at[axis] / frame_.cell_voxels + 1;
    const int end = frame_.size[axis] - 1;
    const int reach = static_cast<int>(std::min(limit_cells, static_cast<double>(end)));
    window.lo[axis] = std::max(0, center - reach - 1);
    window.size[axis] = std::min(end, center + reach + 1) - window.lo[axis] + 1;
  }
  if (!same_frame || window.size != window_.size) {
    const auto row = static_cast<std::ptrdiff_t>(window.size[0]);
    steps_ = std::make_unique<Steps>(Steps{useful_steps(row, row * window.size[1])});
  }
  window_ = window;
  direction_.resize(window_.cell_count());
  cost_.resize(window_.cell_count());
  flags_.resize(with_flags ? window_.cell_count() : 0);
  const auto columns = static_cast<std::size_t>(window_.size[0]);
  const auto on_border = [this](int border, std::size_t axis) {
    return border == window_.lo[axis] || border == window_.lo[axis] + window_.size[axis] - 1;
  };
  for (int z = window_.lo[2]; z < window_.lo[2] + window_.size[2]; ++z) {
    for (int y = window_.lo[1]; y < window_.lo[1] + window_.size[1]; ++y) {
      const std::size_t row = window_.row(y, z);
      float* const costs = cost_.data() + row;
      if (on_border(y, 1) || on_border(z, 2)) {
        std::fill(costs, costs + columns, kImpassable);
        continue;
      }
      const std::size_t frame_row =
          (static_cast<std::size_t>(z) * static_cast<std::size_t>(frame_.size[1]) + static_cast<std::size_t>(y)) *
          static_cast<std::size_t>(frame_.size[0]);
      const std::uint8_t* const flags = lattice.flags().data() + frame_row + static_cast<std::size_t>(window_.lo[0]);
      costs[0] = costs[columns - 1] = kImpassable;
      for (std::size_t x = 1; x + 1 < columns; ++x) costs[x] = flags[x] != 0 ? kUnreachable : kImpassable;
      if (with_flags) std::copy(flags + 1, flags + columns - 1, flags_.begin() + static_cast<std::ptrdiff_t>(row + 1));
    }
  }
}

std::size_t TravelCosts::cell_of(const VoxelIndex& v) const {
  const int x = v.x / frame_.cell_voxels + 1;
  const int y = v.y / frame_.cell_voxels + 1;
  const int z = v.z / frame_.cell_voxels + 1;
  const auto within = [this](int at, std::size_t axis) {  // the border is nobody's
    return at > window_.lo[axis] && at < window_.lo[axis] + window_.size[axis] - 1;
  };
  const bool inside = within(x, 0) && within(y, 1) && within(z, 2);
  return inside ? window_.row(y, z) + static_cast<std::size_t>(x - window_.lo[0]) : kOutside;
}

std::size_t TravelCosts::frame_cell(std::size_t cell) const {
  const auto nx = static_cast<std::size_t>(window_.size[0]);
  const auto ny = static_cast<std::size_t>(window_.size[1]);
  const std::size_t x = cell % nx + static_cast<std::size_t>(window_.lo[0]);
  const std::size_t y = cell / nx % ny + static_cast<std::size_t>(window_.lo[1]);
  const std::size_t z = cell / (nx * ny) + static_cast<std::size_t>(window_.lo[2]);
  return (z * static_cast<std::size_t>(frame_.size[1]) + y) * static_cast<std::size_t>(frame_.size[0]) + x;
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

void TravelCosts::spread_slice(float limit_cells) {
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
            move.z == 0 ? (flags_[cell] & flags_[next] & PassableLattice::kLevel) != 0 : move.x == 0 && move.y == 0;
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
  if (!std::isfinite(limit_m)) graph_ = nullptr;
  limit_m_ = limit_m;
  source_m_ = source_m;
  if (!space.nearest_traversable(source_m, std::max(kSnap_m, 2.0 * space.grid().resolution_m()), source_)) {
    cost_.clear();
    return;
  }
  const double limit_cells = limit_m / (lattice.frame().cell_voxels * lattice.frame().grid.resolution_m());
  open_window(lattice, limit_cells, rule.kind == MotionRule::Kind::kSlice);
  lower(cell_of(source_), 0.0F, kSource);
  if (rule.kind == MotionRule::Kind::kSlice) {
    spread_slice(static_cast<float>(limit_cells));
  } else {
    spread_volume(static_cast<float>(limit_cells));
  }
}

std::shared_ptr<const std::vector<float>> TravelCosts::estimate_beyond(
    const RegionGraph& graph, std::shared_ptr<const std::vector<float>> lengths) {
  graph_ = nullptr;
  lengths_ = nullptr;
  if (cost_.empty()) return nullptr;
  const std::uint32_t part = graph.part_of(source_);
  if (part == RegionGraph::kNone) return nullptr;
  if (lengths == nullptr) {
    auto found = std::make_shared<std::vector<float>>();
    graph.lengths_from(part, *found);
    lengths = std::move(found);
  }
  graph_ = &graph;
  lengths_ = std::move(lengths);
  return lengths_;
}

float TravelCosts::beyond_m(const VoxelIndex& v) const {
  const std::uint32_t part = graph_->part_of(v);
  if (part >= lengths_->size()) return kUnreachable;  // impassable, or come since
  return std::max((*lengths_)[part] * static_cast<float>(cell_m()), static_cast<float>(limit_m_));
}

float TravelCosts::distance_m(const VoxelIndex& v) const {
  if (cost_.empty() || !frame_.grid.contains(v)) return kUnreachable;
  const std::size_t cell = cell_of(v);
  const float cost = cell == kOutside ? kUnreachable : cost_[cell];
  if (cost < 0.0F) return kUnreachable;
  if (cost == kUnreachable) return graph_ == nullptr ? kUnreachable : beyond_m(v);
  return cost * static_cast<float>(cell_m());
}

float TravelCosts::distance_m(const Eigen::Vector3d& point_m) const {
  if (cost_.empty() || !frame_.grid.box().contains(point_m)) return kUnreachable;
  return distance_m(frame_.grid.index_of(point_m));
}

std::vector<Eigen::Vector3d> TravelCosts::path_to(const Eigen::Vector3d& point_m) const {
  std::vector<Eigen::Vector3d> path_m;
  if (cost_.empty() || !frame_.grid.box().contains(point_m)) return path_m;
  std::size_t cell = cell_of(frame_.grid.index_of(point_m));
  if (cell == kOutside || cost_[cell] < 0.0F || cost_[cell] == kUnreachable) return path_m;
  path_m.push_back(point_m);
  while (direction_[cell] != kSource) {
    const GridMove& m = kGridMoves[direction_[cell]];
    const auto row = static_cast<std::ptrdiff_t>(window_.size[0]);
    cell =
        static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) - (m.x + m.y * row + m.z * row * window_.size[1]));
    if (direction_[cell] != kSource) path_m.push_back(frame_.center_of(frame_cell(cell)));
  }
  path_m.push_back(source_m_);
  std::reverse(path_m.begin(), path_m.end());
  return path_m;
}

}  // namespace stairwell::planning3d
