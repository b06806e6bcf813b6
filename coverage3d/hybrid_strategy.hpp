#pragma once

#include "coverage3d/strategy.hpp"

#include <memory>
#include <string>

namespace stairwell::coverage3d {

/// One strategy until a share of the task box is known, another one from then on (SPEC A9: k-means for the end).
class HybridStrategy final : public CoverageStrategy {
 public:
  /// @param switch_at known volume over the box's volume, from which on `then` decides
  HybridStrategy(std::unique_ptr<CoverageStrategy> first, std::unique_ptr<CoverageStrategy> then, const Aabb& box,
                 double switch_at);

  std::string_view name() const override { return "hybrid"; }
  planning3d::MotionRule motion_rule() const override { return present().motion_rule(); }
  Assignment assign(const planning3d::FreeSpace& space, const AssignmentRequest& request) override;
  bool still_useful(const planning3d::FreeSpace& space, const Goal& goal) override;
  void report_failure(const Goal& goal, double time_s) override { present().report_failure(goal, time_s); }
  std::string save_state() const override;
  void load_state(const std::string& state) override;

  bool switched() const { return switched_; }

 private:
  CoverageStrategy& present() const { return switched_ ? *then_ : *first_; }

  std::unique_ptr<CoverageStrategy> first_, then_;
  double switch_m3_;
  bool switched_ = false;
};

}  // namespace stairwell::coverage3d
