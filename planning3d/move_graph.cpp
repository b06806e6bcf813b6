#include "planning3d/move_graph.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <string>
#include <unordered_map>

namespace stairwell::planning3d {

namespace {

constexpr std::size_t kMoves = kGridMoves.size();
constexpr std::size_t kMostCells = std::size_t{1} << 30;
constexpr std::uint32_t kAllFree = (1U << 27) - 1;

/// Bit of a cell among the 27 around (0,0,0).
std::uint32_t bit_of(const VoxelIndex& v) { return 1U << ((v.z + 1) * 9 + (v.y + 1) * 3 + v.x + 1); }

bool within(const VoxelIndex& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) <= 1; }

std::uint32_t cost_of(const VoxelIndex& step) {
  return MoveGraph::kCost[static_cast<std::size_t>(step.x * step.x + step.y * step.y + step.z * step.z)];
}

/// The cells that a move from a to b sweeps.
std::uint32_t swept(const VoxelIndex& a, const VoxelIndex& b) {
  std::uint32_t cells = 0;
  for (int z = std::min(a.z, b.z); z <= std::max(a.z, b.z); ++z) {
    for (int y = std::min(a.y, b.y); y <= std::max(a.y, b.y); ++y) {
      for (int x = std::min(a.x, b.x); x <= std::max(a.x, b.x); ++x) cells |= bit_of({x, y, z});
    }
  }
  return cells;
}

/// What there is to know about moves before a map is seen.
struct LocalMoves {
  std::array<std::uint32_t, kMoves> swept_by{};
  /// [came by][next]: sets of cells; if all cells of one are free, the pair of moves is not needed.
  std::array<std::array<std::vector<std::uint32_t>, kMoves>, kMoves> better;

  LocalMoves() {
    for (std::size_t d = 0; d < kMoves; ++d) swept_by[d] = swept({0, 0, 0}, step(d));
    for (std::size_t d = 0; d < kMoves; ++d) {
      for (std::size_t n = 0; n < kMoves; ++n) fill(d, n);
    }
  }

  static VoxelIndex step(std::size_t move) { return {kGridMoves[move].x, kGridMoves[move].y, kGridMoves[move].z}; }
  static std::size_t move_of(const VoxelIndex& step) {
    const int place = (step.z + 1) * 9 + (step.y + 1) * 3 + step.x + 1;
    return static_cast<std::size_t>(place > 13 ? place - 1 : place);
  }
  /// Longer moves first, then by place in the table.
  static bool earlier(std::size_t a, std::size_t b) {
    const std::uint32_t cost_a = cost_of(step(a)), cost_b = cost_of(step(b));
    return cost_a != cost_b ? cost_a > cost_b : a < b;
  }

 private:
  void fill(std::size_t d, std::size_t n) {
    const VoxelIndex from = VoxelIndex{} - step(d);
    const VoxelIndex to = step(n);
    const std::uint32_t cost = cost_of(step(d)) + cost_of(to);
    std::vector<std::uint32_t>& sets = better[d][n];
    if (from == to) {
      sets.push_back(0);  // back again
      return;
    }
    if (within(to - from)) sets.push_back(swept(from, to));
    for (std::size_t m = 0; m < kMoves; ++m) {
      const VoxelIndex by = step(m);
      if (by == from || by == to || !within(by - from) || !within(to - by)) continue;
      const std::uint32_t other = cost_of(by - from) + cost_of(to - by);
      if (other < cost || (other == cost && earlier(move_of(by - from), d))) {
        sets.push_back(swept(from, by) | swept(by, to));
      }
    }
  }
};

const LocalMoves& local_moves() {
  static const LocalMoves kMovesOnce;
  return kMovesOnce;
}

std::uint32_t legal_moves(std::uint32_t free) {
  std::uint32_t legal = 0;
  for (std::size_t n = 0; n < kMoves; ++n) {
    if ((local_moves().swept_by[n] & ~free) == 0) legal |= 1U << n;
  }
  return legal;
}

std::uint32_t worth_making(std::uint32_t free, std::uint32_t legal, std::size_t from) {
  std::uint32_t kept = 0;
  for (std::size_t n = 0; n < kMoves; ++n) {
    if ((legal >> n & 1U) == 0) continue;
    const auto& sets = local_moves().better[from][n];
    const bool needless = std::ranges::any_of(sets, [free](std::uint32_t cells) { return (cells & ~free) == 0; });
    if (!needless) kept |= 1U << n;
  }
  return kept;
}

}  // namespace

MoveGraph::MoveGraph(const std::array<int, 3>& size, const std::vector<std::uint8_t>& free) : size_(size) {
  std::size_t cells = 1, padded_cells = 1;
  for (const int edge : size) {
    if (edge < 1) throw InputError("a lattice needs at least one cell along each axis");
    cells *= static_cast<std::size_t>(edge);
    padded_cells *= static_cast<std::size_t>(edge) + 2;
    if (padded_cells > kMostCells) throw InputError("the lattice has too many cells (more than 2^30)");
  }
  if (free.size() != cells) throw InputError("a lattice of " + std::to_string(cells) + " cells needs a byte for each");
  stride_x_ = static_cast<std::size_t>(size[0]) + 2;
  stride_y_ = static_cast<std::size_t>(size[1]) + 2;
  for (std::size_t m = 0; m < kMoves; ++m) {
    const GridMove& move = kGridMoves[m];
    offset_[m] =
        move.x + static_cast<std::int32_t>(stride_x_) * (move.y + static_cast<std::int32_t>(stride_y_) * move.z);
  }
  std::vector<std::uint8_t> padded(padded_cells, 0);
  std::size_t i = 0;
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) padded[cell_of({x, y, z})] = free[i++] != 0 ? 1 : 0;
    }
  }

  pattern_.assign(padded_cells, kBlocked);
  rows_.emplace_back().fill(0);
  std::unordered_map<std::uint32_t, std::uint32_t> known;
  for (std::size_t cell = 0; cell < padded_cells; ++cell) {
    if (padded[cell] == 0) continue;
    const std::uint32_t local = around(padded, cell);
    const auto [entry, fresh] = known.try_emplace(local, 0);
    if (fresh) {
      const std::uint32_t legal = legal_moves(local);
      if (rows_.size() < kMostRows) {
        entry->second = static_cast<std::uint32_t>(rows_.size());
        Row& row = rows_.emplace_back();
        for (std::size_t from = 0; from < kMoves; ++from) row[from] = worth_making(local, legal, from);
        row[kStart] = legal;
      } else {
        entry->second = legal | kLiteral;
      }
    }
    pattern_[cell] = entry->second;
  }
}

std::uint32_t MoveGraph::around(const std::vector<std::uint8_t>& padded, std::size_t cell) const {
  std::uint32_t bits = 0;
  unsigned shift = 0;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      const auto jump = static_cast<std::ptrdiff_t>(stride_x_) * (y + static_cast<std::ptrdiff_t>(stride_y_) * z);
      const std::uint8_t* row = padded.data() + static_cast<std::ptrdiff_t>(cell) + jump - 1;
      bits |= static_cast<std::uint32_t>(row[0] | row[1] << 1 | row[2] << 2) << shift;
      shift += 3;
    }
  }
  return bits & kAllFree;
}

VoxelIndex MoveGraph::voxel_of(std::uint32_t cell) const {
  const auto width = static_cast<std::uint32_t>(stride_x_);
  const auto depth = static_cast<std::uint32_t>(stride_y_);
  const std::uint32_t row = cell / width;
  return {static_cast<int>(cell - row * width) - 1, static_cast<int>(row % depth) - 1,
          static_cast<int>(row / depth) - 1};
}

std::size_t MoveGraph::memory_bytes() const {
  return pattern_.size() * sizeof(std::uint32_t) + rows_.size() * sizeof(Row);
}

}  // namespace stairwell::planning3d
