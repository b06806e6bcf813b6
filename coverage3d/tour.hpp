#pragma once

#include <cstddef>
#include <vector>

namespace stairwell::coverage3d {

/// Open tours of several vehicles over shared stops. Times in seconds, infinity where there is no way.
struct TourProblem {
  std::vector<double> ready_s;                 ///< per vehicle: when it can leave its start
  std::vector<std::vector<double>> start_s;    ///< [vehicle][stop]
  std::vector<std::vector<double>> between_s;  ///< [stop][stop]
  std::vector<double> worth;                   ///< [stop]; empty = 1 each
  double balance = 1.0;                        ///< weight of the longest tour against the sum of all
  double promptness = 0.02;                    ///< weight of worth times arrival time, so that much is seen early
};

/// Stops of each vehicle in order. Stops that no vehicle can reach are left out. Insertion with the largest regret
/// first, then moves and reversals of stretches while they help. Repeatable.
std::vector<std::vector<std::size_t>> plan_tours(const TourProblem& problem);

/// What plan_tours makes small.
double tour_cost(const TourProblem& problem, const std::vector<std::vector<std::size_t>>& tours);

}  // namespace stairwell::coverage3d
