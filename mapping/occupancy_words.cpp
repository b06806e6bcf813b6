#include "mapping/occupancy_words.hpp"

#include "core/errors.hpp"

namespace stairwell::mapping {

OccupancyWords::OccupancyWords(const GridSpec& grid, Obstacles obstacles) : grid_(grid), obstacles_(obstacles) {
  std::size_t words = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    shift_[axis] = grid.first_cell()[axis] & (kEdge - 1);
    count_[axis] = (shift_[axis] + grid.size()[axis] + kEdge - 1) / kEdge;
    words *= static_cast<std::size_t>(count_[axis]);
  }
  words_.assign(words, 0);
  if (obstacles == Obstacles::kOccupied) return;
  for (int z = 0; z < grid.size()[2]; ++z) {
    for (int y = 0; y < grid.size()[1]; ++y) {
      for (int x = 0; x < grid.size()[0]; ++x) {
        const auto at_x = static_cast<unsigned>(x + shift_[0]);
        const auto at_y = static_cast<unsigned>(y + shift_[1]);
        const auto at_z = static_cast<unsigned>(z + shift_[2]);
        words_[linear(at_x >> 2, at_y >> 2, at_z >> 2)] |= std::uint64_t{1} << bit_of(at_x & 3, at_y & 3, at_z & 3);
      }
    }
  }
}

void OccupancyWords::update(const OccupancyMap& map) {
  if (map.grid() != grid_) throw InputError("occupancy words: the map has another box or resolution");
  const std::uint64_t map_revision = map.revision();
  bool changed = false;
  map.for_each_block_changed_since(seen_revision_, [&](const VoxelBox& block) {
    for (int z = block.lo.z; z <= block.hi.z; ++z) {
      for (int y = block.lo.y; y <= block.hi.y; ++y) {
        changed = read_row(map, block.lo.x, block.hi.x, y, z) || changed;
      }
    }
  });
  seen_revision_ = map_revision;
  revision_ += changed ? 1 : 0;
}

bool OccupancyWords::read_row(const OccupancyMap& map, int first_x, int last_x, int y, int z) {
  const auto at_y = static_cast<unsigned>(y + shift_[1]);
  const auto at_z = static_cast<unsigned>(z + shift_[2]);
  const unsigned row_bit = bit_of(0, at_y & 3, at_z & 3);
  bool changed = false;
  for (int x = first_x; x <= last_x;) {
    const auto at_x = static_cast<unsigned>(x + shift_[0]);
    std::uint64_t& word = words_[linear(at_x >> 2, at_y >> 2, at_z >> 2)];
    std::uint64_t bits = 0;
    std::uint64_t read = 0;
    for (unsigned i = at_x & 3; i < 4 && x <= last_x; ++i, ++x) {
      const VoxelIndex v{x, y, z};
      const bool obstacle = obstacles_ == Obstacles::kBlocked ? map.blocked(v) : map.at(v) == Occupancy::kOccupied;
      read |= std::uint64_t{1} << (row_bit + i);
      bits |= std::uint64_t{obstacle} << (row_bit + i);
    }
    changed = changed || (word & read) != bits;
    word = (word & ~read) | bits;
  }
  return changed;
}

}  // namespace stairwell::mapping
