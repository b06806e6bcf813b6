#pragma once

#include "core/aabb.hpp"

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace stairwell::coverage3d {

/// The task lists that UAVs tell each other at any distance: the cells of the task box that are still to be explored,
/// and who answers for each. No map is told: whether a cell is done is for the UAV that answers for it to say, from
/// what its own map holds. Cells change hands among UAVs that meet, or when one that has nothing left to do announces
/// that it takes some of another's.
class TaskBoard {
 public:
  static constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

  /// Where somebody who shares work is going to be, in the world's frame.
  struct Worker {
    std::size_t uav = 0;
    Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  };

  /// Cells of about 5 m, larger in a box that would have too many of them for tours.
  explicit TaskBoard(const Aabb& box, double speed_mps);

  std::size_t size() const { return cells_.size(); }
  const Eigen::Vector3d& edge_m() const { return edge_m_; }
  /// Points outside belong to the nearest cell.
  std::size_t cell_at(const Eigen::Vector3d& point_m) const;
  Eigen::Vector3d center_m(std::size_t cell) const;
  bool open(std::size_t cell) const { return cells_[cell].open; }
  std::size_t owner(std::size_t cell) const { return cells_[cell].owner; }
  void close(std::size_t cell) { cells_[cell].open = false; }

  /// UAVs that part share out what any of them answers for, and what nobody does, by tours of like length.
  void share(const std::vector<Worker>& workers);
  /// A UAV without work takes what nobody answers for, or else part of the list of the one that has most left: cells
  /// that shorten the time until both are done. The cells where others are going to be stay theirs.
  /// @returns whether it got any
  bool take_over(const Worker& idle, const std::vector<Worker>& others);
  /// What the UAV answered for is nobody's.
  void give_up(std::size_t uav);

  nlohmann::json to_json() const;
  /// @throws InputError when it is of another box, or nlohmann's exceptions when it is damaged
  void from_json(const nlohmann::json& json);

 private:
  struct Cell {
    bool open = true;
    std::size_t owner = kNobody;
  };
  std::vector<std::size_t> cells_of(std::size_t uav) const;
  std::vector<std::vector<std::size_t>> tours(const std::vector<Worker>& workers,
                                              const std::vector<std::size_t>& cells) const;
  double tour_s(const Worker& worker, const std::vector<std::size_t>& cells) const;

  Aabb box_;
  double speed_mps_;
  std::array<std::size_t, 3> count_{1, 1, 1};
  Eigen::Vector3d edge_m_;
  std::vector<Cell> cells_;
};

}  // namespace stairwell::coverage3d
