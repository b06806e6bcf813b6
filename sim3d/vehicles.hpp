#pragma once

#include "core/doors.hpp"

#include <memory>
#include <string_view>

namespace stairwell::sim3d {

/// Motion models behind the Vehicle door. `limited` follows its commands exactly and refuses commands beyond the
/// limits (v, a, yaw rate, yaw acceleration) or not continuous with the present motion; `step` moves a fixed
/// distance per period (SPEC A5) and checks only the distance (speed x Trajectory::kStep_s). The quadrotor
/// (SPEC A12) will be a third one. A vehicle starts at rest, at time 0. `command` accepts a trajectory that starts
/// later than now (the present motion goes on until then) or earlier (it must pass through the present motion).
/// @throws InputError for an unknown model (names the known ones), bad limits or a start that is not finite.
std::unique_ptr<Vehicle> make_vehicle(std::string_view model, const MotionLimits& limits, const MotionState& start,
                                      bool landed);

/// Radio that reaches everywhere, or up to a distance.
class RangeRadio final : public Radio {
 public:
  explicit RangeRadio(double range_m) : range_m_(range_m) {}
  bool linked(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) const override {
    return (a_m - b_m).norm() <= range_m_;
  }

 private:
  double range_m_;
};

}  // namespace stairwell::sim3d
