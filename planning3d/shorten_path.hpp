#pragma once

#include "core/rng.hpp"
#include "planning3d/segment_check.hpp"

#include <functional>
#include <vector>

namespace stairwell::planning3d {

double path_length_m(const std::vector<Eigen::Vector3d>& path_m);

/// Leaves out points that are not needed, then cuts corners between random places on the path (Geraerts & Overmars
/// 2007, partial shortcuts along the whole path). Ends stay; every new segment is free by `check`.
/// @param stop asked before every cut; true ends the work early
std::vector<Eigen::Vector3d> shorten_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, Rng& rng,
                                          const std::function<bool()>& stop);

}  // namespace stairwell::planning3d
