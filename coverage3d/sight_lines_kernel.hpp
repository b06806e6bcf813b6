/// How SightLines are followed with vector instructions; for its .cpp files.
#pragma once

#include "coverage3d/sight_lines.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace stairwell::coverage3d::sight {

/// What the lines run through.
struct Field {
  const std::uint8_t* summaries;  ///< OccupancyMap::summaries()
  double per_m;                   ///< 1 / resolution
  std::array<int, 3> first_cell;
  std::array<std::int64_t, 3> hop;  ///< linear index from a voxel to the next, by axis
};

/// Lines [first, first + count) of the columns.
struct Lines {
  const SightLines::Columns& begin;
  const SightLines::Columns& end;
  std::size_t first;
  std::size_t count;
};

constexpr std::size_t kMostLines = 256;  ///< of one call

/// @param stops  one for each line, as SightLines::follow() has them
void follow_avx2(const Field& field, const Lines& lines, std::uint32_t* stops);

}  // namespace stairwell::coverage3d::sight
