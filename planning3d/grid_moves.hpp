#pragma once

#include <array>
#include <cstddef>
#include <numbers>

namespace stairwell::planning3d {

/// A move from a voxel to one that touches it.
struct GridMove {
  int x, y, z;
  float length;  ///< in voxels
};

/// All 26, x changing fastest. Searches store places in this table.
inline constexpr std::array<GridMove, 26> kGridMoves = [] {
  constexpr std::array<float, 4> kLengths{0.0F, 1.0F, std::numbers::sqrt2_v<float>, std::numbers::sqrt3_v<float>};
  std::array<GridMove, 26> moves{};
  std::size_t n = 0;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (x == 0 && y == 0 && z == 0) continue;
        moves[n++] = {x, y, z, kLengths[static_cast<std::size_t>(x * x + y * y + z * z)]};
      }
    }
  }
  return moves;
}();

}  // namespace stairwell::planning3d
