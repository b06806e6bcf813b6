#pragma once

#include <cmath>

namespace stairwell::apps {

/// Whether a multiple of the period lies in (time - tick, time]: needs no state, so resumed runs write the same rows.
inline bool due(double time_s, double tick_s, double period_s) {
  constexpr double kRounding = 1e-9;
  return std::floor(time_s / period_s + kRounding) > std::floor((time_s - tick_s) / period_s + kRounding);
}

}  // namespace stairwell::apps
