#pragma once

#include "planning3d/segment_check.hpp"

#include <vector>

namespace stairwell::planning3d {

/// The same path with means of neighbouring points taken so many times; points stay where their segments would touch
/// something. Ends stay.
std::vector<Eigen::Vector3d> smooth_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, int rounds);

}  // namespace stairwell::planning3d
