#pragma once

#include "planning3d/segment_check.hpp"

#include <vector>

namespace stairwell::planning3d {

/// The same path with means of neighbouring points taken so many times; points stay where their segments would touch
/// something. Ends stay.
std::vector<Eigen::Vector3d> smooth_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, int rounds);

/// Straight lines instead of many small steps, then each corner drawn in as far as it goes. Ends stay. Nowhere does the
/// path come nearer to obstacles than it did somewhere between the same two corners, less a little, unless it keeps
/// `comfort_m` of room there (see FreeSpace::room_m).
std::vector<Eigen::Vector3d> straighten_path(const SegmentCheck& check, const std::vector<Eigen::Vector3d>& path_m,
                                             double comfort_m = 0.25);

}  // namespace stairwell::planning3d
