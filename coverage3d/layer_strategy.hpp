#pragma once

#include "coverage3d/frontier_strategy.hpp"

#include <memory>
#include <vector>

namespace stairwell::coverage3d {

/// Exploration by slices (SPEC A16): viewpoints at layer heights, UAVs shared out to layers by the work left there;
/// a UAV leaves its layer when it is done, or when another has much more unshared work.
class LayerStrategy final : public FrontierStrategy {
 public:
  explicit LayerStrategy(const CoverageConfig& config) : FrontierStrategy(config, true) {}

  std::string_view name() const override { return "layers"; }
  std::unique_ptr<CoverageStrategy> clone() const override {
    return copy_to(std::make_unique<LayerStrategy>(config()));
  }

 protected:
  void prepare(const AssignmentRequest& request, const std::vector<Stop>& stops) override;
  double reluctance_s(std::size_t uav, const Viewpoint& view) const override;

 private:
  std::size_t layer_of(double height_m) const;
  std::vector<double> layers_m() const;

  std::vector<double> used_m_;             ///< layers at the last assignment
  std::vector<std::size_t> layer_of_uav_;  ///< home layer of each UAV
};

}  // namespace stairwell::coverage3d
