#pragma once

#include "coverage3d/frontier_finder.hpp"
#include "mapping/occupancy_map.hpp"

namespace stairwell::coverage3d {

/// How much unknown space may be got at through a cluster: what a stairwell, an opening or a corridor leads to counts,
/// which no view shows yet. Unknown voxels on a lattice of 0.4 m that hang together with what the cluster borders on,
/// along the axes and past nothing known, in the box and at most 4 m of such steps away.
/// @returns m3. @param box  where unknown space counts
double unknown_beyond_m3(const mapping::OccupancyMap& map, const mapping::VoxelBox& box,
                         const FrontierCluster& cluster);

}  // namespace stairwell::coverage3d
