#include "mapping/potential_kernel.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

// Whole numbers: the same sums in wider registers where the processor has them.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define STAIRWELL_SPREAD_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define STAIRWELL_SPREAD_CLONES
#endif

namespace stairwell::mapping {

namespace {

constexpr int kLongRun = 3;  ///< cells in a row from which on a running sum is cheaper than row after row

inline void add(std::int32_t* to, const std::int32_t* from, int count) {
  for (int i = 0; i < count; ++i) to[i] += from[i];
}

/// Eight cells at once. Unaligned.
using Eight = std::int32_t __attribute__((vector_size(32), aligned(4), may_alias));

inline void add_eights(std::int32_t* to, const std::int32_t* from, int count) {
  for (int i = 0; i < count; i += 8) *reinterpret_cast<Eight*>(to + i) += *reinterpret_cast<const Eight*>(from + i);
}

inline void widen(CellRange& range, int lo, int hi) {
  range = range.empty() ? CellRange{lo, hi} : CellRange{std::min(range.lo, lo), std::max(range.hi, hi)};
}

/// Where cells along c lie in the target's rows.
class AlongRow {
 public:
  explicit AlongRow(const KernelTarget::Axis& c)
      : clip_(c.clip), size_(c.size), first_(c.clip.empty() ? 0 : wrapped(c.clip.lo, c.size)) {}

  CellRange clipped(int lo, int hi) const { return {std::max(lo, clip_.lo), std::min(hi, clip_.hi)}; }

  /// row[cells] += from[0..]. @pre cells lie within the clip
  /// @param padded so many values of `from` may be added: zeros after those of the cells
  void add_to(std::int32_t* row, CellRange cells, const std::int32_t* from, int padded) const {
    int at = first_ + (cells.lo - clip_.lo);
    if (at >= size_) at -= size_;
    const int count = cells.hi - cells.lo + 1;
    if (count <= padded && at + padded <= size_) {
      add_eights(row + at, from, padded);
      return;
    }
    const int before_wrap = std::min(count, size_ - at);
    add(row + at, from, before_wrap);
    if (before_wrap < count) add(row, from + before_wrap, count - before_wrap);
  }

 private:
  CellRange clip_;
  int size_;
  int first_;
};

inline int to_eights(int count) { return (count + 7) / 8 * 8; }

STAIRWELL_SPREAD_CLONES
void sum_long_runs(std::uint64_t mask, const std::int32_t* row, int length, int count, std::int32_t* out) {
  for (int at = 0; mask != 0;) {
    const int gap = std::countr_zero(mask);
    mask >>= gap;
    at += gap;
    const int run = std::countr_one(mask);
    if (run >= kLongRun) {
      for (int i = 0; i < length; ++i) out[at + i] += row[i];
      for (int i = 0; i < length; ++i) out[at + run + i] -= row[i];
    }
    at += run;
    mask = run < 64 ? mask >> run : 0;
  }
  std::int32_t sum = 0;
  for (int i = 0; i < count; ++i) out[i] = sum += out[i];
}

STAIRWELL_SPREAD_CLONES
void add_short_runs(std::uint64_t mask, const std::int32_t* row, int length, std::int32_t* out) {
  for (int at = 0; mask != 0;) {
    const int gap = std::countr_zero(mask);
    mask >>= gap;
    at += gap;
    const int run = std::countr_one(mask);
    for (int i = 0; run < kLongRun && i < run; ++i) add(out + at + i, row, length);
    at += run;
    mask = run < 64 ? mask >> run : 0;
  }
}

bool has_long_run(std::uint64_t mask) { return (mask & (mask >> 1) & (mask >> 2)) != 0; }

/// Rows for every offset across the row, each where `source` says. @param Source row class -> first cell of its row
template <typename Source>
__attribute__((always_inline)) inline void add_rows(const RepulsionKernel& kernel, const ObstacleRow& row, int first,
                                                    int last, const KernelTarget& target, const Source& source) {
  const int reach = kernel.reach_cells();
  const AlongRow along(target.c);
  const CellRange across_a{std::max(row.a - reach, target.a.clip.lo), std::min(row.a + reach, target.a.clip.hi)};
  for (int a = across_a.lo; a <= across_a.hi; ++a) {
    const int da = std::abs(a - row.a);
    const int width = kernel.width(da);
    const int lo_b = std::max(row.b - width, target.b.clip.lo);
    const int hi_b = std::min(row.b + width, target.b.clip.hi);
    if (lo_b > hi_b) continue;
    const int at_a = wrapped(a, target.a.size);
    int at_b = wrapped(lo_b, target.b.size);
    for (int b = lo_b; b <= hi_b; ++b, at_b = at_b + 1 == target.b.size ? 0 : at_b + 1) {
      const int row_class = kernel.row_class(da, std::abs(b - row.b));
      const int half = kernel.half(row_class);
      const int from = row.c + first - half;
      const int to = row.c + last + half;
      const CellRange cells = along.clipped(from, to);
      if (cells.empty()) continue;
      const int padded = cells.lo == from && cells.hi == to ? to_eights(to - from + 1) : 0;
      along.add_to(target.cells + at_a * target.a.stride + at_b * target.b.stride, cells,
                   source(row_class) + (cells.lo - from), padded);
      if (target.touched != nullptr)
        widen(target.touched[at_a * target.touched_a + at_b * target.touched_b], cells.lo, cells.hi);
    }
  }
}

STAIRWELL_SPREAD_CLONES
void add_single(const RepulsionKernel& kernel, const ObstacleRow& row, int at, bool subtract,
                const KernelTarget& target) {
  add_rows(kernel, row, at, at, target, [&](int row_class) { return kernel.row(row_class, subtract); });
}

STAIRWELL_SPREAD_CLONES
void add_many(const RepulsionKernel& kernel, const ObstacleRow& row, int first, int last, const std::int32_t* responses,
              std::size_t response_length, const KernelTarget& target) {
  add_rows(kernel, row, first, last, target,
           [=](int row_class) { return responses + response_length * static_cast<std::size_t>(row_class); });
}

STAIRWELL_SPREAD_CLONES
void add_run(const RepulsionKernel& kernel, const ObstacleRow& row, int count, bool subtract, std::int32_t* sum,
             const KernelTarget& target) {
  const int last_b = row.b + count - 1;
  const AlongRow along(target.c);
  for (int da = 0; da <= kernel.reach_cells(); ++da) {
    const int below = row.a - da;
    const int above = row.a + da;
    const bool add_below = below >= target.a.clip.lo && below <= target.a.clip.hi;
    const bool add_above = da > 0 && above >= target.a.clip.lo && above <= target.a.clip.hi;
    if (!add_below && !add_above) continue;
    const int width = kernel.width(da);
    const int half = kernel.half(kernel.row_class(da, 0));
    const CellRange cells = along.clipped(row.c - half, row.c + half);
    if (cells.empty()) continue;
    const int length = to_eights(2 * half + 1);
    const int padded = cells.hi - cells.lo == 2 * half ? length : 0;
    std::fill(sum, sum + length, 0);
    const auto change = [&](int db, bool negative) {
      if (db > width || db < -width) return;
      const int row_class = kernel.row_class(da, std::abs(db));
      const int here = kernel.half(row_class);
      add(sum + half - here, kernel.row(row_class, negative), 2 * here + 1);
    };
    for (int b = row.b - width; b <= std::min(last_b + width, target.b.clip.hi); ++b) {
      change(b - row.b, subtract);
      change(b - 1 - last_b, !subtract);
      if (b < target.b.clip.lo) continue;
      const int at_b = wrapped(b, target.b.size);
      for (const bool is_above : {false, true}) {
        if (!(is_above ? add_above : add_below)) continue;
        const int at_a = wrapped(is_above ? above : below, target.a.size);
        along.add_to(target.cells + at_a * target.a.stride + at_b * target.b.stride, cells,
                     sum + (cells.lo - (row.c - half)), padded);
        if (target.touched != nullptr)
          widen(target.touched[at_a * target.touched_a + at_b * target.touched_b], cells.lo, cells.hi);
      }
    }
  }
}

}  // namespace

RepulsionKernel::RepulsionKernel(const PotentialConfig& config, double resolution_m) {
  const auto in_reach = [&](int squared) {
    return resolution_m * std::sqrt(static_cast<double>(squared)) < config.reach_m;
  };
  while (in_reach((reach_ + 1) * (reach_ + 1))) {
    if (++reach_ > kMaxReach_cells) {
      throw InputError("potential: reach_m " + std::to_string(config.reach_m) + " is more than " +
                       std::to_string(kMaxReach_cells) + " cells of " + std::to_string(resolution_m) + " m");
    }
  }
  std::vector<double> exact;
  for (int squared = 0; in_reach(squared); ++squared) {
    const double ratio = resolution_m * std::sqrt(static_cast<double>(squared)) / config.sigma_m;
    exact.push_back(config.k_rep / (config.sigma_m * std::sqrt(2.0 * kPi)) * std::exp(-0.5 * ratio * ratio));
  }
  double solid = 0.0;
  for (int a = -reach_; a <= reach_; ++a) {
    for (int b = -reach_; b <= reach_; ++b) {
      for (int c = -reach_; c <= reach_; ++c) {
        const auto squared = static_cast<std::size_t>(a * a + b * b + c * c);
        solid += squared < exact.size() ? exact[squared] : 0.0;
      }
    }
  }
  unit_ = solid > 0.0 ? std::exp2(std::ceil(std::log2(solid)) - 30.0) : 1.0;
  for (const double value : exact) by_squared_.push_back(static_cast<std::int32_t>(std::lround(value / unit_)));

  std::vector<int> class_of(by_squared_.size(), -1);
  for (int a = 0; a <= reach_; ++a) {
    width_.push_back(-1);
    for (int b = 0; b <= reach_; ++b) {
      const int squared = a * a + b * b;
      if (!in_reach(squared)) {
        row_class_.push_back(-1);
        continue;
      }
      width_.back() = b;
      int& known = class_of[static_cast<std::size_t>(squared)];
      if (known < 0) {
        known = classes();
        half_.push_back(0);
        while (in_reach(squared + (half_.back() + 1) * (half_.back() + 1))) ++half_.back();
        for (const int sign : {1, -1}) {
          for (int c = 0; c < static_cast<int>(row_length()); ++c) {
            const int along = c - half_.back();
            rows_.push_back(along <= half_.back() ? sign * of_squared(squared + along * along) : 0);
          }
        }
      }
      row_class_.push_back(known);
    }
  }
}

KernelSpreader::KernelSpreader(const RepulsionKernel& kernel)
    : response_length_(static_cast<std::size_t>(to_eights(64 + 2 * kernel.reach_cells() + 1))),
      responses_(response_length_ * static_cast<std::size_t>(kernel.classes())),
      run_sum_(static_cast<std::size_t>(to_eights(2 * kernel.reach_cells() + 1))),
      made_for_(static_cast<std::size_t>(kernel.classes()), 0) {}

void KernelSpreader::make_response(const RepulsionKernel& kernel, int row_class, std::uint64_t mask, bool subtract) {
  std::int32_t* out = responses_.data() + response_length_ * static_cast<std::size_t>(row_class);
  const int length = 2 * kernel.half(row_class) + 1;
  const int count = 64 - std::countl_zero(mask) + length;  // one more than the sum: ends of runs are noted there
  std::fill(out, out + to_eights(count), 0);
  const std::int32_t* row = kernel.row(row_class, subtract);
  if (has_long_run(mask)) {
    sum_long_runs(mask, row, length, count, out);
  }
  add_short_runs(mask, row, length, out);
}

void KernelSpreader::prepare(const RepulsionKernel& kernel, const ObstacleRow& row, bool subtract,
                             const KernelTarget& target) {
  ++row_number_;
  const std::uint64_t mask = row.mask >> std::countr_zero(row.mask);
  const int reach = kernel.reach_cells();
  const auto nearest = [](int v, CellRange range) { return std::max({range.lo - v, v - range.hi, 0}); };
  const auto farthest = [](int v, CellRange range) { return std::max(std::abs(v - range.lo), std::abs(v - range.hi)); };
  const int hi_da = std::min(reach, farthest(row.a, target.a.clip));
  for (int da = nearest(row.a, target.a.clip); da <= hi_da; ++da) {
    const int hi_db = std::min(kernel.width(da), farthest(row.b, target.b.clip));
    for (int db = nearest(row.b, target.b.clip); db <= hi_db; ++db) {
      const int row_class = kernel.row_class(da, db);
      std::uint64_t& made_for = made_for_[static_cast<std::size_t>(row_class)];
      if (made_for == row_number_) continue;
      made_for = row_number_;
      make_response(kernel, row_class, mask, subtract);
    }
  }
}

void KernelSpreader::spread(const RepulsionKernel& kernel, const ObstacleRow& row, bool subtract,
                            const KernelTarget& target) {
  if (row.mask == 0) return;
  const int first = std::countr_zero(row.mask);
  const int last = 63 - std::countl_zero(row.mask);
  if (first == last) {
    add_single(kernel, row, first, subtract, target);
    return;
  }
  prepare(kernel, row, subtract, target);
  add_many(kernel, row, first, last, responses_.data(), response_length_, target);
}

void KernelSpreader::spread_run(const RepulsionKernel& kernel, int a, int b, int count, int c, bool subtract,
                                const KernelTarget& target) {
  const ObstacleRow first{a, b, c, 1};
  if (count == 1) {
    add_single(kernel, first, 0, subtract, target);
  } else {
    add_run(kernel, first, count, subtract, run_sum_.data(), target);
  }
}

}  // namespace stairwell::mapping
