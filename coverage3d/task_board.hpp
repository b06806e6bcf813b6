#pragma once

#include "core/aabb.hpp"

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <vector>

namespace stairwell::coverage3d {

/// The task lists that UAVs tell each other at any distance: the cells of the task box that are still to be explored,
/// who answers for each, which parts of them (halves along each long enough edge) are done, and in which somebody knows
/// of something to visit. No map is told: a part is done when some UAV says so, from what its own map holds. Cells
/// change hands among UAVs that meet, or when one that has nothing left to do announces that it takes some of
/// another's.
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
  /// Of a part.
  const Eigen::Vector3d& part_edge_m() const { return fine_.edge_m; }
  /// Points outside belong to the nearest cell.
  std::size_t cell_at(const Eigen::Vector3d& point_m) const { return coarse_.at(point_m); }
  /// Of what is to be explored of it; of all of it when it is done.
  Eigen::Vector3d center_m(std::size_t cell) const;
  /// Whether some part of it is to be explored.
  bool open(std::size_t cell) const { return cells_[cell].open_parts > 0; }
  std::size_t owner(std::size_t cell) const { return cells_[cell].owner; }

  std::size_t parts() const { return parts_.size(); }
  /// Points outside belong to the nearest part.
  std::size_t part_at(const Eigen::Vector3d& point_m) const { return fine_.at(point_m); }
  Eigen::Vector3d part_center_m(std::size_t part) const { return fine_.center_m(part); }
  std::size_t cell_of(std::size_t part) const { return coarse_.at(fine_.center_m(part)); }
  bool part_open(std::size_t part) const { return parts_[part] == kNobody; }
  /// Who said that it is done; kNobody while it is open.
  std::size_t closer(std::size_t part) const { return parts_[part]; }
  void close_part(std::size_t part, std::size_t uav);
  /// It was not done after all.
  void reopen_part(std::size_t part);

  /// What the UAV knows to visit: a flag for every part; what it said before is replaced.
  void claim(std::size_t uav, std::vector<bool> parts);
  /// Whether some UAV knows of something to visit within `radius_m` of this part. Where nobody does, a part that is
  /// still open is so because no map shows all of it, not because nobody has been there.
  bool claimed_near(std::size_t part, double radius_m) const;

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
    std::size_t open_parts = 0;
    Eigen::Vector3d open_sum_m = Eigen::Vector3d::Zero();  ///< of the centres of those
    std::size_t owner = kNobody;
  };
  /// Equal boxes that tile a box.
  struct Tiling {
    Eigen::Vector3d min_m;
    Eigen::Vector3d edge_m;
    std::array<std::size_t, 3> count{1, 1, 1};
    std::size_t size() const { return count[0] * count[1] * count[2]; }
    std::size_t at(const Eigen::Vector3d& point_m) const;
    Eigen::Vector3d center_m(std::size_t tile) const;
  };
  void count_open_parts();
  std::vector<std::size_t> cells_of(std::size_t uav) const;
  std::vector<std::vector<std::size_t>> tours(const std::vector<Worker>& workers,
                                              const std::vector<std::size_t>& cells) const;
  double tour_s(const Worker& worker, const std::vector<std::size_t>& cells) const;

  double speed_mps_;
  Tiling coarse_;
  Tiling fine_;
  std::vector<Cell> cells_;
  std::vector<std::size_t> parts_;                   ///< who closed each, kNobody while it is open
  std::map<std::size_t, std::vector<bool>> claims_;  ///< by UAV
};

}  // namespace stairwell::coverage3d
