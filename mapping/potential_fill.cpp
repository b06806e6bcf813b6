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
          {{clip.lo.x, clip.hi.x}, size_[0], 1},
          nullptr};
}

/// Alg. 4.1, lines 9-14: each new obstacle cell adds its kernel once; one that is gone takes it away.
/// For the nearest-obstacle form the cells in reach are only marked.
void PotentialLayers::spread_changes(const ObstacleLattice& obstacles, const VoxelBox& kept) {
  const int reach = kernel_.reach_cells();
  KernelTarget to = target(kept);
  to.touched = touched_.data();
  for (const ObstacleLattice::Change& change : obstacles.changes()) {
    const VoxelIndex first = obstacles.first_cell(change);
    const std::uint64_t near = bits_in({kept.lo.x - reach, kept.hi.x + reach}, first.x);
    const std::uint64_t changed = (change.added | change.removed) & near;
    const bool beside = first.y < kept.lo.y - reach || first.y > kept.hi.y + reach || first.z < kept.lo.z - reach ||
                        first.z > kept.hi.z + reach;
    if (changed == 0 || beside) continue;
    if (form_ == RepulsionForm::kNearest) {
      const int lo_x = first.x + std::countr_zero(changed);
      const int hi_x = first.x + 63 - std::countl_zero(changed);
      const VoxelBox box = intersection(
          {{lo_x - reach, first.y - reach, first.z - reach}, {hi_x + reach, first.y + reach, first.z + reach}}, kept);
      if (!is_empty(box)) touch(box);
      continue;
    }
    spreader_.spread(kernel_, {first.z, first.y, first.x, change.removed & near}, true, to);
    spreader_.spread(kernel_, {first.z, first.y, first.x, change.added & near}, false, to);
  }
}

void PotentialLayers::fill_repulsive(const Inputs& inputs, const VoxelBox& box) {
  if (form_ == RepulsionForm::kNearest) {
    read_nearest(*inputs.distances, box);
  } else if (box.hi.x - box.lo.x < kThin_cells && box.hi.y - box.lo.y >= kThin_cells) {
    sum_across(inputs.obstacles, box);
  } else {
    sum_rows(inputs.obstacles, box);
  }
}

/// Sums the kernels of all obstacles in reach, row of obstacles by row of obstacles along x.
void PotentialLayers::sum_rows(const ObstacleLattice& obstacles, const VoxelBox& box) {
  for_each_segment(box, [&](int, int, int, int count, std::size_t index) {
    std::fill_n(repulsive_.begin() + static_cast<std::ptrdiff_t>(index), count, 0);
  });
  const int reach = kernel_.reach_cells();
  const KernelTarget to = target(box);
  const std::array<int, 3>& size = lattice_.size();
  const CellRange from_x = grown(box.lo.x, box.hi.x, reach, size[0]);
  const CellRange from_y = grown(box.lo.y, box.hi.y, reach, size[1]);
  const CellRange from_z = grown(box.lo.z, box.hi.z, reach, size[2]);
  for (int z = from_z.lo; z <= from_z.hi; ++z) {
    for (int y = from_y.lo; y <= from_y.hi; ++y) {
      for (int word = from_x.lo / 64; word <= from_x.hi / 64; ++word) {
        const std::uint64_t mask = obstacles.word(word, y, z) & bits_in(from_x, word * 64);
        spreader_.spread(kernel_, {z, y, word * 64, mask}, false, to);
      }
    }
  }
}

/// The same for a box of few cells along x: rows of obstacles along y, so that the rows added are long.
void PotentialLayers::sum_across(const ObstacleLattice& obstacles, const VoxelBox& box) {
  const int thickness = box.hi.x - box.lo.x + 1;
  const int ny = box.hi.y - box.lo.y + 1;
  const int nz = box.hi.z - box.lo.z + 1;
  std::fill_n(slab_.begin(), static_cast<std::ptrdiff_t>(thickness) * ny * nz, 0);
  KernelTarget to{slab_.data(),
                  {{0, thickness - 1}, thickness, static_cast<std::ptrdiff_t>(ny) * nz},
                  {{0, nz - 1}, nz, ny},
                  {{0, ny - 1}, ny, 1},
                  nullptr};
  const int reach = kernel_.reach_cells();
  const std::array<int, 3>& size = lattice_.size();
  const CellRange from_x = grown(box.lo.x, box.hi.x, reach, size[0]);
  const CellRange from_y = grown(box.lo.y, box.hi.y, reach, size[1]);
  const CellRange from_z = grown(box.lo.z, box.hi.z, reach, size[2]);
  for (int z = from_z.lo; z <= from_z.hi; ++z) {
    for (int first_y = from_y.lo; first_y <= from_y.hi; first_y += 64) {
      std::fill(masks_.begin(), masks_.end(), 0);
      for (int y = first_y; y <= std::min(first_y + 63, from_y.hi); ++y) {
        for (int word = from_x.lo / 64; word <= from_x.hi / 64; ++word) {
          std::uint64_t bits = obstacles.word(word, y, z) & bits_in(from_x, word * 64);
          for (; bits != 0; bits &= bits - 1) {
            const int x = word * 64 + std::countr_zero(bits);
            masks_[static_cast<std::size_t>(x - from_x.lo)] |= std::uint64_t{1} << (y - first_y);
          }
        }
      }
      for (int x = from_x.lo; x <= from_x.hi; ++x) {
        const std::uint64_t mask = masks_[static_cast<std::size_t>(x - from_x.lo)];
        spreader_.spread(kernel_, {x - box.lo.x, z - box.lo.z, first_y - box.lo.y, mask}, false, to);
      }
    }
  }
  for_each_segment(box, [&](int y, int z, int x, int count, std::size_t index) {
    for (int i = 0; i < count; ++i) {
      const int from = ((x + i - box.lo.x) * nz + (z - box.lo.z)) * ny + (y - box.lo.y);
      repulsive_[index + static_cast<std::size_t>(i)] = slab_[static_cast<std::size_t>(from)];
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
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = box.lo.y; y <= box.hi.y; ++y) {
      const Eigen::Vector3d offset_m = lattice_.center_of({box.lo.x, y, z}) - bump.center_m;
      const double left = bump.reach_m * bump.reach_m - offset_m.z() * offset_m.z() - offset_m.y() * offset_m.y();
      if (!(left > 0.0)) continue;
      const double half_m = std::sqrt(left);
      const CellRange ball = centers_between(lattice_, 0, bump.center_m.x() - half_m, bump.center_m.x() + half_m);
      const CellRange cells{std::max(ball.lo, box.lo.x), std::min(ball.hi, box.hi.x)};
      if (cells.empty()) continue;
      const float across =
          peak * line_[2][static_cast<std::size_t>(z - box.lo.z)] * line_[1][static_cast<std::size_t>(y - box.lo.y)];
      for_each_segment({{cells.lo, y, z}, {cells.hi, y, z}}, [&](int, int, int x, int count, std::size_t index) {
        const float* along = line_[0].data() + (x - box.lo.x);
        float* to = layer.data() + index;
        for (int i = 0; i < count; ++i) to[i] += across * along[i];
      });
    }
  }
}

/// The total is never added to, only made anew: it cannot drift away from the layers.
void PotentialLayers::sum_touched() {
  const auto unit = static_cast<float>(kernel_.unit());
  const VoxelBox all = window();
  for (int z = all.lo.z; z <= all.hi.z; ++z) {
    for (int y = all.lo.y; y <= all.hi.y; ++y) {
      CellRange& row = touched_[touched_row(y, z, size_)];
      if (row.empty()) continue;
      for_each_segment({{row.lo, y, z}, {row.hi, y, z}}, [&](int, int, int, int count, std::size_t index) {
        const std::int32_t* repulsive = repulsive_.data() + index;
        const float* attractive = attractive_.data() + index;
        const float* experience = experience_layer_.data() + index;
        const float* mobile = mobile_layer_.data() + index;
        float* total = total_.data() + index;
        for (int i = 0; i < count; ++i) {
          total[i] = ((attractive[i] + unit * static_cast<float>(repulsive[i])) + experience[i]) + mobile[i];
        }
      });
      row = {};
    }
  }
}

}  // namespace stairwell::mapping
