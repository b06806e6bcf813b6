#pragma once

#include "planning3d/planner.hpp"

#include <memory>

namespace stairwell::planning3d {

/// Anywhere in 3D, whatever rule the request has (SPEC A17): what slicing is compared with.
class VolumePlanner final : public Planner {
 public:
  /// @pre inner is not null
  explicit VolumePlanner(std::unique_ptr<Planner> inner) : inner_(std::move(inner)) {}

  std::string_view name() const override { return "volume"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override {
    PlanRequest anywhere = request;
    anywhere.rule = MotionRule::volume();
    return inner_->plan(space, anywhere);
  }

 private:
  std::unique_ptr<Planner> inner_;
};

}  // namespace stairwell::planning3d
