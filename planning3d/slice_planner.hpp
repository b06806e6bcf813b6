#pragma once

#include "planning3d/layer_graph.hpp"
#include "planning3d/planner.hpp"

#include <memory>

namespace stairwell::planning3d {

/// Plans in the UAV's layer and changes layers through the vertical openings that the map shows (SPEC A16): the graph
/// of layers and openings says through which columns, a planner of its own plans each layer's part. Layers are those
/// of the request; where it has none, the heights of start and goal and regular ones over the whole flight box.
/// kNoPath when the layers do not connect start and goal, although there may be a way in 3D.
class SlicePlanner final : public Planner {
 public:
  /// Settings of the planner.
  struct Config {
    double spacing_m = 1.0;  ///< of the layers where the request has none
  };
  /// @pre inner is not null; it obeys the slice rule within one layer
  explicit SlicePlanner(std::unique_ptr<Planner> inner) : inner_(std::move(inner)) {}
  SlicePlanner(std::unique_ptr<Planner> inner, const Config& config) : inner_(std::move(inner)), config_(config) {}

  std::string_view name() const override { return "slice"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;

  /// The request's rule, or the one made for it.
  MotionRule rule_for(const FreeSpace& space, const PlanRequest& request) const;

 private:
  PlanStatus plan_layers(const FreeSpace& space, const PlanRequest& request, const LayerGraph::Route& route,
                         PlanResult& result);

  std::unique_ptr<Planner> inner_;
  Config config_{};
};

}  // namespace stairwell::planning3d
