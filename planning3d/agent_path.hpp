#pragma once

#include "planning3d/segment_check.hpp"

#include <vector>

namespace stairwell::planning3d {

/// The same path with means of neighbouring points taken so many times; points stay where their segments would touch
/// something. Ends stay.
std::vector<Eigen::Vector3d> smooth_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, int rounds);

/// Straight lines instead of many small steps, then each corner drawn in as far as it goes; twice, from either end.
/// Ends stay. A line comes no nearer to obstacles than the path did somewhere between its two ends, but where the
/// sphere fits with `comfort_m` to spare it may.
std::vector<Eigen::Vector3d> straighten_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m,
                                             double comfort_m = 0.25);

}  // namespace stairwell::planning3d
