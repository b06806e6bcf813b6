#include "coverage3d/frontier_voxels.hpp"

#include "core/errors.hpp"
#include "mapping/summary_bits.hpp"

#include <algorithm>
#include <bit>
#include <numeric>
#include <tuple>

namespace stairwell::coverage3d {
namespace {

constexpr int kBlock = 8;

/// Classes of the voxels around a place, a bit each: bit `x + 1` of row (y + 1, z + 1) stands for the voxel that lies
/// (x, y, z) from it. What lies outside the task box is neither free nor unknown. A free voxel in which a return once
/// fell lies at a surface: the unknown behind it is the inside of something solid.
struct Surroundings {
  using Rows = std::array<std::array<std::uint32_t, kBlock + 2>, kBlock + 2>;
  Rows free{};
  Rows unknown{};

  /// @param side  of the cube that begins at `origin`; one voxel around it is read as well
  /// @pre `box` lies in the grid
  Surroundings(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const VoxelIndex& origin, int side) {
    const auto first = [](int origin_at, int lowest) { return std::max(-1, lowest - origin_at); };
    const auto last = [side](int origin_at, int highest) { return std::min(side, highest - origin_at); };
    const int x_begin = first(origin.x, box.lo.x);
    const int x_end = last(origin.x, box.hi.x);
    if (x_begin > x_end) return;
    for (int z = first(origin.z, box.lo.z); z <= last(origin.z, box.hi.z); ++z) {
      for (int y = first(origin.y, box.lo.y); y <= last(origin.y, box.hi.y); ++y) {
        std::uint32_t& free_row = free[static_cast<std::size_t>(z + 1)][static_cast<std::size_t>(y + 1)];
        std::uint32_t& unknown_row = unknown[static_cast<std::size_t>(z + 1)][static_cast<std::size_t>(y + 1)];
        const std::uint8_t* const row = map.summaries() + map.grid().linear(origin + VoxelIndex{x_begin, y, z});
        for (int x = x_begin; x <= x_end; x += kBlock) {
          const mapping::EightSummaries some(row + (x - x_begin), std::min(kBlock, x_end + 1 - x));
          unknown_row |= some.unknown() << (x + 1);
          free_row |= some.clear() << (x + 1);
        }
      }
    }
  }

  /// Free voxels of a row with an unknown one beside them. @param y, z  from 1
  std::uint32_t beside_unknown(std::size_t y, std::size_t z) const {
    const std::uint32_t in_row = unknown[z][y] << 1 | unknown[z][y] >> 1;
    return free[z][y] & (in_row | unknown[z][y - 1] | unknown[z][y + 1] | unknown[z - 1][y] | unknown[z + 1][y]);
  }

  /// Whether the 26 neighbours of the voxel at bit `x` of a row are as the definition wants them.
  bool enough_around(std::size_t x, std::size_t y, std::size_t z, const FrontierConfig& config) const {
    int free_count = -1;  // the voxel itself
    int unknown_count = 0;
    for (std::size_t k = z - 1; k <= z + 1; ++k) {
      for (std::size_t j = y - 1; j <= y + 1; ++j) {
        free_count += std::popcount(free[k][j] >> (x - 1) & 7U);
        unknown_count += std::popcount(unknown[k][j] >> (x - 1) & 7U);
      }
    }
    return free_count >= config.min_free_neighbours && unknown_count >= config.min_unknown_neighbours;
  }
};

bool planar_frontier(const mapping::OccupancyMap& map, const VoxelIndex& v) {
  if (map.at(v) != Occupancy::kFree || map.ever_hit(v)) return false;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      const VoxelIndex beside = v + VoxelIndex{x, y, 0};
      if (map.grid().contains(beside) && map.at(beside) == Occupancy::kUnknown) return true;
    }
  return false;
}

BlockBits planar_frontier_bits(const mapping::OccupancyMap& map, const mapping::VoxelBox& box,
                               const VoxelIndex& origin) {
  BlockBits bits{};
  for (int z = 0; z < kBlock; ++z)
    for (int i = 0; i < kBlock * kBlock; ++i) {
      const VoxelIndex v = origin + VoxelIndex{i % kBlock, i / kBlock, z};
      if (holds(box, v) && planar_frontier(map, v)) bits[static_cast<std::size_t>(z)] |= std::uint64_t{1} << i;
    }
  return bits;
}

constexpr std::uint64_t kFirstColumn = 0x0101010101010101ULL;

/// The set and all its neighbours in the block.
BlockBits dilated(const BlockBits& bits) {
  BlockBits in_layer{};
  for (std::size_t z = 0; z < kBlock; ++z) {
    std::uint64_t word = bits[z];
    word |= (word << 1 & ~kFirstColumn) | (word >> 1 & ~(kFirstColumn << 7));
    in_layer[z] = word | word << 8 | word >> 8;
  }
  BlockBits grown = in_layer;
  for (std::size_t z = 0; z + 1 < kBlock; ++z) {
    grown[z] |= in_layer[z + 1];
    grown[z + 1] |= in_layer[z];
  }
  return grown;
}

/// Cuts a part across its longest side while that is longer than allowed.
void add_cut(const BlockBits& part, int longest, std::vector<BlockBits>& parts) {
  VoxelIndex lo{kBlock, kBlock, kBlock};
  VoxelIndex hi{-1, -1, -1};
  for_each_voxel(part, [&](const VoxelIndex& v) {
    lo = {std::min(lo.x, v.x), std::min(lo.y, v.y), std::min(lo.z, v.z)};
    hi = {std::max(hi.x, v.x), std::max(hi.y, v.y), std::max(hi.z, v.z)};
  });
  const VoxelIndex extent = hi - lo;
  const int most = std::max({extent.x, extent.y, extent.z});
  if (most + 1 <= longest || most == 0) {
    parts.push_back(part);
    return;
  }
  BlockBits lower{};
  BlockBits upper{};
  for_each_voxel(part, [&](const VoxelIndex& v) {
    const VoxelIndex along = v - lo;
    const int at = extent.x == most ? along.x : extent.y == most ? along.y : along.z;
    BlockBits& half = 2 * at <= most ? lower : upper;
    half[static_cast<std::size_t>(v.z)] |= std::uint64_t{1} << (8 * v.y + v.x);
  });
  add_cut(lower, longest, parts);
  add_cut(upper, longest, parts);
}

mapping::VoxelBox clipped(const mapping::VoxelBox& a, const mapping::VoxelBox& b) {
  return {{std::max(a.lo.x, b.lo.x), std::max(a.lo.y, b.lo.y), std::max(a.lo.z, b.lo.z)},
          {std::min(a.hi.x, b.hi.x), std::min(a.hi.y, b.hi.y), std::min(a.hi.z, b.hi.z)}};
}

bool empty(const mapping::VoxelBox& box) { return box.lo.x > box.hi.x || box.lo.y > box.hi.y || box.lo.z > box.hi.z; }

}  // namespace

mapping::VoxelBox voxels_inside(const GridSpec& grid, const Aabb& box) {
  if (box.intersection(grid.box()).empty()) throw InputError("frontiers: the task box lies outside the map");
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid.resolution_m() - 1e-9);
  const Aabb within = box.intersection(grid.box());
  const mapping::VoxelBox voxels = clipped({grid.index_of(within.min_m + half), grid.index_of(within.max_m - half)},
                                           {{0, 0, 0}, {grid.size()[0] - 1, grid.size()[1] - 1, grid.size()[2] - 1}});
  if (empty(voxels)) throw InputError("frontiers: the task box holds no voxel centre of the map");
  return voxels;
}

std::vector<VoxelIndex> blocks_to_examine(const std::vector<mapping::VoxelBox>& changed, const mapping::VoxelBox& box) {
  std::vector<VoxelIndex> blocks;
  for (const mapping::VoxelBox& one : changed) {
    const mapping::VoxelBox range = clipped({one.lo - VoxelIndex{1, 1, 1}, one.hi + VoxelIndex{1, 1, 1}}, box);
    if (empty(range)) continue;
    for (int z = range.lo.z >> 3; z <= range.hi.z >> 3; ++z)
      for (int y = range.lo.y >> 3; y <= range.hi.y >> 3; ++y)
        for (int x = range.lo.x >> 3; x <= range.hi.x >> 3; ++x) blocks.push_back({x, y, z});
  }
  const auto order = [](const VoxelIndex& v) { return std::tuple(v.z, v.y, v.x); };
  std::sort(blocks.begin(), blocks.end(),
            [&](const VoxelIndex& a, const VoxelIndex& b) { return order(a) < order(b); });
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

std::vector<std::string> FrontierConfig::problems() const {
  std::vector<std::string> found;
  if (box.empty()) found.emplace_back("the task box is empty");
  if (min_free_neighbours < 0 || min_free_neighbours > 26) found.emplace_back("min_free_neighbours is not in 0..26");
  if (min_unknown_neighbours < 0 || min_unknown_neighbours > 26)
    found.emplace_back("min_unknown_neighbours is not in 0..26");
  if (!(split_size_m > 0.0)) found.emplace_back("split_size_m is not positive");
  if (!(min_area_m2 >= 0.0)) found.emplace_back("min_area_m2 is negative");
  return found;
}

bool is_frontier(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                 const VoxelIndex& v) {
  if (map.at(v) != Occupancy::kFree || !holds(box, v)) return false;
  if (config.planar) return planar_frontier(map, v);
  const Surroundings around(map, box, v, 1);
  return (around.beside_unknown(1, 1) & 2U) != 0 && around.enough_around(1, 1, 1, config);
}

BlockBits frontier_bits(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                        const VoxelIndex& block) {
  const VoxelIndex origin = origin_of(block);
  if (config.planar) return planar_frontier_bits(map, box, origin);
  const Surroundings around(map, box, origin, kBlock);
  BlockBits bits{};
  for (std::size_t z = 1; z <= kBlock; ++z) {
    for (std::size_t y = 1; y <= kBlock; ++y) {
      for (std::uint32_t rest = around.beside_unknown(y, z) & 0x1FEU; rest != 0; rest &= rest - 1) {
        const auto x = static_cast<std::size_t>(std::countr_zero(rest));
        if (around.enough_around(x, y, z, config)) bits[z - 1] |= std::uint64_t{1} << (8 * (y - 1) + x - 1);
      }
    }
  }
  return bits;
}

int count(const BlockBits& bits) {
  return std::accumulate(bits.begin(), bits.end(), 0,
                         [](int sum, std::uint64_t word) { return sum + std::popcount(word); });
}

std::vector<BlockBits> connected_parts(const BlockBits& bits, int longest) {
  std::vector<BlockBits> parts;
  BlockBits left = bits;
  for (std::size_t z = 0; z < kBlock; ++z) {
    while (left[z] != 0) {
      BlockBits part{};
      part[z] = left[z] & (~left[z] + 1);  // the lowest bit
      for (BlockBits before{}; part != before;) {
        before = part;
        part = dilated(part);
        for (std::size_t k = 0; k < kBlock; ++k) part[k] &= left[k];
      }
      for (std::size_t k = 0; k < kBlock; ++k) left[k] &= ~part[k];
      add_cut(part, longest, parts);
    }
  }
  return parts;
}

}  // namespace stairwell::coverage3d
