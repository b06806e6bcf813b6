#pragma once

#include "core/id_table.hpp"
#include "coverage3d/frontier_finder.hpp"
#include "coverage3d/viewpoints.hpp"
#include "planning3d/free_space.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::coverage3d {

/// Viewpoints of every frontier cluster that is worth a visit, kept while the cluster and its surroundings stay as
/// they are.
class TargetBook {
 public:
  /// A cluster and the poses that see it.
  struct Target {
    std::vector<Viewpoint> views;
    bool fresh = false;                                  ///< the views are from after the last change nearby
    bool searched = false;                               ///< the thorough search has been tried since then, too
    int searches = 0;                                    ///< thorough searches so far
    int handed_on = 0;                                   ///< times since its views were looked for
    bool gains_old = false;                              ///< the map changed nearby since they were worked out
    double gains_time_s = 0.0;                           ///< when that was
    Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< of the cluster
  };
  /// What may be spent on new viewpoints at a time.
  struct Budget {
    int samples = 60;   ///< clusters looked at per update; where there are more, views are handed on
    int searches = 4;   ///< thorough searches per update
    int legacies = 60;  ///< clusters that take over views of vanished ones, per update
  };

  explicit TargetBook(const ViewpointConfig& config) : sampler_(config) {}

  /// Drops what is gone and checks what is there; once per update of the finder. Gains are worked out again now and
  /// then, where something changed.
  /// @param workers  may be null, here and below
  void refresh(const planning3d::FreeSpace& space, const FrontierFinder& finder, const ViewpointPlaces& places,
               double time_s, mapping::WorkerPool* workers);
  /// Looks for viewpoints of what has none.
  /// @param counts  clusters, by id, that are worth it; empty: all
  /// @returns clusters that are still to be looked at because the budget was used up
  std::size_t look(const planning3d::FreeSpace& space, const FrontierFinder& finder, const ViewpointPlaces& places,
                   const Budget& budget, const std::function<bool(std::uint32_t)>& counts,
                   mapping::WorkerPool* workers);
  /// Whether the cluster waits for being looked at.
  bool undecided(std::uint32_t cluster) const;
  const ViewpointSampler& sampler() const { return sampler_; }
  void forget() { targets_.clear(); }

  const IdTable<Target>& targets() const { return targets_; }

 private:
  /// What was seen of clusters that were rebuilt since; a cluster changes its id with every voxel.
  struct Heirloom {
    Eigen::Vector3d center_m;
    std::vector<Viewpoint> views;
    int handed_on;
    double gains_time_s;
  };
  /// A target to be looked for.
  struct Task {
    Target* target;
    const FrontierCluster* cluster;
  };
  struct Waiting;
  std::vector<Waiting> waiting(const FrontierFinder& finder, const ViewpointPlaces& places,
                               const std::function<bool(std::uint32_t)>& counts);
  static std::vector<Task> take_first(std::vector<Waiting>& waiting, int count);
  void search(const planning3d::FreeSpace& space, const ViewpointPlaces& places, const Task& task) const;
  static void look_again(Target& target);
  std::vector<Task> bequeath(const FrontierFinder& finder);
  static bool undecided(const Target& target);
  std::vector<const Heirloom*> heirlooms_near(const FrontierCluster& cluster) const;
  void inherit(const planning3d::FreeSpace& space, const Task& task,
               const std::vector<const Heirloom*>& heirlooms) const;
  void worked_out(Target& target) const;
  bool takes_over(const planning3d::FreeSpace& space, const Task& task) const;

  ViewpointSampler sampler_;
  IdTable<Target> targets_;
  std::size_t refreshed_ = 0;  ///< times
  double time_s_ = 0.0;        ///< of the last time
  std::vector<Heirloom> heirlooms_;
};

}  // namespace stairwell::coverage3d
