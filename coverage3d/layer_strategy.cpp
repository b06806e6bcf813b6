#include "coverage3d/layer_strategy.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::coverage3d {
namespace {

constexpr double kOtherLayer_s = 4.0;  // what a view outside the own layer costs on top of the way
constexpr double kOwnWork = 2.0;       // how much more work per UAV another layer must have
constexpr double kClimb_m2 = 0.5;      // work given up per metre of climb when layers are compared

}  // namespace

std::vector<double> LayerStrategy::layers_m() const {
  return config().layers_m.empty() ? layer_finder().layers_m() : config().layers_m;
}

std::size_t LayerStrategy::layer_of(double height_m) const {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < used_m_.size(); ++i)
    if (std::abs(used_m_[i] - height_m) < std::abs(used_m_[nearest] - height_m)) nearest = i;
  return nearest;
}

void LayerStrategy::prepare(const AssignmentRequest& request, const std::vector<Stop>& stops) {
  used_m_ = layers_m();
  std::vector<double> work_m2(used_m_.size(), 0.0);
  for (const Stop& stop : stops) work_m2[layer_of(stop.pose().position_m.z())] += stop.cluster->area_m2;
  std::vector<int> crew(used_m_.size(), 0);
  layer_of_uav_.assign(request.uavs.size(), 0);
  for (std::size_t i = 0; i < request.uavs.size(); ++i) {
    const UavView& uav = request.uavs[i];
    layer_of_uav_[i] = layer_of(!uav.wants_goal && uav.goal ? uav.goal->position_m.z() : uav.position_m.z());
    if (!uav.wants_goal) ++crew[layer_of_uav_[i]];
  }
  for (std::size_t i = 0; i < request.uavs.size(); ++i) {
    if (!request.uavs[i].wants_goal) continue;
    const std::size_t own = layer_of_uav_[i];
    const auto value = [&](std::size_t layer) {
      const double climb_m = std::abs(used_m_[layer] - used_m_[own]);
      const double share = work_m2[layer] / (1.0 + crew[layer]) - (work_m2[layer] > 0.0 ? 0.0 : 1e9);
      return (layer == own ? kOwnWork * share : share) - kClimb_m2 * climb_m;
    };
    std::size_t best = own;
    for (std::size_t layer = 0; layer < used_m_.size(); ++layer)
      if (value(layer) > value(best)) best = layer;
    layer_of_uav_[i] = best;
    ++crew[best];
  }
}

double LayerStrategy::reluctance_s(std::size_t uav, const Viewpoint& view) const {
  if (uav >= layer_of_uav_.size() || used_m_.empty()) return 0.0;
  return layer_of(view.position_m.z()) == layer_of_uav_[uav] ? 0.0 : kOtherLayer_s;
}

}  // namespace stairwell::coverage3d
