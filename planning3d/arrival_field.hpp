#pragma once

#include "planning3d/segment_check.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace stairwell::planning3d {

/// The way that is left to a goal, over the whole free space, as a smooth function T of the place: |grad T| = slowness
/// (eikonal equation), solved upwind on a lattice (Sethian 1996), so that its descent bends freely and does not follow
/// the lattice's 26 directions. Slowness is 1 + weight * nearness^2. Impassable: cells of whose voxels SegmentCheck
/// refuses more than half, or all where there is no other way to the start. Bitwise repeatable. Memory is kept between
/// calls.
class ArrivalField {
 public:
  static constexpr float kFar = std::numeric_limits<float>::infinity();

  /// Extent and costs of the field.
  struct Config {
    bool plane = false;   ///< only the voxels' layer that holds the goal, in cells of one voxel
    double cell_m = 0.2;  ///< edge of a cell, rounded to whole voxels
    double clearance_weight = 0.0;
    double comfort_m = 0.5;  ///< nearness falls from 1 at the least clearance to 0 so much beyond it
    double spare_m = 3.0;    ///< places that are so much farther off than the start may stay kFar
  };
  explicit ArrivalField(const Config& config) : config_(config) {}

  /// @param check  of the same space. @param start_m  may be not finite: the whole space is filled.
  /// @param stop  asked now and then; true ends the work. May be empty
  /// @returns false when it was stopped: the field is of no use then
  bool compute(const FreeSpace& space, const SegmentCheck& check, const Eigen::Vector3d& goal_m,
               const Eigen::Vector3d& start_m, const std::function<bool()>& stop = {});

  const Config& config() const { return config_; }
  const Eigen::Vector3d& goal_m() const { return goal_m_; }
  double cell_m() const { return cell_m_; }
  /// T at a place in metres; kFar where there is no way.
  float value_m(const Eigen::Vector3d& at_m) const;

  /// The way down from `at_m`, so much of it, in steps of half a cell; ends at the goal. Empty where T is kFar.
  void descend(const Eigen::Vector3d& at_m, double length_m, std::vector<Eigen::Vector3d>& way_m) const;

  /// For readers of many cells: cell coordinates are (position - origin_m()) / cell_m(), rounded down.
  const Eigen::Vector3d& origin_m() const { return origin_m_; }
  const std::array<int, 3>& size() const { return size_; }  ///< x, y, z
  /// Where T of a cell inside size() stands among cells().
  std::size_t linear(int x, int y, int z) const { return static_cast<std::size_t>(first_ + x + row_ * y + slab_ * z); }
  /// T in cell edges, x fastest, with a border of kFar; kFar where there is no way.
  const std::vector<float>& cells() const { return arrival_; }

 private:
  using Cell = std::array<int, 3>;
  bool inside(const Cell& c) const;
  std::size_t linear(const Cell& c) const { return linear(c[0], c[1], c[2]); }
  Cell cell_of(std::size_t linear) const;
  Cell cell_at(const Eigen::Vector3d& at_m) const;
  Eigen::Vector3d center_m(const Cell& c) const;
  float at(const Cell& c) const { return inside(c) ? arrival_[linear(c)] : kFar; }
  Cell cell_to_reach(const FreeSpace& space, const SegmentCheck& check, const Eigen::Vector3d& start_m);
  void resize(const FreeSpace& space, const Eigen::Vector3d& goal_m);
  void close_border();
  float slowness(const FreeSpace& space, const SegmentCheck& check, std::size_t cell) {
    return slowness_[cell] != 0.0F ? slowness_[cell] : slowness_[cell] = slowness_of(space, check, cell_of(cell));
  }
  float slowness_of(const FreeSpace& space, const SegmentCheck& check, const Cell& c) const;
  float solve(std::size_t cell, float slowness) const;
  void start_from(const FreeSpace& space, const SegmentCheck& check);
  bool spread(const FreeSpace& space, const SegmentCheck& check, const Cell& start, const std::function<bool()>& stop);
  void spread_diagonally(const FreeSpace& space, const SegmentCheck& check, std::size_t cell);
  void push(std::size_t cell, float arrival);
  Eigen::Vector3d downhill(const Cell& c) const;
  bool lowest_around(const Eigen::Vector3d& at_m, Cell& found) const;
  Eigen::Vector3d step_down(const Eigen::Vector3d& at_m) const;

  static constexpr float kBucketsPerCell = 2.0F;
  static constexpr std::size_t kBuckets = 64;

  Config config_;
  Eigen::Vector3d goal_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  double cell_m_ = 0.2;
  int stride_ = 1;   ///< voxels per cell along x and y, and z unless `plane`
  int first_z_ = 0;  ///< voxel layer of cells with z = 0
  std::array<int, 3> size_{0, 0, 0};
  /// Strides of the two arrays below, which have a border of one cell (none along z in the plane) so that neighbours
  /// need no bounds check, and the place of cell (0, 0, 0).
  std::ptrdiff_t row_ = 0, slab_ = 0, first_ = 0;
  std::vector<float> arrival_;   ///< in cell edges
  std::vector<float> slowness_;  ///< 0: not asked yet; negative: impassable
  struct Waiting {
    std::uint32_t cell;
    float arrival;  ///< another one than the cell's: it was lowered since
  };
  std::array<std::vector<Waiting>, kBuckets> buckets_;
  std::uint32_t turn_ = 0;
  bool narrow_ = false;  ///< one free voxel makes a cell passable
};

}  // namespace stairwell::planning3d
