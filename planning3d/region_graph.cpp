#include "planning3d/region_graph.hpp"

#include "mapping/worker_pool.hpp"
#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace stairwell::planning3d {

namespace {

/// Cells of a block whose coordinate on an axis is 0.
constexpr std::array<std::uint64_t, 3> kFirst{0x1111111111111111U, 0x000F000F000F000FU, 0x000000000000FFFFU};
constexpr std::array<int, 3> kShift{1, 4, 16};  ///< from a cell to the next along an axis
constexpr std::uint32_t kBeyondShare = 4;       ///< lengths are looked for a quarter farther than asked, ...
constexpr std::uint32_t kBeyond = 4;            ///< ... and so many blocks
constexpr int kAcross = RegionGraph::kEdge - 1;

constexpr std::uint64_t last(std::size_t axis) { return kFirst[axis] << (kAcross * kShift[axis]); }

/// With the neighbours along an axis that are in the block.
constexpr std::uint64_t widened(std::uint64_t cells, std::size_t axis) {
  return cells | (cells & ~last(axis)) << kShift[axis] | (cells & ~kFirst[axis]) >> kShift[axis];
}

/// Cells of the next block in the direction -1, 0 or 1 on each axis that touch one of these.
std::uint64_t touched(std::uint64_t cells, const std::array<int, 3>& direction) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int across = kAcross * kShift[axis];
    if (direction[axis] == 0) cells = widened(cells, axis);
    if (direction[axis] > 0) cells = (cells & last(axis)) >> across;
    if (direction[axis] < 0) cells = (cells & kFirst[axis]) << across;
  }
  return cells;
}

/// Of up to four cells in a row: a bit for each.
std::uint64_t passable(const std::uint8_t* flags, int count) {
  std::uint32_t four = 0;
  std::memcpy(&four, flags, static_cast<std::size_t>(count));
  if (four == 0) return 0;
  std::uint64_t bits = 0;
  for (int i = 0; i < count; ++i) bits |= std::uint64_t{flags[i] & 1U} << i;
  static_assert(PassableLattice::kPassable == 1 && sizeof(four) == RegionGraph::kEdge);
  return bits;
}

template <typename Parts>
std::uint8_t parts_in(const Parts& parts) {
  return static_cast<std::uint8_t>(std::find(parts.begin(), parts.end(), std::uint64_t{0}) - parts.begin());
}

}  // namespace

RegionGraph::Parts RegionGraph::split(std::uint64_t cells) {
  Parts parts{};
  for (std::size_t i = 0; cells != 0; ++i) {
    std::uint64_t part = cells & (~cells + 1);
    for (std::uint64_t before = 0; before != part;) {
      before = part;
      part = widened(widened(widened(part, 0), 1), 2) & cells;
    }
    parts[i] = part;
    cells &= ~part;
  }
  return parts;
}

std::size_t RegionGraph::block_of(int x, int y, int z) const {
  const auto row = static_cast<std::size_t>(blocks_[0]);
  const auto slab = row * static_cast<std::size_t>(blocks_[1]);
  return static_cast<std::size_t>(z + 1) * slab + static_cast<std::size_t>(y + 1) * row +
         static_cast<std::size_t>(x + 1);
}

/// The passable cells of the blocks of a layer. @pre they are 0
void RegionGraph::read_layer(const PassableLattice& lattice, int layer, std::vector<std::uint64_t>& cells) const {
  const auto rows = static_cast<std::size_t>(frame_.size[1]);
  const int whole = frame_.size[0] / kEdge * kEdge;
  for (int z = layer * kEdge; z < std::min((layer + 1) * kEdge, frame_.size[2]); ++z) {
    const std::uint8_t* row =
        lattice.flags().data() + static_cast<std::size_t>(z) * rows * static_cast<std::size_t>(frame_.size[0]);
    for (int y = 0; y < frame_.size[1]; ++y, row += frame_.size[0]) {
      std::uint64_t* const blocks = cells.data() + block_of(0, y / kEdge, layer);
      const int in_block = y % kEdge * kShift[1] + z % kEdge * kShift[2];
      for (int x = 0; x < whole; x += kEdge) {
        const std::uint64_t bits = passable(row + x, kEdge);
        if (bits != 0) blocks[x / kEdge] |= bits << in_block;
      }
      if (whole < frame_.size[0]) blocks[whole / kEdge] |= passable(row + whole, frame_.size[0] - whole) << in_block;
    }
  }
}

void RegionGraph::update(const PassableLattice& lattice, mapping::WorkerPool* workers) {
  if (!(frame_ == lattice.frame()) || cells_.empty()) {
    frame_ = lattice.frame();
    for (std::size_t axis = 0; axis < 3; ++axis) blocks_[axis] = (frame_.size[axis] + kEdge - 1) / kEdge + 2;
    cells_.assign(block_of(blocks_[0] - 2, blocks_[1] - 2, blocks_[2] - 2) + 1, 0);
    parts_.assign(cells_.size(), Parts{});
    counts_.assign(cells_.size(), 0);
  }
  now_.assign(cells_.size(), 0);
  const auto layers = static_cast<std::size_t>(blocks_[2] - 2);
  mapping::for_each_index(workers, layers, [&](std::size_t i) {
    const int layer = static_cast<int>(i);
    read_layer(lattice, layer, now_);
    const std::size_t first = block_of(-1, -1, layer);
    const std::size_t end = first + static_cast<std::size_t>(blocks_[0]) * static_cast<std::size_t>(blocks_[1]);
    for (std::size_t block = first; block < end; ++block) {
      if (now_[block] == cells_[block]) continue;
      parts_[block] = split(now_[block]);
      counts_[block] = parts_in(parts_[block]);
    }
  });
  cells_.swap(now_);
}

std::uint32_t RegionGraph::part_of(const VoxelIndex& v) const {
  const int w = frame_.cell_voxels;
  const int x = v.x / w + 1;
  const int y = v.y / w + 1;
  const int z = v.z / w + 1;
  const std::size_t block = block_of(x / kEdge, y / kEdge, z / kEdge);
  const std::uint64_t cell = std::uint64_t{1} << (x % kEdge + y % kEdge * kShift[1] + z % kEdge * kShift[2]);
  for (std::size_t i = 0; i < kMostParts && (cells_[block] & cell) != 0; ++i) {
    if ((parts_[block][i] & cell) != 0) return static_cast<std::uint32_t>(block * kMostParts + i);
  }
  return kNone;
}

void RegionGraph::lengths_from(std::uint32_t part, std::vector<float>& lengths, std::uint32_t until) const {
  lengths.assign(parts_.size() * kMostParts, kUnreachable);
  const std::ptrdiff_t row = blocks_[0];
  const std::ptrdiff_t slab = row * blocks_[1];
  std::array<std::ptrdiff_t, kGridMoves.size()> offsets{};
  for (std::size_t m = 0; m < kGridMoves.size(); ++m)
    offsets[m] = kGridMoves[m].x + kGridMoves[m].y * row + kGridMoves[m].z * slab;
  // Most neighbours are near already: lengths and counts are all that is read of them.
  const auto any_farther = [&](std::size_t block, float through) {
    const float* const there = lengths.data() + block * kMostParts;
    return std::any_of(there, there + counts_[block], [through](float length) { return through < length; });
  };
  // By buckets one block step wide: a bucket's lengths are final when its turn comes (see TravelCosts).
  std::array<std::vector<std::uint32_t>, 3> buckets;
  std::vector<std::uint32_t> got_to{part};
  lengths[part] = 0.0F;
  buckets[0].push_back(part);
  std::uint32_t turn = 0;
  std::uint32_t last_turn = kNone;
  for (int empty = 0; empty < 3 && turn < last_turn; ++turn) {
    if (until != kNone && last_turn == kNone && lengths[until] < static_cast<float>(turn))
      last_turn = turn + turn / kBeyondShare + kBeyond;
    auto& bucket = buckets[turn % 3];
    empty = bucket.empty() ? empty + 1 : 0;
    for (const std::uint32_t from : bucket) {
      const float length = lengths[from];
      if (static_cast<std::uint32_t>(length) != turn) continue;  // lowered since
      const std::size_t block = from / kMostParts;
      for (std::size_t m = 0; m < kGridMoves.size(); ++m) {
        const GridMove& move = kGridMoves[m];
        const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(block) + offsets[m]);
        const float through = length + move.length;
        if (!any_farther(next, through)) continue;
        const std::uint64_t cells = touched(parts_[block][from % kMostParts], {move.x, move.y, move.z}) & cells_[next];
        float* const there = lengths.data() + next * kMostParts;
        for (std::size_t i = 0; i < counts_[next]; ++i) {
          if ((parts_[next][i] & cells) == 0 || through >= there[i]) continue;
          const auto lowered = static_cast<std::uint32_t>(next * kMostParts + i);
          if (there[i] == kUnreachable) got_to.push_back(lowered);
          there[i] = through;
          buckets[static_cast<std::uint32_t>(through) % 3].push_back(lowered);
        }
      }
    }
    bucket.clear();
  }
  constexpr auto kCells = static_cast<float>(kEdge);
  if (turn != last_turn) {
    for (const std::uint32_t there : got_to) lengths[there] *= kCells;
    return;
  }
  // What was not got to is farther than all that was.
  const auto rest = static_cast<float>(turn);
  for (float& length : lengths) length = std::min(length, rest) * kCells;
}

}  // namespace stairwell::planning3d
