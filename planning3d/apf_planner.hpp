#pragma once

#include "planning3d/planner.hpp"

namespace stairwell::planning3d {

/// Steepest descent on the potential of SPEC A1 (cone of attraction to the goal, Gaussian repulsion from the nearest
/// obstacle), SPEC A4: quick, and stuck in local minima (kLocalMinimum). Slice rule: stays at the start's height.
class ApfPlanner final : public Planner {
 public:
  struct Config {
    double step_m = 0.12;     ///< SPEC A5
    double attraction = 1.0;  ///< k_a, per metre
    double repulsion = 0.3;   ///< k_rep, metres
    double sigma_m = 0.25;
    double influence_m = 0.75;  ///< d0
  };
  ApfPlanner() = default;
  explicit ApfPlanner(const Config& config) : config_(config) {}

  std::string_view name() const override { return "apf"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;

 private:
  double potential(const FreeSpace& space, const PlanRequest& request, const Eigen::Vector3d& at_m) const;

  Config config_{};
};

}  // namespace stairwell::planning3d
