#pragma once

#include "core/grid_spec.hpp"
#include "core/rng.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace stairwell::coverage3d {

/// The voxels that come first when all are sorted by their distance, those equally near in their order, and then the
/// first `count` places are filled from `kept` on by chance: with whatever is in one of the places behind. Sorts only
/// where something is taken from. @pre kept <= count <= voxels.size()
std::vector<VoxelIndex> nearest_and_random(const GridSpec& grid, const Eigen::Vector3d& from_m,
                                           const std::vector<VoxelIndex>& voxels, std::size_t kept, std::size_t count,
                                           Rng& rng);

}  // namespace stairwell::coverage3d
