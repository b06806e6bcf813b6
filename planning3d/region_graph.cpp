#include "planning3d/region_graph.hpp"

#include "mapping/worker_pool.hpp"
#include "planning3d/grid_moves.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace stairwell::planning3d {

namespace {

/// Cells of a block whose coordinate on an axis is 0.
constexpr std::array<std::uint64_t, 3> kFirst{0x1111111111111111U, 0x000F000F000F000FU, 0x000000000000FFFFU};
constexpr std::array<int, 3> kShift{1, 4, 16};  ///< from a cell to the next along an axis
constexpr std::uint32_t kBeyondShare = 8;       ///< ways to a part are looked for that are an eighth longer ...
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

/// The 27 blocks about one, x fastest: where they lie, and how far.
struct Beside {
  int x, y, z;
  float length;
};
constexpr std::size_t kSelf = 13;
constexpr std::array<Beside, 27> kBeside = [] {
  std::array<Beside, 27> beside{};
  for (std::size_t m = 0; m < kGridMoves.size(); ++m)
    beside[m < kSelf ? m : m + 1] = {kGridMoves[m].x, kGridMoves[m].y, kGridMoves[m].z, kGridMoves[m].length};
  return beside;
}();

/// Those of the 27 that are also about the block one came from by `step`.
constexpr std::array<std::uint32_t, 27> kShared = [] {
  std::array<std::uint32_t, 27> shared{};
  const auto near = [](int a, int b) { return a + b >= -1 && a + b <= 1; };
  for (std::size_t step = 0; step < kBeside.size(); ++step) {
    for (std::size_t to = 0; to < kBeside.size(); ++to) {
      const Beside& a = kBeside[step];
      const Beside& b = kBeside[to];
      if (near(a.x, b.x) && near(a.y, b.y) && near(a.z, b.z)) shared[step] |= 1U << to;
    }
  }
  return shared;
}();

/// What is about the block one came from by `step`, as about this one.
std::uint32_t seen_from(std::uint32_t about_the_one_before, std::size_t step) {
  const int shift = static_cast<int>(step) - static_cast<int>(kSelf);
  return (shift > 0 ? about_the_one_before >> shift : about_the_one_before << -shift) & kShared[step];
}

/// The shortest way between blocks that lie so far apart, in steps; rounded down.
float least_steps(std::array<int, 3> apart) {
  for (int& one : apart) one = std::abs(one);
  std::sort(apart.begin(), apart.end());
  return static_cast<float>(apart[2]) + 0.41421354F * static_cast<float>(apart[1]) +
         0.31783719F * static_cast<float>(apart[0]);
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

std::array<std::ptrdiff_t, 27> RegionGraph::offsets() const {
  const std::ptrdiff_t row = blocks_[0];
  const std::ptrdiff_t slab = row * blocks_[1];
  std::array<std::ptrdiff_t, 27> offsets{};
  for (std::size_t m = 0; m < kBeside.size(); ++m) offsets[m] = kBeside[m].x + kBeside[m].y * row + kBeside[m].z * slab;
  return offsets;
}

void RegionGraph::link(std::size_t block, const std::array<std::ptrdiff_t, 27>& offsets) {
  for (std::size_t i = 0; i < counts_[block]; ++i) {  // none in the border
    Links links{0, counts_[block] == 1 ? 1U << kSelf : 0U};
    for (std::size_t m = 0; m < kBeside.size(); ++m) {
      const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(block) + offsets[m]);
      if (m == kSelf || cells_[next] == 0) continue;
      if ((touched(parts_[block][i], {kBeside[m].x, kBeside[m].y, kBeside[m].z}) & cells_[next]) == 0) continue;
      links.any |= 1U << m;
      if (counts_[next] == 1) links.only |= 1U << m;
    }
    links_[number(block, i)] = links;
  }
}

bool RegionGraph::update(const PassableLattice& lattice, mapping::WorkerPool* workers) {
  if (!(frame_ == lattice.frame()) || cells_.empty()) {
    frame_ = lattice.frame();
    for (std::size_t axis = 0; axis < 3; ++axis) blocks_[axis] = (frame_.size[axis] + kEdge - 1) / kEdge + 2;
    cells_.assign(block_of(blocks_[0] - 2, blocks_[1] - 2, blocks_[2] - 2) + 1, 0);
    parts_.assign(cells_.size(), Parts{});
    counts_.assign(cells_.size(), 0);
    links_.clear();
    outdated_.assign(cells_.size(), 0);
  }
  now_.assign(cells_.size(), 0);
  const auto layers = static_cast<std::size_t>(blocks_[2] - 2);
  const auto slab = static_cast<std::size_t>(blocks_[0]) * static_cast<std::size_t>(blocks_[1]);
  std::vector<std::vector<std::size_t>> changed(layers);
  mapping::for_each_index(workers, layers, [&](std::size_t i) {
    const int layer = static_cast<int>(i);
    read_layer(lattice, layer, now_);
    const std::size_t first = block_of(-1, -1, layer);
    for (std::size_t block = first; block < first + slab; ++block) {
      if (now_[block] == cells_[block]) continue;
      parts_[block] = split(now_[block]);
      counts_[block] = parts_in(parts_[block]);
      changed[i].push_back(block);
    }
  });
  cells_.swap(now_);
  const std::array<std::ptrdiff_t, 27> beside = offsets();
  std::size_t most = links_.size() / cells_.size();
  bool any = false;
  for (const std::vector<std::size_t>& blocks : changed) {
    for (const std::size_t block : blocks) {
      any = true;
      most = std::max<std::size_t>(most, counts_[block]);
      for (const std::ptrdiff_t offset : beside)
        outdated_[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(block) + offset)] = 1;
    }
  }
  if (!any) return false;
  links_.resize(most * cells_.size());
  mapping::for_each_index(workers, layers, [&](std::size_t i) {
    const std::size_t first = block_of(-1, -1, static_cast<int>(i));
    for (std::size_t block = first; block < first + slab; ++block) {
      if (outdated_[block] == 0) continue;
      outdated_[block] = 0;
      link(block, beside);
    }
  });
  return true;
}

std::uint32_t RegionGraph::part_of(const VoxelIndex& v) const {
  const int w = frame_.cell_voxels;
  const int x = v.x / w + 1;
  const int y = v.y / w + 1;
  const int z = v.z / w + 1;
  const std::size_t block = block_of(x / kEdge, y / kEdge, z / kEdge);
  const std::uint64_t cell = std::uint64_t{1} << (x % kEdge + y % kEdge * kShift[1] + z % kEdge * kShift[2]);
  for (std::size_t i = 0; i < kMostParts && (cells_[block] & cell) != 0; ++i) {
    if ((parts_[block][i] & cell) != 0) return static_cast<std::uint32_t>(number(block, i));
  }
  return kNone;
}

// By buckets one block step wide (see TravelCosts). With `until` it is A*, by the length of the whole way. A bucket
// then leads into itself and up to four farther on: five of them in a ring are enough.
void RegionGraph::lengths_from(std::uint32_t part, std::vector<float>& lengths, std::uint32_t until) const {
  struct Entry {
    std::uint32_t part;
    float length;
  };
  constexpr std::uint32_t kRing = 5;
  std::array<std::vector<Entry>, kRing> buckets;
  lengths.assign(links_.size(), kUnreachable);
  std::vector<std::uint8_t> steps(links_.size());  // that led here
  std::vector<std::uint32_t> got_to;
  const std::size_t blocks = cells_.size();
  const std::array<std::ptrdiff_t, 27> beside = offsets();
  const auto place = [this](std::size_t block) {
    const auto row = static_cast<std::size_t>(blocks_[0]);
    const auto slab = row * static_cast<std::size_t>(blocks_[1]);
    return std::array<int, 3>{static_cast<int>(block % row), static_cast<int>(block % slab / row),
                              static_cast<int>(block / slab)};
  };
  const std::array<int, 3> end = until == kNone ? std::array<int, 3>{} : place(until % blocks);
  std::uint32_t turn = 0;
  const auto lower = [&](std::size_t to, float through, std::size_t step) {
    float& length = lengths[to];
    if (through >= length) return;
    if (length == kUnreachable) got_to.push_back(static_cast<std::uint32_t>(to));
    length = through;
    steps[to] = static_cast<std::uint8_t>(step);
    float whole = through;
    if (until != kNone) {
      const std::array<int, 3> at = place(to % blocks);
      whole += least_steps({end[0] - at[0], end[1] - at[1], end[2] - at[2]});
    }
    const std::uint32_t bucket = std::max(turn, static_cast<std::uint32_t>(whole));  // never back, though rounded
    buckets[bucket % kRing].push_back({static_cast<std::uint32_t>(to), through});
  };
  if (until != kNone) {
    const std::array<int, 3> at = place(part % blocks);
    turn = static_cast<std::uint32_t>(least_steps({end[0] - at[0], end[1] - at[1], end[2] - at[2]}));
  }
  lower(part, 0.0F, kSelf);
  std::uint32_t last_turn = kNone;
  for (std::uint32_t empty = 0; empty < kRing && turn < last_turn; ++turn) {
    if (until != kNone && last_turn == kNone && lengths[until] < static_cast<float>(turn))
      last_turn = turn + turn / kBeyondShare + kBeyond;
    auto& bucket = buckets[turn % kRing];
    empty = bucket.empty() ? empty + 1 : 0;
    for (std::size_t n = 0; n < bucket.size(); ++n) {
      const auto [from, length] = bucket[n];
      if (lengths[from] != length) continue;  // lowered since
      const std::size_t block = from < blocks ? from : from % blocks;
      // A part that also touches the one before was reached from there already, and by no longer way.
      const Links links = links_[from];
      std::uint32_t worth = links.any;
      const std::size_t step = steps[from];
      if (step != kSelf) {
        const std::size_t before = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(block) - beside[step]);
        if (counts_[before] == 1) worth &= ~seen_from(links_[before].only, step);
      }
      const auto beside_at = [&](std::size_t m) {
        return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(block) + beside[m]);
      };
      for (std::uint32_t alone = worth & links.only; alone != 0; alone &= alone - 1) {
        const auto m = static_cast<std::size_t>(std::countr_zero(alone));
        lower(beside_at(m), length + kBeside[m].length, m);
      }
      for (std::uint32_t several = worth & ~links.only; several != 0; several &= several - 1) {
        const auto m = static_cast<std::size_t>(std::countr_zero(several));
        const std::size_t next = beside_at(m);
        const float through = length + kBeside[m].length;
        std::uint64_t cells = 0;  // looked up when needed: most parts there are near already
        for (std::size_t i = 0; i < counts_[next]; ++i) {
          const std::size_t to = number(next, i);
          if (through >= lengths[to]) continue;
          if (cells == 0) cells = touched(parts_[block][from / blocks], {kBeside[m].x, kBeside[m].y, kBeside[m].z});
          if ((parts_[next][i] & cells) != 0) lower(to, through, m);
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
  // By way of what was not got to it is farther than by all that was.
  const auto rest = static_cast<float>(turn);
  for (float& length : lengths) length = std::min(length, rest) * kCells;
}

}  // namespace stairwell::planning3d
