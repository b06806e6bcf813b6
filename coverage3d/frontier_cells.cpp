#include "coverage3d/frontier_cells.hpp"

#include "core/errors.hpp"
#include "mapping/worker_pool.hpp"

#include <bit>
#include <cstddef>

namespace stairwell::coverage3d {
namespace {

constexpr int kPerBlock = 8 / FrontierCells::kEdge;

/// Which cells of a block hold a voxel of the set.
std::uint64_t cells_of(const BlockBits& bits) {
  std::uint64_t cells = 0;
  for_each_voxel(bits, [&](const VoxelIndex& v) {
    cells |= std::uint64_t{1} << (16 * (v.z / FrontierCells::kEdge) + 4 * (v.y / FrontierCells::kEdge) +
                                  v.x / FrontierCells::kEdge);
  });
  return cells;
}

void append(const VoxelIndex& block, std::uint64_t cells, std::vector<VoxelIndex>& list) {
  for (; cells != 0; cells &= cells - 1) {
    const int at = std::countr_zero(cells);
    list.push_back({kPerBlock * block.x + at % 4, kPerBlock * block.y + at / 4 % 4, kPerBlock * block.z + at / 16});
  }
}

}  // namespace

FrontierCells::FrontierCells(const GridSpec& grid, const FrontierConfig& config) : config_(config) {
  const std::vector<std::string> problems = config.problems();
  if (!problems.empty()) throw InputError("frontiers: " + problems.front());
  box_ = voxels_inside(grid, config.box);
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    blocks_[axis] = (grid.size()[axis] + 7) / 8;
    count *= static_cast<std::size_t>(blocks_[axis]);
  }
  cells_.assign(count, 0);
}

FrontierCells::Changes FrontierCells::update(const mapping::OccupancyMap& map, mapping::WorkerPool* workers) {
  std::vector<mapping::VoxelBox> changed;
  map.for_each_block_changed_since(revision_, [&](const mapping::VoxelBox& block) { changed.push_back(block); });
  revision_ = map.revision();
  const std::vector<VoxelIndex> blocks = blocks_to_examine(changed, box_);
  std::vector<std::uint64_t> found(blocks.size());
  mapping::for_each_index_in_parts(workers, blocks.size(), [&](std::size_t i) {
    found[i] = cells_of(frontier_bits(map, box_, config_, blocks[i]));
  });
  Changes changes;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const VoxelIndex& block = blocks[i];
    const std::size_t entry =
        (static_cast<std::size_t>(block.z) * static_cast<std::size_t>(blocks_[1]) + static_cast<std::size_t>(block.y)) *
            static_cast<std::size_t>(blocks_[0]) +
        static_cast<std::size_t>(block.x);
    append(block, found[i] & ~cells_[entry], changes.added);
    append(block, cells_[entry] & ~found[i], changes.removed);
    cells_[entry] = found[i];
  }
  return changes;
}

}  // namespace stairwell::coverage3d
