#include "mapping/potential_obstacles.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <string>

namespace stairwell::mapping {

namespace {

int floor_div(int a, int b) { return a / b - (a % b < 0 ? 1 : 0); }

}  // namespace

ObstacleLattice::ObstacleLattice(const GridSpec& grid) : grid_(grid), words_per_row_((grid.size()[0] + 63) / 64) {
  const std::size_t words = static_cast<std::size_t>(words_per_row_) * static_cast<std::size_t>(grid.size()[1]) *
                            static_cast<std::size_t>(grid.size()[2]);
  if (words > std::numeric_limits<std::uint32_t>::max()) {
    throw InputError("potential: the box has too many voxels (" + std::to_string(grid.voxel_count()) + ")");
  }
  words_.assign(words, 0);
  changes_.reserve(kMaxChanges);
}

VoxelIndex ObstacleLattice::first_cell(const Change& change) const {
  const int word = static_cast<int>(change.word % static_cast<std::uint32_t>(words_per_row_));
  const auto row = static_cast<int>(change.word / static_cast<std::uint32_t>(words_per_row_));
  return {word * 64, row % grid_.size()[1], row / grid_.size()[1]};
}

void ObstacleLattice::begin() {
  changes_.clear();
  too_many_ = false;
}

void ObstacleLattice::flip(const VoxelIndex& v) {
  const auto word = static_cast<std::uint32_t>(word_of(v));
  const std::uint64_t bit = std::uint64_t{1} << (static_cast<unsigned>(v.x) & 63U);
  words_[word] ^= bit;
  if (!changes_.empty() && changes_.back().word == word) {
    changes_.back().added ^= bit;  // until end(): flipped
  } else if (changes_.size() < kMaxChanges) {
    changes_.push_back({word, bit, 0});
  } else {
    too_many_ = true;
  }
}

void ObstacleLattice::end() {
  std::sort(changes_.begin(), changes_.end(), [](const Change& a, const Change& b) { return a.word < b.word; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < changes_.size();) {
    Change merged{changes_[i].word, 0, 0};
    std::uint64_t flipped = 0;
    for (; i < changes_.size() && changes_[i].word == merged.word; ++i) flipped ^= changes_[i].added;
    merged.added = flipped & words_[merged.word];
    merged.removed = flipped & ~words_[merged.word];
    if (flipped != 0) changes_[kept++] = merged;
  }
  changes_.resize(kept);
  ++revision_;
}

PotentialObstacles::PotentialObstacles(const GridSpec& map_grid, int coarse_factor, double coarse_truncation_m)
    : factor_(coarse_factor),
      fine_(map_grid),
      coarse_(coarse_factor < 1 ? throw InputError("potential: coarse factor must be at least 1, got " +
                                                   std::to_string(coarse_factor))
                                : GridSpec(map_grid.box(), coarse_factor * map_grid.resolution_m())) {
  occupied_in_coarse_.assign(coarse_.grid().voxel_count(), 0);
  blocks_.reserve(ObstacleLattice::kMaxChanges);
  if (coarse_truncation_m != 0.0) {
    coarse_map_ = std::make_unique<OccupancyMap>(coarse_.grid());
    coarse_distances_ = std::make_unique<DistanceField>(coarse_.grid(), coarse_truncation_m, Obstacles::kOccupied);
  }
}

VoxelIndex PotentialObstacles::coarse_cell(const VoxelIndex& v) const {
  const std::array<int, 3>& first = fine_.grid().first_cell();
  const std::array<int, 3>& coarse_first = coarse_.grid().first_cell();
  return {floor_div(first[0] + v.x, factor_) - coarse_first[0], floor_div(first[1] + v.y, factor_) - coarse_first[1],
          floor_div(first[2] + v.z, factor_) - coarse_first[2]};
}

void PotentialObstacles::count(const VoxelIndex& v, bool occupied) {
  const VoxelIndex cell = coarse_cell(v);
  std::uint32_t& held = occupied_in_coarse_[coarse_.grid().linear(cell)];
  const std::uint32_t before = held;
  held = occupied ? held + 1 : held - 1;
  if ((before == 0) == (held == 0)) return;
  coarse_.flip(cell);
  if (coarse_map_) coarse_map_->set_log_odds(cell, held > 0 ? 1.0F : std::numeric_limits<float>::quiet_NaN());
}

void PotentialObstacles::read(const OccupancyMap& map, const VoxelBox& block) {
  too_many_blocks_ = blocks_.size() == blocks_.capacity();
  if (!too_many_blocks_) blocks_.push_back(block);
  VoxelIndex v;
  for (v.z = block.lo.z; v.z <= block.hi.z; ++v.z) {
    for (v.y = block.lo.y; v.y <= block.hi.y; ++v.y) {
      unsigned now = 0;
      unsigned before = 0;
      for (v.x = block.lo.x; v.x <= block.hi.x; ++v.x) {
        const auto bit = static_cast<unsigned>(v.x - block.lo.x);
        now |= (map.at(v) == Occupancy::kOccupied ? 1U : 0U) << bit;
        before |= (fine_.at(v) ? 1U : 0U) << bit;
      }
      for (unsigned flipped = now ^ before; flipped != 0; flipped &= flipped - 1) {
        v.x = block.lo.x + std::countr_zero(flipped);
        fine_.flip(v);
        count(v, fine_.at(v));
      }
    }
  }
}

void PotentialObstacles::update(const OccupancyMap& map) {
  if (!(map.grid() == fine_.grid())) {
    throw InputError("potential: the map has another box or resolution than the obstacles");
  }
  blocks_.clear();
  too_many_blocks_ = false;
  fine_.begin();
  coarse_.begin();
  const auto visit = [this, &map](const VoxelBox& block) { read(map, block); };
  static_assert(sizeof(visit) <= 2 * sizeof(void*));  // fits into std::function without allocating
  map.for_each_block_changed_since(seen_revision_, visit);
  seen_revision_ = map.revision();
  fine_.end();
  coarse_.end();
  if (coarse_distances_) coarse_distances_->update(*coarse_map_);
}

}  // namespace stairwell::mapping
