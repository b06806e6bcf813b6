#include "planning3d/passable_lattice.hpp"

#include "planning3d/cost_tables.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr double kCell_m = 0.2;
constexpr double kWidestCell_m = 0.4;  // walls are at least so thick once the robot's radius is added on both sides
constexpr double kMostCells = 1.5e6;

int chosen_stride(const GridSpec& grid) {
  const int fine = std::max(1, static_cast<int>(std::lround(kCell_m / grid.resolution_m())));
  const int coarse = std::max(fine, static_cast<int>(std::lround(kWidestCell_m / grid.resolution_m())));
  for (int stride = fine; stride < coarse; ++stride) {
    if (static_cast<double>(grid.voxel_count()) <= kMostCells * std::pow(stride, 3)) return stride;
  }
  return coarse;
}

}  // namespace

void PassableLattice::resize(const GridSpec& grid) {
  if (!flags_.empty() && grid == frame_.grid) return;
  frame_.grid = grid;
  frame_.cell_voxels = stride_ > 0 ? stride_ : chosen_stride(grid);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame_.size[axis] = (grid.size()[axis] + frame_.cell_voxels - 1) / frame_.cell_voxels + 2;
  }
  flags_.assign(frame_.cell_count(), 0);
  basis_ = {};
}

Eigen::Vector3d LatticeFrame::center_of(std::size_t cell) const {
  const auto nx = static_cast<std::size_t>(size[0]);
  const auto ny = static_cast<std::size_t>(size[1]);
  const Eigen::Vector3d at(static_cast<double>(cell % nx), static_cast<double>(cell / nx % ny),
                           static_cast<double>(cell / (nx * ny)));
  const double edge_m = cell_voxels * grid.resolution_m();
  return grid.box().min_m + (at - Eigen::Vector3d::Constant(0.5)) * edge_m;
}

void PassableLattice::update(const FreeSpace& space, const MotionRule& rule) {
  const GridSpec& grid = space.grid();
  resize(grid);
  const mapping::DistanceField& field = space.blocked_distance();
  Basis basis{field.id(), space.min_squared_cells(), space.lo(), space.hi(), rule.kind, rule.layers_m};
  const bool known = basis == basis_;
  if (known && field.revision() == revision_) return;
  if (known) {
    field.for_each_block_changed_since(revision_, [&](const mapping::VoxelBox& block) { mark(space, block); });
  } else {
    level_.assign(static_cast<std::size_t>(grid.size()[2]), 0);
    if (rule.kind == MotionRule::Kind::kSlice) level_ = level_table(grid, rule);
    std::fill(flags_.begin(), flags_.end(), std::uint8_t{0});
    mark(space, {{0, 0, 0}, {grid.size()[0] - 1, grid.size()[1] - 1, grid.size()[2] - 1}});
  }
  basis_ = std::move(basis);
  revision_ = field.revision();
}

/// Makes the cells that meet the box afresh.
void PassableLattice::mark(const FreeSpace& space, const mapping::VoxelBox& box) {
  const GridSpec& grid = frame_.grid;
  const int w = frame_.cell_voxels;
  const VoxelIndex first{box.lo.x / w * w, box.lo.y / w * w, box.lo.z / w * w};
  const VoxelIndex last{box.hi.x / w * w + w - 1, box.hi.y / w * w + w - 1, box.hi.z / w * w + w - 1};
  for (int z = first.z; z <= last.z; z += w) {
    for (int y = first.y; y <= last.y; y += w) {
      std::uint8_t* const row = flags_.data() + frame_.cell_of({first.x, y, z});
      std::fill(row, row + (last.x - first.x + w) / w, std::uint8_t{0});
    }
  }
  const auto& squared = space.blocked_distance().data();
  const auto least = static_cast<std::uint16_t>(std::min(space.min_squared_cells(), 65535));
  const int from_x = std::max(first.x, space.lo().x);
  const int to_x = std::min(last.x, space.hi().x);
  for (int z = std::max(first.z, space.lo().z); z <= std::min(last.z, space.hi().z); ++z) {
    const std::uint8_t mark = level_[static_cast<std::size_t>(z)] != 0 ? kPassable | kLevel : kPassable;
    for (int y = std::max(first.y, space.lo().y); y <= std::min(last.y, space.hi().y); ++y) {
      const std::uint16_t* const row = squared.data() + grid.linear({0, y, z});
      std::uint8_t* const cells = flags_.data() + frame_.cell_of({0, y, z});
      int in_cell = from_x % w;
      std::size_t cell = static_cast<std::size_t>(from_x / w);
      for (int x = from_x; x <= to_x; ++x) {
        if (row[x] >= least) cells[cell] |= mark;
        if (++in_cell == w) {
          in_cell = 0;
          ++cell;
        }
      }
    }
  }
}

}  // namespace stairwell::planning3d
