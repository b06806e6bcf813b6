#pragma once

#include <cstdint>

namespace stairwell {

enum class Occupancy : std::uint8_t { kUnknown, kFree, kOccupied };

}  // namespace stairwell
