#include "core/robot.hpp"

#include <cmath>

namespace stairwell {

std::vector<std::string> Robot::problems() const {
  std::vector<std::string> found;
  if (!(radius_m > 0.0) || !std::isfinite(radius_m)) found.emplace_back("robot radius must be positive");
  if (!(margin_m >= 0.0) || !std::isfinite(margin_m)) found.emplace_back("robot margin must not be negative");
  return found;
}

}  // namespace stairwell
