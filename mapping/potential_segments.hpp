/// Addressing of the wrapped window in which PotentialLayers keeps its cells. Private to its source files.
#pragma once

#include "mapping/potential_layers.hpp"

namespace stairwell::mapping {

/// Repulsion is summed in slabs of at most so many cells.
inline constexpr int kSlab_cells = 8;

/// Changed obstacles are gathered in batches of so many.
inline constexpr std::size_t kMaxSingles = 4096;

/// Number of the storage's row for a lattice row.
inline std::size_t touched_row(int y, int z, const std::array<int, 3>& size) {
  return static_cast<std::size_t>(wrapped(z, size[2])) * static_cast<std::size_t>(size[1]) +
         static_cast<std::size_t>(wrapped(y, size[1]));
}

/// Calls visit(y, z, x, count, index) for runs of cells that are contiguous in the storage: cells x to x + count - 1
/// of row (y, z), the first of them stored at `index`. @pre box lies within the window
template <typename Visit>
void PotentialLayers::for_each_segment(const VoxelBox& box, const Visit& visit) const {
  const int at = wrapped(box.lo.x, size_[0]);
  const int count = box.hi.x - box.lo.x + 1;
  const int before_wrap = std::min(count, size_[0] - at);
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = box.lo.y; y <= box.hi.y; ++y) {
      const std::size_t row = touched_row(y, z, size_) * static_cast<std::size_t>(size_[0]);
      visit(y, z, box.lo.x, before_wrap, row + static_cast<std::size_t>(at));
      if (before_wrap < count) visit(y, z, box.lo.x + before_wrap, count - before_wrap, row);
    }
  }
}

}  // namespace stairwell::mapping
