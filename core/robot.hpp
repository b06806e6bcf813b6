#pragma once

#include <string>
#include <vector>

namespace stairwell {

/// Body of a UAV for collision purposes: a sphere around its reference point, plus a margin kept by planning.
struct Robot {
  double radius_m = 0.2;
  double margin_m = 0.0;  ///< kept by planning beyond the radius

  double clearance_m() const { return radius_m + margin_m; }
  std::vector<std::string> problems() const;
};

}  // namespace stairwell
