/// The repulsive kernel of one obstacle cell on a lattice, in whole numbers, and how it is added up.
#pragma once

#include "mapping/potential_volume.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::mapping {

/// Inclusive range of cells along one axis; empty when lo > hi.
struct CellRange {
  int lo = 0;
  int hi = -1;
  bool empty() const { return lo > hi; }
};

/// k_rep / (sigma sqrt(2 pi)) exp(-(d / sigma)^2 / 2) for d < d0, else 0 (thesis eq. 3.3), d between cell centres, as
/// whole multiples of `unit()`. Sums of whole numbers do not depend on their order and lose nothing when obstacles are
/// taken away again. The unit is the smallest power of two with which 2^30 holds the sum over a solid of obstacles.
class RepulsionKernel {
 public:
  static constexpr int kMaxReach_cells = 64;

  /// @throws InputError when reach_m is more than 64 cells. @pre config.problems().empty()
  RepulsionKernel(const PotentialConfig& config, double resolution_m);

  /// Largest offset along one axis that is still in reach; 0 when the reach ends before the next cell's centre.
  int reach_cells() const { return reach_; }
  double unit() const { return unit_; }
  /// The kernel at a squared distance in cells, in units; 0 out of reach.
  std::int32_t of_squared(int squared) const {
    return squared < static_cast<int>(by_squared_.size()) ? by_squared_[static_cast<std::size_t>(squared)] : 0;
  }
  /// Rows of the kernel along one axis are the same for all offsets (a, b) across it with the same a^2 + b^2: one
  /// class each. @return -1 out of reach. @pre 0 <= a, b <= reach_cells()
  int row_class(int a, int b) const {
    return row_class_[static_cast<std::size_t>(a) * static_cast<std::size_t>(reach_ + 1) + static_cast<std::size_t>(b)];
  }
  /// Largest b in reach beside a. @pre 0 <= a <= reach_cells()
  int width(int a) const { return width_[static_cast<std::size_t>(a)]; }
  int classes() const { return static_cast<int>(half_.size()); }
  /// The row runs from -half to half; zeros follow up to a multiple of 8 cells.
  int half(int row_class) const { return half_[static_cast<std::size_t>(row_class)]; }
  const std::int32_t* row(int row_class, bool negative) const {
    return rows_.data() + (static_cast<std::size_t>(row_class) * 2 + (negative ? 1 : 0)) * row_length();
  }

 private:
  std::size_t row_length() const { return static_cast<std::size_t>(2 * reach_ + 8) / 8 * 8; }

  int reach_ = 0;
  double unit_ = 1.0;
  std::vector<std::int32_t> by_squared_;
  std::vector<int> row_class_, width_, half_;
  std::vector<std::int32_t> rows_;  ///< per class: the row, and the row negated
};

/// Cells that kernels are added to, addressed by lattice coordinates (a, b, c) with c contiguous in memory. Each axis
/// wraps round: coordinate v lies at v mod size.
struct KernelTarget {
  struct Axis {
    CellRange clip;  ///< what is added to; at most `size` long
    int size = 0;
    std::ptrdiff_t stride = 0;
  };
  std::int32_t* cells = nullptr;
  Axis a, b, c;
  /// Per row, widened by what is added to: index (a mod size) * touched_a + (b mod size) * touched_b.
  CellRange* touched = nullptr;
  int touched_a = 0;
  int touched_b = 0;
};

/// Up to 64 obstacle cells in one row.
struct ObstacleRow {
  int a = 0;
  int b = 0;
  int c = 0;               ///< coordinate of bit 0
  std::uint64_t mask = 0;  ///< which cells are obstacles
};

/// Adds kernels, or takes them away.
class KernelSpreader {
 public:
  explicit KernelSpreader(const RepulsionKernel& kernel);

  /// Adds (or subtracts) the kernel of every obstacle of the row to the target. Cells along the row share their work.
  /// Allocates nothing.
  void spread(const RepulsionKernel& kernel, const ObstacleRow& row, bool subtract, const KernelTarget& target);

  /// The same for obstacles at (a, b, c), (a, b + 1, c), ... (a, b + count - 1, c): sums over the run are kept up from
  /// row to row. @pre count >= 1
  void spread_run(const RepulsionKernel& kernel, int a, int b, int count, int c, bool subtract,
                  const KernelTarget& target);

 private:
  /// Makes the responses that the target needs: per class the sum of the kernel rows of all obstacles of the row,
  /// from (first obstacle - half) on.
  void prepare(const RepulsionKernel& kernel, const ObstacleRow& row, bool subtract, const KernelTarget& target);
  void make_response(const RepulsionKernel& kernel, int row_class, std::uint64_t mask, bool subtract);

  std::size_t response_length_;
  std::vector<std::int32_t> responses_;  ///< per class
  std::vector<std::int32_t> run_sum_;    ///< one row
  std::vector<std::uint64_t> made_for_;  ///< per class: number of the row that its response belongs to
  std::uint64_t row_number_ = 0;
};

/// v mod size, never negative.
inline int wrapped(int v, int size) {
  const int rest = v % size;
  return rest < 0 ? rest + size : rest;
}

}  // namespace stairwell::mapping
