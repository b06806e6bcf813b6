#pragma once

#include "mapping/potential_layers.hpp"
#include "planning3d/navigation_function.hpp"
#include "planning3d/planner.hpp"

#include <vector>

namespace stairwell::planning3d {

/// Steepest descent on the potential of SPEC A1 (attraction to the goal, Gaussian repulsion from the nearest obstacle),
/// SPEC A4: quick, and with the cone of attraction stuck in local minima (kLocalMinimum).
///
/// Attraction::kGeodesic: the distance round the obstacles instead of the cone (NavigationFunction, with the repulsion
/// as its hill). Where the descent between voxels finds nothing lower it follows the voxels, on which the sum has no
/// minimum. Changes layers in slices; the cone stays at the start's height.
///
/// Experience (U_exp of SPEC A1): a minimum that the descent is caught in is filled with a Gaussian pot, and the
/// descent goes on, up to `most_pots`. Loops in what was flown are left out of the path.
class ApfPlanner final : public Planner {
 public:
  /// Shape of the field and limits of the descent.
  struct Config {
    Attraction attraction = Attraction::kCone;
    double step_m = 0.12;    ///< SPEC A5
    double per_metre = 1.0;  ///< k_a
    double repulsion = 0.3;  ///< k_rep, metres
    double sigma_m = 0.25;
    double influence_m = 0.75;  ///< d0
    std::size_t most_pots = 0;  ///< 0: no experience
    double pot_gain = 0.5;      ///< as k_rep
    double pot_sigma_m = 0.4;
  };
  ApfPlanner() = default;
  explicit ApfPlanner(const Config& config) : config_(config) {}

  std::string_view name() const override { return "apf"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;
  /// That the last descent laid.
  const std::vector<mapping::PotentialBump>& pots() const { return pots_; }

 private:
  struct Descent;
  double gauss(double distance_m) const;
  double hill(const Descent& descent, const Eigen::Vector3d& at_m, double obstacle_m) const;
  double potential(const Descent& descent, const Eigen::Vector3d& at_m) const;
  bool step(Descent& descent) const;
  bool follow_voxels(Descent& descent) const;
  bool lay_pot(Descent& descent);
  PlanStatus descend(Descent& descent, std::size_t& steps);

  Config config_{};
  NavigationFunction geodesic_;
  std::vector<mapping::PotentialBump> pots_;
};

}  // namespace stairwell::planning3d
