/// What can be seen from where in the true world: the raw material of `stairwell bound`.
#pragma once

#include "apps/known_map.hpp"
#include "apps/simulation.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::apps {

/// The map that a fleet has when nothing is left to see: open space that connects to the reachable voxels is free, all
/// else occupied. @param reachable as GroundTruth::reachable gives it
mapping::OccupancyMap fully_known_map(const Simulation& simulation, const std::vector<std::uint8_t>& reachable);

/// Places spread over the space that UAVs can get to, and the targets (a sample of the explorable voxels) that are in
/// sight from each at each of `kYaws` yaws (one yaw where the sensor sees all round).
class TrueViews {
 public:
  static constexpr int kYaws = 24;
  struct Pose {
    std::uint32_t place = 0;
    int yaw = 0;  ///< in steps of 2 pi / kYaws
    friend bool operator==(const Pose&, const Pose&) = default;
  };
  struct Viewer {
    std::uint32_t place;
    std::uint32_t yaws;  ///< bit by yaw
  };
  static double yaw_rad(int yaw);

  /// @param explorable as GroundTruth::explorable gives it
  /// @throws InputError when no start leads to free space
  TrueViews(const Simulation& simulation, const planning3d::FreeSpace& space,
            const std::vector<std::uint8_t>& explorable);

  std::size_t places() const { return place_m_.size(); }
  std::size_t targets() const { return targets_.size(); }
  int yaws() const { return yaws_; }
  const std::vector<Eigen::Vector3d>& places_m() const { return place_m_; }
  /// What is in sight, a bit by target: the words from `begin` on up to `end` of `words()`; the others are zero.
  struct Sight {
    const std::uint64_t* word;  ///< the one numbered `begin`
    std::size_t begin;
    std::size_t end;
    void add_to(std::uint64_t* seen) const {
      for (std::size_t i = begin; i < end; ++i) seen[i] |= word[i - begin];
    }
  };
  Sight sight(const Pose& pose) const {
    const Window& window = windows_[pose.place];
    const std::size_t size = window.end - window.begin;
    return {&sights_[window.at + static_cast<std::size_t>(pose.yaw) * size], window.begin, window.end};
  }
  bool sees(const Pose& pose, std::size_t target) const {
    const Sight seen = sight(pose);
    const std::size_t word = target / 64;
    return word >= seen.begin && word < seen.end && (seen.word[word - seen.begin] >> (target % 64) & 1u) != 0;
  }
  /// From this far on the target is not seen any more: rays may pass it by.
  void forget(std::size_t target, double from_m);
  double distance_m(std::uint32_t place, std::size_t target) const {
    return (grid_.center_of(targets_[target]) - place_m_[place]).norm();
  }
  std::size_t words() const { return (targets() + 63) / 64; }
  const std::vector<VoxelIndex>& target_voxels() const { return targets_; }
  const std::vector<Viewer>& viewers(std::size_t target) const { return viewers_[target]; }
  /// Two places that stand for what is seen from a point: what is in sight from both. The nearest with nothing in
  /// between, and the nearest on the other side of the point, where there are any.
  struct Around {
    std::uint32_t nearest = 0;
    std::uint32_t opposite = 0;
    friend bool operator==(const Around&, const Around&) = default;
  };
  Around around(const Eigen::Vector3d& at_m) const;
  /// The nearest of the yaws.
  int yaw_step(double yaw_rad) const;

 private:
  void find_places(const planning3d::FreeSpace& space, const std::vector<Eigen::Vector3d>& starts_m);
  void assign_places(const sim3d::RayCaster& caster);
  void look_around(const Simulation& simulation);
  struct Seen {
    std::size_t target;
    std::uint32_t yaws;
  };
  void keep_sight(std::uint32_t place, const std::vector<Seen>& seen);

  struct Window {
    std::size_t at = 0;  ///< in `sights_`
    std::size_t begin = 0, end = 0;
  };

  int yaws_ = kYaws;
  GridSpec grid_;   ///< of the targets
  GridSpec cells_;  ///< of the places' lattice
  GridSpec near_cells_;
  std::vector<std::vector<std::uint32_t>> places_in_;  ///< by cell of `cells_`
  std::vector<Around> around_;                         ///< by cell of `near_cells_`
  std::vector<Eigen::Vector3d> place_m_;
  std::vector<VoxelIndex> targets_;
  std::vector<Window> windows_;        ///< by place
  std::vector<std::uint64_t> sights_;  ///< [place][yaw][word of its window]
  std::vector<std::vector<Viewer>> viewers_;
};

/// Poses that together see the wanted share of the targets, each the one that adds most (greedy set cover).
std::vector<TrueViews::Pose> cover_greedily(const TrueViews& views, double share);

}  // namespace stairwell::apps
