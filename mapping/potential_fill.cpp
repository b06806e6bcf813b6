/// How PotentialLayers computes its layers.
#include "mapping/potential_layers.hpp"
#include "mapping/potential_segments.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace stairwell::mapping {

namespace {

/// Those of bits 0..63 of a word of cells, whose first cell is `first`, that lie in the range.
std::uint64_t bits_in(CellRange range, int first) {
  const int lo = std::max(range.lo - first, 0);
  const int hi = std::min(range.hi - first, 63);
  if (lo > hi) return 0;
  const std::uint64_t up_to_hi = hi == 63 ? ~std::uint64_t{0} : (std::uint64_t{1} << (hi + 1)) - 1;
  return up_to_hi & ~((std::uint64_t{1} << lo) - 1);
}

constexpr std::array<int VoxelIndex::*, 3> kAxes{&VoxelIndex::x, &VoxelIndex::y, &VoxelIndex::z};

/// Bits of a box of cells [a][b][c], rows along c in words of 64.
class ObstacleRows {
 public:
  /// @param words at least words_for(as, bs, cs), cleared here
  ObstacleRows(int as, int bs, int cs, std::vector<std::uint64_t>& words)
      : as_(as), bs_(bs), per_row_((cs + 63) / 64), words_(words) {
    std::fill_n(words.begin(), static_cast<std::ptrdiff_t>(as) * bs * per_row_, 0);
  }
  void add(int a, int b, int c) {
    words_[static_cast<std::size_t>((a * bs_ + b) * per_row_ + c / 64)] |= std::uint64_t{1} << (c % 64);
  }
  /// visit(a, b, c of bit 0, mask) for every word with obstacles.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    std::size_t next = 0;
    for (int a = 0; a < as_; ++a) {
      for (int b = 0; b < bs_; ++b) {
        for (int word = 0; word < per_row_; ++word, ++next) {
          if (words_[next] != 0) visit(a, b, 64 * word, words_[next]);
        }
      }
    }
  }

 private:
  int as_, bs_, per_row_;
  std::vector<std::uint64_t>& words_;
};

/// visit(offset from `lo`) for every obstacle of a box within the lattice.
template <typename Visit>
void for_each_obstacle(const ObstacleLattice& obstacles, const std::array<int, 3>& lo, const std::array<int, 3>& cells,
                       const Visit& visit) {
  const CellRange along_x{lo[0], lo[0] + cells[0] - 1};
  for (int z = 0; z < cells[2]; ++z) {
    for (int y = 0; y < cells[1]; ++y) {
      for (int word = along_x.lo / 64; word <= along_x.hi / 64; ++word) {
        std::uint64_t bits = obstacles.word(word, lo[1] + y, lo[2] + z) & bits_in(along_x, word * 64);
        for (; bits != 0; bits &= bits - 1) visit({word * 64 + std::countr_zero(bits) - lo[0], y, z});
      }
    }
  }
}

/// Those bits that have two set neighbours or are such a neighbour: runs of three and more.
std::uint64_t in_runs(std::uint64_t mask) {
  const std::uint64_t inner = mask & (mask << 1) & (mask >> 1);
  return inner | (inner << 1) | (inner >> 1);
}

CellRange grown(int lo, int hi, int by, int size) { return {std::max(lo - by, 0), std::min(hi + by, size - 1)}; }

/// Lattice cells whose centres lie between the two coordinates (world frame), ends excluded, cut to the lattice.
CellRange centers_between(const GridSpec& lattice, Eigen::Index axis, double lo_m, double hi_m) {
  const double first_m = lattice.center_of({0, 0, 0})[axis];
  const double size = lattice.size()[static_cast<std::size_t>(axis)];
  const double lo = std::floor((lo_m - first_m) / lattice.resolution_m()) + 1.0;
  const double hi = std::ceil((hi_m - first_m) / lattice.resolution_m()) - 1.0;
  return {static_cast<int>(std::clamp(lo, 0.0, size)), static_cast<int>(std::clamp(hi, -1.0, size - 1.0))};
}

}  // namespace

KernelTarget PotentialLayers::target(const VoxelBox& clip) {
  const std::ptrdiff_t nx = size_[0];
  return {repulsive_.data(),
          {{clip.lo.z, clip.hi.z}, size_[2], nx * size_[1]},
          {{clip.lo.y, clip.hi.y}, size_[1], nx},
          {{clip.lo.x, clip.hi.x}, size_[0], 1}};
}

/// Alg. 4.1, lines 9-14: each new obstacle cell adds its kernel once; one that is gone takes it away. Runs along x
/// share their work, and so do runs along z (walls) of what is left.
void PotentialLayers::spread_changes(const ObstacleLattice& obstacles, const VoxelBox& kept) {
  const int reach = kernel_.reach_cells();
  const VoxelBox near{kept.lo - VoxelIndex{reach, reach, reach}, kept.hi + VoxelIndex{reach, reach, reach}};
  KernelTarget to = target(kept);
  to.touched = touched_.data();
  to.touched_a = size_[1];
  to.touched_b = 1;
  for (const bool removed : {true, false}) {
    singles_.clear();
    for (const ObstacleLattice::Change& change : obstacles.changes()) {
      const VoxelIndex first = obstacles.first_cell(change);
      if (first.y < near.lo.y || first.y > near.hi.y || first.z < near.lo.z || first.z > near.hi.z) continue;
      const std::uint64_t mask = (removed ? change.removed : change.added) & bits_in({near.lo.x, near.hi.x}, first.x);
      const std::uint64_t runs = in_runs(mask);
      spreader_.spread(kernel_, {first.z, first.y, first.x, runs}, removed, to);
      for (std::uint64_t left = mask & ~runs; left != 0; left &= left - 1) {
        if (singles_.size() == kMaxSingles) spread_singles(removed, to);
        singles_.push_back({first.x + std::countr_zero(left), first.y, first.z});
      }
    }
    spread_singles(removed, to);
  }
}

void PotentialLayers::spread_singles(bool removed, const KernelTarget& to) {
  KernelTarget upright = to;  // runs go along the second axis
  std::swap(upright.a, upright.b);
  std::swap(upright.touched_a, upright.touched_b);
  std::sort(singles_.begin(), singles_.end(), [](const VoxelIndex& a, const VoxelIndex& b) {
    return a.y != b.y ? a.y < b.y : (a.x != b.x ? a.x < b.x : a.z < b.z);
  });
  for (std::size_t i = 0; i < singles_.size();) {
    const VoxelIndex first = singles_[i];
    int run = 1;
    while (++i < singles_.size() && singles_[i] == first + VoxelIndex{0, 0, run}) ++run;
    spreader_.spread_run(kernel_, first.y, first.z, run, first.x, removed, upright);
  }
  singles_.clear();
}

/// Marks what lies in reach of changes.
void PotentialLayers::touch_changes(const ObstacleLattice& obstacles, const VoxelBox& kept) {
  const int reach = kernel_.reach_cells();
  for (const ObstacleLattice::Change& change : obstacles.changes()) {
    const VoxelIndex first = obstacles.first_cell(change);
    const std::uint64_t changed = change.added | change.removed;
    const int lo_x = first.x + std::countr_zero(changed);
    const int hi_x = first.x + 63 - std::countl_zero(changed);
    const VoxelBox box = intersection(
        {{lo_x - reach, first.y - reach, first.z - reach}, {hi_x + reach, first.y + reach, first.z + reach}}, kept);
    if (!is_empty(box)) touch(box);
  }
}

void PotentialLayers::fill_repulsive(const Inputs& inputs, const VoxelBox& box) {
  if (form_ == RepulsionForm::kNearest) {
    read_nearest(*inputs.distances, box);
    return;
  }
  const std::array<int, 3> cells{box.hi.x - box.lo.x + 1, box.hi.y - box.lo.y + 1, box.hi.z - box.lo.z + 1};
  const auto across = static_cast<std::size_t>(std::min_element(cells.begin(), cells.end()) - cells.begin());
  int VoxelIndex::*const along = kAxes[across];
  VoxelBox slab = box;
  for (slab.lo.*along = box.lo.*along; slab.lo.*along <= box.hi.*along; slab.lo.*along += kSlab_cells) {
    slab.hi.*along = std::min(slab.lo.*along + kSlab_cells - 1, box.hi.*along);
    sum_slab(inputs.obstacles, slab, across);
  }
}

/// Sums the kernels of all obstacles in reach of a slab across one axis. Obstacles side by side share most of their
/// work: those in runs along the second axis are added row by row, the others in columns along the third.
void PotentialLayers::sum_slab(const ObstacleLattice& obstacles, const VoxelBox& box, std::size_t across) {
  const std::size_t second = across == 0 ? 1 : 0;
  const std::size_t third = 3 - across - second;
  std::array<int, 3> lo{}, cells{}, from_lo{}, from_cells{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const CellRange from =
        grown(box.lo.*kAxes[axis], box.hi.*kAxes[axis], kernel_.reach_cells(), lattice_.size()[axis]);
    lo[axis] = box.lo.*kAxes[axis];
    cells[axis] = box.hi.*kAxes[axis] - lo[axis] + 1;
    from_lo[axis] = from.lo;
    from_cells[axis] = from.hi - from.lo + 1;
  }
  ObstacleRows rows(from_cells[across], from_cells[third], from_cells[second], rows_);
  ObstacleRows columns(from_cells[across], from_cells[second], from_cells[third], columns_);
  for_each_obstacle(obstacles, from_lo, from_cells,
                    [&](const std::array<int, 3>& at) { rows.add(at[across], at[third], at[second]); });
  const std::array<int, 3> shift{from_lo[0] - lo[0], from_lo[1] - lo[1], from_lo[2] - lo[2]};
  const auto target_of = [&](std::vector<std::int32_t>& sums, std::size_t b, std::size_t c) {
    std::fill_n(sums.begin(), static_cast<std::ptrdiff_t>(cells[0]) * cells[1] * cells[2], 0);
    return KernelTarget{sums.data(),
                        {{0, cells[across] - 1}, cells[across], static_cast<std::ptrdiff_t>(cells[b]) * cells[c]},
                        {{0, cells[b] - 1}, cells[b], cells[c]},
                        {{0, cells[c] - 1}, cells[c], 1}};
  };
  const KernelTarget row_sums = target_of(row_sums_, third, second);
  const KernelTarget column_sums = target_of(column_sums_, second, third);
  rows.for_each([&](int a, int b, int c, std::uint64_t mask) {
    const std::uint64_t runs = in_runs(mask);
    spreader_.spread(kernel_, {a + shift[across], b + shift[third], c + shift[second], runs}, false, row_sums);
    for (std::uint64_t rest = mask & ~runs; rest != 0; rest &= rest - 1) columns.add(a, c + std::countr_zero(rest), b);
  });
  columns.for_each([&](int a, int b, int c, std::uint64_t mask) {
    spreader_.spread(kernel_, {a + shift[across], b + shift[second], c + shift[third], mask}, false, column_sums);
  });
  for_each_segment(box, [&](int y, int z, int x, int count, std::size_t index) {
    std::array<int, 3> at{x - lo[0], y - lo[1], z - lo[2]};
    for (int i = 0; i < count; ++i, ++at[0]) {
      const int row = (at[across] * cells[third] + at[third]) * cells[second] + at[second];
      const int column = (at[across] * cells[second] + at[second]) * cells[third] + at[third];
      repulsive_[index + static_cast<std::size_t>(i)] =
          row_sums_[static_cast<std::size_t>(row)] + column_sums_[static_cast<std::size_t>(column)];
    }
  });
}

void PotentialLayers::read_nearest(const DistanceField& distances, const VoxelBox& box) {
  for_each_segment(box, [&](int y, int z, int x, int count, std::size_t index) {
    const std::uint16_t* squared = distances.data().data() + lattice_.linear({x, y, z});
    for (int i = 0; i < count; ++i) repulsive_[index + static_cast<std::size_t>(i)] = kernel_.of_squared(squared[i]);
  });
}

/// Thesis eq. 4.2.
void PotentialLayers::fill_attractive(const VoxelBox& box) {
  if (goal_m_.array().isNaN().any()) {
    for_each_segment(box, [&](int, int, int, int count, std::size_t index) {
      std::fill_n(attractive_.begin() + static_cast<std::ptrdiff_t>(index), count, 0.0F);
    });
    return;
  }
  std::vector<float>& along_x = line_[0];  // squared offsets from the goal
  for (int x = box.lo.x; x <= box.hi.x; ++x) {
    const auto offset_m = static_cast<float>(lattice_.center_of({x, 0, 0}).x() - goal_m_.x());
    along_x[static_cast<std::size_t>(x - box.lo.x)] = offset_m * offset_m;
  }
  const auto gain = static_cast<float>(config_.k_attr);
  for_each_segment(box, [&](int y, int z, int x, int count, std::size_t index) {
    const Eigen::Vector3f offset_m = (lattice_.center_of({x, y, z}) - goal_m_).cast<float>();
    const float across = offset_m.y() * offset_m.y() + offset_m.z() * offset_m.z();
    const float* from = along_x.data() + (x - box.lo.x);
    float* to = attractive_.data() + index;
    for (int i = 0; i < count; ++i) to[i] = gain * std::sqrt(from[i] + across);
  });
}

/// Alg. 4.1, lines 16-18.
void PotentialLayers::fill_mobile(const VoxelBox& box) {
  for_each_segment(box, [&](int, int, int, int count, std::size_t index) {
    std::fill_n(mobile_layer_.begin() + static_cast<std::ptrdiff_t>(index), count, 0.0F);
  });
  for (const PotentialBump& bump : mobile_) add_bump(bump, box, mobile_layer_);
}

void PotentialLayers::fill_experience(const OccupancyMap& map, const VoxelBox& box) {
  const bool same_lattice = map.grid() == lattice_;
  for_each_segment(box, [&](int y, int z, int x, int count, std::size_t index) {
    for (int i = 0; i < count; ++i) {
      float base = 0.0F;
      if (config_.k_exp > 0.0) {
        const VoxelIndex v{x + i, y, z};
        const Occupancy there = same_lattice ? map.at(v) : map.at(lattice_.center_of(v));
        base = there == Occupancy::kUnknown ? 0.0F : static_cast<float>(config_.k_exp);
      }
      experience_layer_[index + static_cast<std::size_t>(i)] = base;
    }
  });
  for (const PotentialBump& bump : experience_) add_bump(bump, box, experience_layer_);
}

VoxelBox PotentialLayers::reach_of(const PotentialBump& bump) const {
  std::array<CellRange, 3> cells;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double at_m = bump.center_m[axis];
    cells[static_cast<std::size_t>(axis)] = centers_between(lattice_, axis, at_m - bump.reach_m, at_m + bump.reach_m);
  }
  return {{cells[0].lo, cells[1].lo, cells[2].lo}, {cells[0].hi, cells[1].hi, cells[2].hi}};
}

/// Calls visit(y, z, cells along x) for the rows of a box that a bump reaches.
template <typename Visit>
void PotentialLayers::for_each_row_in_reach(const PotentialBump& bump, const VoxelBox& box, const Visit& visit) const {
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = box.lo.y; y <= box.hi.y; ++y) {
      const Eigen::Vector3d offset_m = lattice_.center_of({box.lo.x, y, z}) - bump.center_m;
      const double left = bump.reach_m * bump.reach_m - offset_m.z() * offset_m.z() - offset_m.y() * offset_m.y();
      if (!(left > 0.0)) continue;
      const double half_m = std::sqrt(left);
      const CellRange ball = centers_between(lattice_, 0, bump.center_m.x() - half_m, bump.center_m.x() + half_m);
      const CellRange cells{std::max(ball.lo, box.lo.x), std::min(ball.hi, box.hi.x)};
      if (!cells.empty()) visit(y, z, cells);
    }
  }
}

/// The Gaussian as a product of one factor per axis.
void PotentialLayers::add_bump(const PotentialBump& bump, const VoxelBox& within, std::vector<float>& layer) {
  const VoxelBox box = intersection(within, reach_of(bump));
  if (is_empty(box)) return;
  const auto factors = [&](Eigen::Index axis, int lo, int hi) {
    float* out = line_[static_cast<std::size_t>(axis)].data();
    for (int i = lo; i <= hi; ++i) {
      const double ratio = (lattice_.center_of({i, i, i})[axis] - bump.center_m[axis]) / bump.sigma_m;
      *out++ = static_cast<float>(std::exp(-0.5 * ratio * ratio));
    }
  };
  factors(0, box.lo.x, box.hi.x);
  factors(1, box.lo.y, box.hi.y);
  factors(2, box.lo.z, box.hi.z);
  const auto peak = static_cast<float>(bump.gain / (bump.sigma_m * std::sqrt(2.0 * kPi)));
  for_each_row_in_reach(bump, box, [&](int row_y, int row_z, CellRange cells) {
    const float across = peak * line_[2][static_cast<std::size_t>(row_z - box.lo.z)] *
                         line_[1][static_cast<std::size_t>(row_y - box.lo.y)];
    for_each_segment({{cells.lo, row_y, row_z}, {cells.hi, row_y, row_z}},
                     [&](int, int, int x, int count, std::size_t index) {
                       const float* along = line_[0].data() + (x - box.lo.x);
                       float* to = layer.data() + index;
                       for (int i = 0; i < count; ++i) to[i] += across * along[i];
                     });
  });
}

void PotentialLayers::touch(const PotentialBump& bump, const VoxelBox& within) {
  const VoxelBox box = intersection(within, reach_of(bump));
  for_each_row_in_reach(bump, box, [&](int y, int z, CellRange cells) { touch({{cells.lo, y, z}, {cells.hi, y, z}}); });
}

/// The total is never added to, only made anew: it cannot drift away from the layers.
void PotentialLayers::sum_total(const VoxelBox& box) {
  const auto unit = static_cast<float>(kernel_.unit());
  for_each_segment(box, [&](int, int, int, int count, std::size_t index) {
    const std::int32_t* repulsive = repulsive_.data() + index;
    const float* attractive = attractive_.data() + index;
    const float* experience = experience_layer_.data() + index;
    const float* mobile = mobile_layer_.data() + index;
    float* total = total_.data() + index;
    for (int i = 0; i < count; ++i) {
      total[i] = ((attractive[i] + unit * static_cast<float>(repulsive[i])) + experience[i]) + mobile[i];
    }
  });
}

void PotentialLayers::sum_touched() {
  const VoxelBox all = window();
  for (int z = all.lo.z; z <= all.hi.z; ++z) {
    for (int y = all.lo.y; y <= all.hi.y; ++y) {
      CellRange& row = touched_[touched_row(y, z, size_)];
      if (row.empty()) continue;
      sum_total({{row.lo, y, z}, {row.hi, y, z}});
      row = {};
    }
  }
}

}  // namespace stairwell::mapping
