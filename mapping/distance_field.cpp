#include "mapping/distance_field.hpp"

#include "core/errors.hpp"
#include "mapping/distance_pass.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace stairwell::mapping {

namespace {

constexpr int kMaxTruncation_cells = 127;  // sums of two squares fit into int16
constexpr int kBlock = 8;                  // voxels a side; changes are noted block by block
constexpr int kTile = 256;                 // cells a side that are recomputed at once

VoxelBox grown(const VoxelBox& box, int by, const std::array<int, 3>& size) {
  return {{std::max(box.lo.x - by, 0), std::max(box.lo.y - by, 0), std::max(box.lo.z - by, 0)},
          {std::min(box.hi.x + by, size[0] - 1), std::min(box.hi.y + by, size[1] - 1),
           std::min(box.hi.z + by, size[2] - 1)}};
}

VoxelBox united(const VoxelBox& a, const VoxelBox& b) {
  return {{std::min(a.lo.x, b.lo.x), std::min(a.lo.y, b.lo.y), std::min(a.lo.z, b.lo.z)},
          {std::max(a.hi.x, b.hi.x), std::max(a.hi.y, b.hi.y), std::max(a.hi.z, b.hi.z)}};
}

double volume(const VoxelBox& box) {
  return static_cast<double>(box.hi.x - box.lo.x + 1) * (box.hi.y - box.lo.y + 1) * (box.hi.z - box.lo.z + 1);
}

/// memcmp of a whole row of a block, without the call.
bool same_block_row(const std::uint16_t* a, const std::int16_t* b) {
  std::uint64_t of_a[2];
  std::uint64_t of_b[2];
  static_assert(sizeof(of_a) == kBlock * sizeof(*a) && sizeof(*a) == sizeof(*b));
  std::memcpy(of_a, a, sizeof(of_a));
  std::memcpy(of_b, b, sizeof(of_b));
  return ((of_a[0] ^ of_b[0]) | (of_a[1] ^ of_b[1])) == 0;
}

/// Joins boxes while recomputing them together costs no more than one by one.
void add_joined(std::vector<VoxelBox>& boxes, VoxelBox box) {
  for (std::size_t i = 0; i < boxes.size();) {
    const VoxelBox both = united(boxes[i], box);
    if (volume(both) <= volume(boxes[i]) + volume(box)) {
      box = both;
      boxes[i] = boxes.back();
      boxes.pop_back();
      i = 0;
    } else {
      ++i;
    }
  }
  boxes.push_back(box);
}

/// Whether some block has voxels in both.
bool share_a_block(const VoxelBox& a, const VoxelBox& b) {
  const auto meet = [](int a_lo, int a_hi, int b_lo, int b_hi) {
    return a_lo / kBlock <= b_hi / kBlock && b_lo / kBlock <= a_hi / kBlock;
  };
  return meet(a.lo.x, a.hi.x, b.lo.x, b.hi.x) && meet(a.lo.y, a.hi.y, b.lo.y, b.hi.y) &&
         meet(a.lo.z, a.hi.z, b.lo.z, b.hi.z);
}

/// Boxes that write into the same blocks belong to the same thread. The groups with most to do first, so that the
/// threads end together.
std::vector<std::vector<VoxelBox>> grouped(const std::vector<VoxelBox>& boxes) {
  std::vector<std::vector<VoxelBox>> groups;
  for (const VoxelBox& box : boxes) {
    std::vector<VoxelBox> joined;
    std::erase_if(groups, [&](const std::vector<VoxelBox>& group) {
      const bool meets =
          std::any_of(group.begin(), group.end(), [&](const VoxelBox& other) { return share_a_block(box, other); });
      if (meets) joined.insert(joined.end(), group.begin(), group.end());
      return meets;
    });
    joined.push_back(box);
    groups.push_back(std::move(joined));
  }
  const auto work = [](const std::vector<VoxelBox>& group) {
    double sum = 0.0;
    for (const VoxelBox& box : group) sum += volume(box);
    return sum;
  };
  std::stable_sort(groups.begin(), groups.end(), [&](const auto& a, const auto& b) { return work(a) > work(b); });
  return groups;
}

}  // namespace

DistanceField::DistanceField(const GridSpec& grid, double truncation_m, Obstacles obstacles)
    : grid_(grid), truncation_m_(truncation_m), obstacles_(obstacles) {
  const double cells = std::ceil(truncation_m / grid.resolution_m() - 1e-6);
  if (!(cells >= 1.0 && cells <= kMaxTruncation_cells)) {
    throw InputError("distance field: truncation of " + std::to_string(truncation_m) + " m must be 1 to " +
                     std::to_string(kMaxTruncation_cells) + " cells of " + std::to_string(grid.resolution_m()) + " m");
  }
  truncation_cells_ = static_cast<int>(cells);
  const auto far = static_cast<std::uint16_t>(truncation_cells_ * truncation_cells_);
  outside_ = obstacles == Obstacles::kBlocked ? std::uint16_t{0} : far;
  squared_.assign(grid.voxel_count(), far);
  std::size_t blocks = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    block_count_[axis] = (grid.size()[axis] + kBlock - 1) / kBlock;
    blocks *= static_cast<std::size_t>(block_count_[axis]);
  }
  block_revision_.assign(blocks, 0);
  row_words_ = (static_cast<std::size_t>(grid.size()[0]) + 63) / 64;
  obstacle_.assign(row_words_ * static_cast<std::size_t>(grid.size()[1]) * static_cast<std::size_t>(grid.size()[2]),
                   obstacles == Obstacles::kBlocked ? ~std::uint64_t{0} : std::uint64_t{0});
}

std::uint64_t DistanceField::Id::next() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

void DistanceField::for_each_block_changed_since(std::uint64_t revision,
                                                 const std::function<void(const VoxelBox&)>& visit) const {
  std::size_t block = 0;
  for (int z = 0; z < block_count_[2]; ++z) {
    for (int y = 0; y < block_count_[1]; ++y) {
      for (int x = 0; x < block_count_[0]; ++x, ++block) {
        if (block_revision_[block] <= revision) continue;
        const VoxelIndex lo{kBlock * x, kBlock * y, kBlock * z};
        visit({lo,
               {std::min(lo.x + kBlock, grid_.size()[0]) - 1, std::min(lo.y + kBlock, grid_.size()[1]) - 1,
                std::min(lo.z + kBlock, grid_.size()[2]) - 1}});
      }
    }
  }
}

double DistanceField::distance_m(const VoxelIndex& v) const {
  return grid_.resolution_m() * std::sqrt(static_cast<double>(squared_cells(v)));
}

bool DistanceField::read_obstacles(const OccupancyMap& map, const VoxelBox& box, VoxelBox& changed) {
  bool any = false;
  VoxelIndex v;
  for (v.z = box.lo.z; v.z <= box.hi.z; ++v.z) {
    for (v.y = box.lo.y; v.y <= box.hi.y; ++v.y) {
      for (v.x = box.lo.x; v.x <= box.hi.x; ++v.x) {
        const bool now = obstacles_ == Obstacles::kBlocked ? map.blocked(v) : map.at(v) == Occupancy::kOccupied;
        std::uint64_t& stored = obstacle_[row_of(v.y, v.z) + static_cast<std::size_t>(v.x >> 6)];
        const std::uint64_t bit = std::uint64_t{1} << (v.x & 63);
        if (((stored & bit) != 0) == now) {
          continue;
        }
        stored ^= bit;
        changed = any ? united(changed, {v, v}) : VoxelBox{v, v};
        any = true;
      }
    }
  }
  return any;
}

void DistanceField::update(const OccupancyMap& map) {
  read_changes(map);
  recompute_changed(nullptr);
}

void DistanceField::read_changes(const OccupancyMap& map) {
  const std::uint64_t map_revision = map.revision();
  map.for_each_block_changed_since(seen_revision_, [&](const VoxelBox& block) {
    VoxelBox changed;
    if (read_obstacles(map, block, changed)) {
      add_joined(to_recompute_, grown(changed, truncation_cells_, grid_.size()));
    }
  });
  seen_revision_ = map_revision;
  if (fresh_) {
    to_recompute_.assign(1, {{0, 0, 0}, {grid_.size()[0] - 1, grid_.size()[1] - 1, grid_.size()[2] - 1}});
    fresh_ = false;
  }
}

void DistanceField::recompute_changed(WorkerPool* workers) {
  if (to_recompute_.empty()) return;
  ++revision_;
  scratch_.resize(workers == nullptr ? 1 : static_cast<std::size_t>(workers->threads()));
  const std::vector<std::vector<VoxelBox>> groups = grouped(to_recompute_);
  share_among_threads(workers, groups.size(), [&](std::size_t i, int thread) {
    for (const VoxelBox& box : groups[i]) recompute_tiles(box, scratch_[static_cast<std::size_t>(thread)]);
  });
  to_recompute_.clear();
}

void DistanceField::recompute_tiles(const VoxelBox& box, Scratch& scratch) {
  for (int z = box.lo.z; z <= box.hi.z; z += kTile) {
    for (int y = box.lo.y; y <= box.hi.y; y += kTile) {
      for (int x = box.lo.x; x <= box.hi.x; x += kTile) {
        recompute(
            {{x, y, z},
             {std::min(x + kTile - 1, box.hi.x), std::min(y + kTile - 1, box.hi.y), std::min(z + kTile - 1, box.hi.z)}},
            scratch);
      }
    }
  }
}

/// One pass per axis; each keeps squared distances to obstacles seen along the axes done so far.
void DistanceField::recompute(const VoxelBox& box, Scratch& scratch) {
  auto& [along_x, along_xy, line] = scratch;
  const VoxelBox around = grown(box, truncation_cells_, grid_.size());
  const Range in_y{around.lo.y, around.hi.y}, in_z{around.lo.z, around.hi.z};
  const Range out_y{box.lo.y, box.hi.y};
  const int pitch = padded_to_pass(box.hi.x - box.lo.x + 1);
  const auto row = [pitch](std::vector<std::int16_t>& data, int index) {
    return data.data() + static_cast<std::ptrdiff_t>(index) * pitch;
  };
  const auto far = static_cast<std::int16_t>(truncation_cells_ * truncation_cells_);

  along_x.resize(static_cast<std::size_t>(pitch) * static_cast<std::size_t>(in_y.count()));
  along_xy.resize(static_cast<std::size_t>(pitch) * static_cast<std::size_t>(out_y.count() * in_z.count()));
  for (int z = in_z.lo; z <= in_z.hi; ++z) {
    bool any = false;
    for (int y = in_y.lo; y <= in_y.hi; ++y) {
      std::int16_t* const out = row(along_x, y - in_y.lo);
      if (read_row(box.lo.x, pitch, y, z, scratch)) {
        parabola_pass(line.data() + truncation_cells_, 1, truncation_cells_, truncation_cells_, out, pitch);
        any = true;
      } else {
        std::fill(out, out + pitch, far);
      }
    }
    for (int y = out_y.lo; y <= out_y.hi; ++y) {
      std::int16_t* const out = row(along_xy, (z - in_z.lo) * out_y.count() + y - out_y.lo);
      if (any) {
        parabola_pass(row(along_x, y - in_y.lo), pitch, std::min(truncation_cells_, y - in_y.lo),
                      std::min(truncation_cells_, in_y.hi - y), out, pitch);
      } else {
        std::fill(out, out + pitch, far);
      }
    }
  }
  line.resize(static_cast<std::size_t>(pitch + 2 * truncation_cells_));
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = out_y.lo; y <= out_y.hi; ++y) {
      parabola_pass(row(along_xy, (z - in_z.lo) * out_y.count() + y - out_y.lo),
                    static_cast<std::ptrdiff_t>(pitch) * out_y.count(), std::min(truncation_cells_, z - in_z.lo),
                    std::min(truncation_cells_, in_z.hi - z), line.data(), pitch);
      write_row({box.lo.x, box.hi.x}, y, z, scratch);
    }
  }
}

/// Fills the scratch's line with 0 at obstacles and the cap elsewhere, from `truncation_cells_` before `first_x` to as
/// many after `first_x + count`. False if there is no obstacle.
bool DistanceField::read_row(int first_x, int count, int y, int z, Scratch& scratch) const {
  std::vector<std::int16_t>& line = scratch.line;
  const auto far = static_cast<std::int16_t>(truncation_cells_ * truncation_cells_);
  const int begin = first_x - truncation_cells_;
  line.assign(static_cast<std::size_t>(count + 2 * truncation_cells_), far);
  const int from = std::max(begin, 0);
  const int to = std::min(first_x + count + truncation_cells_, grid_.size()[0]);
  const std::uint64_t* const words = obstacle_.data() + row_of(y, z);
  bool any = false;
  for (int word = from >> 6; word <= (to - 1) >> 6; ++word) {
    std::uint64_t bits = words[word];
    if (word == from >> 6) bits &= ~std::uint64_t{0} << (from & 63);
    if (word == (to - 1) >> 6) bits &= ~std::uint64_t{0} >> (63 - ((to - 1) & 63));
    any = any || bits != 0;
    std::int16_t* const out = line.data() + word * 64 - begin;
    while (bits != 0) {  // in runs
      const int first = std::countr_zero(bits);
      const int length = std::countr_one(bits >> first);
      std::fill_n(out + first, length, std::int16_t{0});
      bits &= length + first < 64 ? ~std::uint64_t{0} << (first + length) : 0;
    }
  }
  return any;
}

/// For kBlocked the nearest cell outside the grid lies straight along some axis.
void DistanceField::write_row(const Range& x, int y, int z, Scratch& scratch) {
  const std::array<int, 3>& size = grid_.size();
  int across = truncation_cells_;
  if (obstacles_ == Obstacles::kBlocked) across = std::min({y + 1, size[1] - y, z + 1, size[2] - z, across});
  const auto cap = static_cast<std::int16_t>(across * across);
  std::int16_t* const line = scratch.line.data() - x.lo;
  for (int i = x.lo; i <= x.hi; ++i) line[i] = std::min(line[i], cap);
  if (obstacles_ == Obstacles::kBlocked) {
    const auto at_border = [&](int i) {
      const int border = std::min(i + 1, size[0] - i);
      line[i] = std::min(line[i], static_cast<std::int16_t>(border * border));
    };
    for (int i = x.lo; i <= std::min(x.hi, truncation_cells_); ++i) at_border(i);
    for (int i = std::max(x.lo, size[0] - truncation_cells_); i <= x.hi; ++i) at_border(i);
  }
  std::uint16_t* const out = squared_.data() + grid_.linear({0, y, z});
  std::uint64_t* const revisions =
      block_revision_.data() +
      (static_cast<std::ptrdiff_t>(z / kBlock) * block_count_[1] + y / kBlock) * block_count_[0];
  for (int first = x.lo; first <= x.hi; first = (first / kBlock + 1) * kBlock) {
    const auto bytes =
        sizeof(std::uint16_t) * static_cast<std::size_t>(std::min((first / kBlock + 1) * kBlock, x.hi + 1) - first);
    if (bytes == kBlock * sizeof(std::uint16_t) ? same_block_row(out + first, line + first)
                                                : std::memcmp(out + first, line + first, bytes) == 0)
      continue;
    std::memcpy(out + first, line + first, bytes);
    revisions[first / kBlock] = revision_;
  }
}

int min_squared_cells_for(double radius_m, double resolution_m) {
  if (!(radius_m >= 0.0) || !(resolution_m > 0.0) || !std::isfinite(radius_m)) {
    throw InputError("clearance radius " + std::to_string(radius_m) + " m cannot be used");
  }
  const double radius = radius_m / resolution_m;
  const int reach = static_cast<int>(std::ceil(radius + 0.5));
  int needed = 1;
  for (int x = 0; x <= reach; ++x) {
    for (int y = 0; y <= x; ++y) {
      for (int z = 0; z <= y; ++z) {
        // Nearest point of the other voxel's cube, in cells.
        const double dx = std::max(x - 0.5, 0.0), dy = std::max(y - 0.5, 0.0), dz = std::max(z - 0.5, 0.0);
        if (dx * dx + dy * dy + dz * dz < radius * radius * (1.0 - 1e-9)) {
          needed = std::max(needed, x * x + y * y + z * z + 1);
        }
      }
    }
  }
  return needed;
}

}  // namespace stairwell::mapping
