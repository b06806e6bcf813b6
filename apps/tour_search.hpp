#pragma once

#include "apps/tour_model.hpp"
#include "core/rng.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::apps {

/// How one call of TourSearch::anneal goes about it.
struct Annealing {
  std::size_t evaluations = 1'000'000;
  double from_s = 1.0;  ///< temperature, falling geometrically
  double to_s = 0.05;
};

/// Short tours that see enough: simulated annealing (Kirkpatrick et al. 1983) over which poses are visited by whom in
/// which order. Repeatable.
class TourSearch {
 public:
  TourSearch(TourModel& model, Rng rng);

  /// Tours over these poses by the local search that exploration uses (coverage3d/tour).
  Tours order(const std::vector<TrueViews::Pose>& poses) const;
  /// @param wanted  targets that have to be seen
  /// @returns the best found; they may miss a few of these where each of them costs much
  Tours anneal(Tours tours, std::size_t wanted, const Annealing& annealing);

  double longest_s(const Tours& tours);
  std::size_t seen(const Tours& tours);

 private:
  struct Stop {
    std::size_t uav;
    std::size_t at;
  };
  struct State {
    Tours tours;
    std::vector<double> time_s;                      ///< by UAV
    std::vector<std::vector<std::uint64_t>> sights;  ///< by UAV
    std::size_t seen = 0;
  };

  double time_cost(const std::vector<double>& time_s) const;
  std::size_t count_seen(const State& state);
  double missing_cost(std::size_t seen, std::size_t wanted, double per_share_s) const;

  bool propose(const State& state);
  bool pick_stop(const Tours& tours, Stop& stop);
  bool shift(const Tours& tours);
  bool turn(const Tours& tours);
  bool leave_out(const Tours& tours);
  bool look_at_missing(const State& state);
  double detour_s(std::size_t uav, const Tour& tour, std::size_t at, const Tour& stretch) const;
  bool move_stretch(const Tours& tours);
  bool reverse(const Tours& tours);
  bool swap_ends(const Tours& tours);
  Stop cheapest_stop(const Tours& tours, const TrueViews::Pose& pose);
  Tour& change(const Tours& tours, std::size_t uav);
  std::size_t below(std::size_t count);

  TourModel& model_;
  Rng rng_;
  std::vector<std::vector<std::uint32_t>> beside_;  ///< by place: others near by in sight
  // The proposal: what becomes of the tours of these UAVs.
  std::vector<std::size_t> changed_;
  std::vector<Tour> proposed_;
  std::vector<std::uint64_t> union_;
};

}  // namespace stairwell::apps
