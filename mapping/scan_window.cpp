#include "mapping/scan_window.hpp"

#include "mapping/lane_walk.hpp"
#include "mapping/occupancy_map.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace stairwell::mapping {

namespace {

constexpr int kRim = 1;
constexpr int kBlock = OccupancyMap::kBlock;

/// Block that holds voxel `v` of the block table; negative before its first voxel.
int block_of(int v) { return v >> 3; }

/// Bit i of the result is the lowest bit of byte i.
std::uint64_t lowest_bits(std::uint64_t bytes) {
  return ((bytes & 0x0101010101010101ULL) * 0x0102040810204080ULL) >> 56;
}

bool in_table(const OccupancyMap& map, const VoxelIndex& block) {
  const std::array<int, 3>& count = map.block_count();
  return block.x >= 0 && block.y >= 0 && block.z >= 0 && block.x < count[0] && block.y < count[1] && block.z < count[2];
}

}  // namespace

void LatticeBox::extend(const LatticeKey& key) {
  lo = {std::min(lo.x, key.x), std::min(lo.y, key.y), std::min(lo.z, key.z)};
  hi = {std::max(hi.x, key.x), std::max(hi.y, key.y), std::max(hi.z, key.z)};
}

bool ScanWindow::open(const OccupancyMap& map, const LatticeBox& reach, const LatticeBox* limit) {
  const std::array<int, 3> reach_lo{reach.lo.x, reach.lo.y, reach.lo.z};
  const std::array<int, 3> reach_hi{reach.hi.x, reach.hi.y, reach.hi.z};
  constexpr int kAny = std::numeric_limits<int>::max();
  const LatticeBox within = limit != nullptr ? *limit : LatticeBox{{-kAny, -kAny, -kAny}, {kAny, kAny, kAny}};
  const std::array<int, 3> limit_lo{within.lo.x, within.lo.y, within.lo.z};
  const std::array<int, 3> limit_hi{within.hi.x, within.hi.y, within.hi.z};
  std::array<int, 3> lo{};
  std::array<int, 3> first{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int grid_lo = map.grid().first_cell()[axis] + kKeyOrigin;
    const int grid_hi = grid_lo + map.grid().size()[axis] - 1;
    lo[axis] = std::max({reach_lo[axis] - 1, grid_lo, limit_lo[axis]});
    const int hi = std::min({reach_hi[axis] + 1, grid_hi, limit_hi[axis]});
    if (lo[axis] > hi) {
      return false;
    }
    size_[axis] = static_cast<unsigned>(hi - lo[axis] + 1);
    const int table_lo = grid_lo - map.block_offset()[axis];  // key of the block table's first voxel
    first_block_[axis] = block_of(lo[axis] - kRim - table_lo);
    blocks_[axis] = block_of(hi + kRim - table_lo) - first_block_[axis] + 1;
    first[axis] = table_lo + first_block_[axis] * kBlock;
  }
  lo_ = {lo[0], lo[1], lo[2]};
  first_ = {first[0], first[1], first[2]};
  stride_y_ = blocks_[0] * kBlock;
  stride_z_ = stride_y_ * blocks_[1] * kBlock;
  const auto needed = static_cast<std::size_t>(stride_z_ * blocks_[2] * kBlock) + 1;  // and the spare cell
  if (cells_.size() < needed) {
    cells_.assign(needed, 0);
  }
  return true;
}

int ScanWindow::longest_side() const { return static_cast<int>(*std::max_element(size_.begin(), size_.end())); }

WindowView ScanWindow::view(const LatticeKey& origin_key) {
  WindowView view;
  view.cells = cells_.data();
  view.first = {first_.x, first_.y, first_.z};
  view.lo = {lo_.x, lo_.y, lo_.z};
  view.extent = {size_[0], size_[1], size_[2]};
  view.origin_cell = -1;
  if (cells_.size() <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    view.stride = {1, static_cast<std::int32_t>(stride_y_), static_cast<std::int32_t>(stride_z_)};
    view.spare_cell = static_cast<std::int32_t>(spare_cell());
    if (covers(origin_key)) view.origin_cell = static_cast<std::int32_t>(index_of(origin_key));
  }
  return view;
}

void ScanWindow::take(std::span<ScanWindow* const> windows, const OccupancyMap& map, int part, int parts,
                      std::vector<BlockUpdate>& updates) {
  const ScanWindow& shape = *windows.front();
  const auto [blocks_x, blocks_y, blocks_z] = shape.blocks_;
  const int rows = blocks_y * blocks_z;
  for (int row = rows * part / parts; row < rows * (part + 1) / parts; ++row) {
    const int by = row % blocks_y;
    const int bz = row / blocks_y;
    const std::ptrdiff_t first = bz * kBlock * shape.stride_z_ + by * kBlock * shape.stride_y_;
    const VoxelIndex at{shape.first_block_[0], shape.first_block_[1] + by, shape.first_block_[2] + bz};
    for (int bx = 0; bx < blocks_x; ++bx) {
      BlockUpdate update{at + VoxelIndex{bx, 0, 0}, {}};
      bool any = false;
      for (ScanWindow* window : windows) any = window->take_block(first + bx * kBlock, update.mask) || any;
      if (any && in_table(map, update.block)) updates.push_back(update);  // the rim may lie outside
    }
  }
}

/// Rows of 8 voxels become bytes of the masks.
bool ScanWindow::take_block(std::ptrdiff_t corner, BlockMask& mask) {
  bool any = false;
  for (std::size_t z = 0; z < kBlock; ++z) {
    std::uint8_t* cells = cells_.data() + corner + static_cast<std::ptrdiff_t>(z) * stride_z_;
    for (std::size_t y = 0; y < kBlock; ++y, cells += stride_y_) {
      std::uint64_t bytes = 0;
      std::memcpy(&bytes, cells, sizeof(bytes));
      if (bytes == 0) continue;
      any = true;
      mask.miss[z] |= lowest_bits(bytes) << (8 * y);
      mask.hit[z] |= lowest_bits(bytes >> 1) << (8 * y);
      std::memset(cells, 0, sizeof(bytes));
    }
  }
  return any;
}

}  // namespace stairwell::mapping
