#pragma once

#include "planning3d/free_space.hpp"
#include "planning3d/planner.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace stairwell::planning3d {

/// Which traversable voxels hang together: union-find over runs of voxels along x, a few nanoseconds per voxel.
class Connectivity {
 public:
  /// kFaces: parts that a robot surely can cross. kAll (faces, edges, corners): parts that no planner can leave.
  enum class Neighbours { kFaces, kAll };
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  /// @param stop asked between horizontal layers; true ends the work and gives nullopt. May be empty.
  static std::optional<Connectivity> find(const FreeSpace& space, Neighbours neighbours,
                                          const std::function<bool()>& stop = {});

  /// The same number for all voxels that hang together; kNone where the robot's centre may not be.
  std::uint32_t part(const VoxelIndex& v) const;
  bool connected(const VoxelIndex& a, const VoxelIndex& b) const { return part(a) != kNone && part(a) == part(b); }

 private:
  struct Run {
    int lo;
    int hi;  ///< included
    std::uint32_t parent;
  };
  explicit Connectivity(const GridSpec& grid) : grid_(grid) {}
  std::size_t row_of(int y, int z) const {
    return static_cast<std::size_t>(z) * static_cast<std::size_t>(grid_.size()[1]) + static_cast<std::size_t>(y);
  }
  void add_row(const FreeSpace& space, int y, int z);
  void join_rows(std::size_t a, std::size_t b, int reach);
  std::uint32_t root(std::uint32_t run) const;

  GridSpec grid_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> row_begin_;  ///< first run of each row, and the end of the last
};

/// For planners that end without an answer and without a proof: whether there could have been a path at all.
class GivingUp {
 public:
  /// Made when planning begins. Holds references.
  GivingUp(const FreeSpace& space, const PlanRequest& request);

  /// kNoPath for kTimedOut and kLocalMinimum where start and goal are not connected, which is certain; else as it was.
  /// Looks no longer than a tenth of the time that the request gave.
  PlanStatus status(PlanStatus ended, const VoxelIndex& start, const VoxelIndex& goal) const;

 private:
  const FreeSpace& space_;
  const PlanRequest& request_;
  double until_s_ = 0.0;
};

}  // namespace stairwell::planning3d
