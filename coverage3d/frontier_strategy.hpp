#pragma once

#include "coverage3d/blacklist.hpp"
#include "coverage3d/far_ways.hpp"
#include "coverage3d/frontier_finder.hpp"
#include "coverage3d/layer_finder.hpp"
#include "coverage3d/slab_finish.hpp"
#include "coverage3d/strategy.hpp"
#include "coverage3d/target_book.hpp"
#include "coverage3d/travel_book.hpp"
#include "planning3d/travel_costs.hpp"

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stairwell::coverage3d {

/// Goals at viewpoints of frontier clusters; the work is shared out by planning open tours of all UAVs over the
/// clusters and sending each to the first stop of its tour.
class FrontierStrategy : public CoverageStrategy {
 public:
  explicit FrontierStrategy(const CoverageConfig& config) : FrontierStrategy(config, config.slice) {}

  std::string_view name() const override { return "frontiers"; }
  std::unique_ptr<CoverageStrategy> clone() const override {
    return copy_to(std::make_unique<FrontierStrategy>(config_));
  }
  planning3d::MotionRule motion_rule() const override;
  Assignment assign(const planning3d::FreeSpace& space, const AssignmentRequest& request) override;
  bool still_useful(const planning3d::FreeSpace& space, const Goal& goal) override;
  void report_failure(const Goal& goal, double time_s) override;
  std::string save_state() const override;
  void load_state(const std::string& state) override;

 protected:
  /// A cluster that can be visited now, with the pose that stands for it in the tours.
  struct Stop {
    const FrontierCluster* cluster = nullptr;
    std::vector<const Viewpoint*> views;  ///< those that may be flown to; they live in the book
    std::size_t view = 0;
    double foreseen_m3 = 0.0;  ///< of the pose's gain: what others are going to see before
    double gain_m3() const { return std::max(0.0, pose().gain_m3 - foreseen_m3); }
    const Viewpoint& pose() const { return *views[view]; }
  };
  /// The UAVs that want a goal, or may change theirs.
  struct Crew {
    std::vector<std::size_t> uavs;         ///< index of each vehicle in the request
    std::vector<std::size_t> ways;         ///< index of its travel costs
    std::vector<Eigen::Vector3d> start_m;  ///< where its next free leg begins
    std::vector<Eigen::Vector3d> velocity_mps;
    std::vector<double> yaw_rad;
    std::vector<double> ready_s;
    std::vector<std::optional<Eigen::Vector3d>> target_m;  ///< what it is flying to see, while it may choose again
  };

  FrontierStrategy(const CoverageConfig& config, bool views_at_layers);
  /// Called once per assignment with all stops, before they are shared out.
  virtual void prepare(const AssignmentRequest&, const std::vector<Stop>&) {}
  /// Seconds that a UAV would rather spend than take this view (layers: views outside its own layer).
  virtual double reluctance_s(std::size_t /*uav*/, const Viewpoint&) const { return 0.0; }

  /// Gives goals to the UAVs that want one: here the first stops of tours over what is near.
  virtual void share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                         const std::vector<Stop>& stops, Assignment& assignment);

  /// What the UAVs that keep their goals are going to see.
  Foreseen foreseen_by_others(const planning3d::FreeSpace& space, const AssignmentRequest& request) const;
  /// Adds what the UAV will see at the goal that it was given now, and on the way where that is straight.
  void foresee(const planning3d::FreeSpace& space, const Eigen::Vector3d& from_m, const Goal& goal,
               Foreseen& foreseen) const;
  /// Notes in the stops what of their gain is foreseen.
  void deduct(const planning3d::FreeSpace& space, const Foreseen& foreseen, std::vector<Stop>& stops) const;

  /// Whether a goal with this target is for the cluster.
  static bool belongs(const FrontierCluster& cluster, const Eigen::Vector3d& target_m);
  /// Geodesic, infinite where there is no way.
  double way_m(std::size_t vehicle, const Viewpoint& to) const {
    return static_cast<double>(costs_[vehicle].distance_m(to.voxel));
  }
  double start_s(const Crew& crew, std::size_t vehicle, const Viewpoint& to) const;
  /// By whichever UAV is there first.
  double soonest_s(const Crew& crew, const Viewpoint& to) const;
  /// The stop's view that serves the vehicle best, remembered as given.
  Goal goal_for(const planning3d::FreeSpace& space, const Crew& crew, std::size_t vehicle, const Stop& stop,
                const Stop* next, double time_s);
  /// What a UAV under way will see is not for the others, unless nothing else is left.
  static std::vector<Stop> unclaimed(const AssignmentRequest& request, const std::vector<Stop>& stops);
  std::vector<Stop> first_of_all(const Crew& crew, const std::vector<Stop>& stops) const;
  void add_for_others(const Crew& crew, const std::vector<std::pair<double, const Stop*>>& later,
                      std::vector<Stop>& first) const;
  /// So many for each UAV.
  std::vector<Stop> nearest_of(const Crew& crew, const std::vector<Stop>& stops, std::size_t per_uav,
                               mapping::WorkerPool* workers) const;
  std::vector<Stop> without_absorbed(const planning3d::FreeSpace& space, const Crew& crew,
                                     const std::vector<Stop>& stops) const;
  /// From the pose of each stop to that of each.
  std::vector<std::vector<double>> all_between_s(const planning3d::FreeSpace& space, const std::vector<Stop>& stops,
                                                 mapping::WorkerPool* workers);
  /// What is known about the map; what is computed anew in every assignment stays behind.
  std::unique_ptr<CoverageStrategy> copy_to(std::unique_ptr<FrontierStrategy> copy) const;

  const CoverageConfig& config() const { return config_; }
  const LayerFinder& layer_finder() const;

 private:
  struct GivenGoal {
    Eigen::Vector3d position_m;
    Eigen::Vector3d target_m;
    std::vector<VoxelIndex> cells;
  };

  void set_up(const planning3d::FreeSpace& space);
  void refresh(const planning3d::FreeSpace& space, const AssignmentRequest& request);
  Crew crew_of(const AssignmentRequest& request) const;
  void compute_costs(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew);
  bool reachable(const VoxelIndex& v) const;
  ViewpointPlaces places(const AssignmentRequest& request) const;
  std::optional<Stop> stop_at(const FrontierCluster& cluster, const TargetBook::Target& target, double time_s) const;
  std::vector<Stop> open_stops(const AssignmentRequest& request, std::size_t& closed) const;
  std::vector<Stop> near_ones(const AssignmentRequest& request, const Crew& crew, std::vector<Stop> stops) const;
  int rank(const Stop& stop) const;
  void choose_poses(const AssignmentRequest& request, const Crew& crew, std::vector<Stop>& stops) const;
  double price_s(const Stop& stop, const Viewpoint& view) const;
  double commitment_s(const Crew& crew, std::size_t vehicle, const Stop& stop) const;
  double leg_s(double way_m, const Eigen::Vector3d& from_m, const Eigen::Vector3d& velocity_mps, double yaw_rad,
               const Viewpoint& to) const;
  double between_s(double way_m, const Viewpoint& from, const Viewpoint& to) const;
  double worth_m3(const planning3d::FreeSpace& space, const Crew& crew, const Stop& stop) const;
  std::vector<std::vector<std::size_t>> tours(const planning3d::FreeSpace& space, const Crew& crew,
                                              const std::vector<Stop>& stops, mapping::WorkerPool* workers);
  std::vector<Stop> own_work(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                             std::vector<Stop> stops) const;
  std::vector<Stop> own_stops(const AssignmentRequest& request, const Crew& crew, const std::vector<Stop>& stops,
                              const std::vector<Stop>& unseen) const;
  std::vector<Stop> leading_stops(const AssignmentRequest& request, const Crew& crew,
                                  const std::vector<Stop>& stops) const;
  void close_done_parts(const planning3d::FreeSpace& space, const AssignmentRequest& request,
                        const std::vector<Stop>& stops, const std::vector<Stop>& unseen) const;
  static bool answers_for(const AssignmentRequest& request, std::size_t part);
  static bool take_over(const AssignmentRequest& request);
  void remember(const Goal& goal, const std::vector<VoxelIndex>& cells);
  std::vector<Stop> nearest_stops(const AssignmentRequest& request, const Crew& crew,
                                  const std::vector<Stop>& stops) const;
  void share_out_alone(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                       std::vector<Stop> stops, Assignment& assignment);

  CoverageConfig config_;
  bool views_at_layers_;
  std::optional<FrontierFinder> finder_;
  std::optional<LayerFinder> layers_;
  std::optional<SlabFinish> finish_;
  TargetBook book_;
  TravelBook travel_;
  Blacklist blacklist_;
  planning3d::PassableLattice lattice_;
  FarWays far_ways_;
  std::vector<planning3d::TravelCosts> costs_;
  /// What each of them was computed for.
  struct CostSource {
    Eigen::Vector3d start_m;
    double time_s;
  };
  std::vector<CostSource> cost_sources_;
  std::deque<GivenGoal> given_;
  std::optional<double> start_height_m_;
  std::size_t pending_ = 0;
};

}  // namespace stairwell::coverage3d
