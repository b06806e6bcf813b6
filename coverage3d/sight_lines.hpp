#pragma once

#include "core/grid_spec.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/simd.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::coverage3d {

/// Straight lines through a map, followed many at a time: each up to the first voxel that cannot be looked through,
/// which is every one but those that are free and in which no return ever fell. Visits the voxels that `walk_voxels`
/// visits, whatever the instructions.
class SightLines {
 public:
  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

  void clear();
  std::size_t size() const { return end_[0].size(); }
  /// @pre both ends lie in the grid of the map that is going to be asked
  void add(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m);

  /// By line: linear index of the voxel that ends it, kNothing where all can be looked through. Valid until the next
  /// call. @pre the map has fewer voxels than kNothing @throws InputError for instructions that the processor lacks
  const std::vector<std::uint32_t>& follow(const mapping::OccupancyMap& map, mapping::Simd simd = mapping::Simd::kBest);

  /// Lines as columns, axis by axis.
  using Columns = std::array<std::vector<double>, 3>;

 private:
  Columns begin_, end_;
  std::vector<std::uint32_t> stops_;
};

}  // namespace stairwell::coverage3d
