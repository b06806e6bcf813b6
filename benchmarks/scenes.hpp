/// What the benchmarks run on: depth scans of our own three-storey building.
#pragma once

#include "core/aabb.hpp"
#include "core/scan.hpp"

#include <vector>

namespace stairwell::bench {

struct Scene {
  Aabb box;
  std::vector<Scan> scans;
};

/// Depth images (320x240, 90 x 73.7 degrees, 8 m) from poses spread over all storeys of worlds/office_tower.sdf, the
/// same ones each time.
/// @throws InputError when the world is missing.
const Scene& office_tower();

}  // namespace stairwell::bench
