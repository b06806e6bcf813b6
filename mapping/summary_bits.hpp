/// Up to eight of OccupancyMap::summaries() at once, for loops over rows of voxels.
#pragma once

#include "mapping/occupancy_map.hpp"

#include <bit>
#include <cstdint>
#include <cstring>

namespace stairwell::mapping {

/// The summaries of up to eight voxels that follow one another along x, the first one in the lowest byte.
class EightSummaries {
 public:
  /// @param count  1 to 8; only so many bytes are read
  EightSummaries(const std::uint8_t* from, int count) {
    if constexpr (std::endian::native == std::endian::little) {
      if (count == 8) {
        std::memcpy(&bytes_, from, sizeof(bytes_));
        return;
      }
    }
    for (int i = 0; i < count; ++i) bytes_ |= std::uint64_t{from[i]} << (8 * i);
    bits_ = (1U << count) - 1U;
  }

  /// A bit for each voxel, the first one lowest.
  std::uint32_t unknown() const { return equal(OccupancyMap::kClassBits, Occupancy::kUnknown); }
  std::uint32_t known() const { return unknown() ^ bits_; }
  std::uint32_t occupied() const { return equal(OccupancyMap::kClassBits, Occupancy::kOccupied); }
  /// Free, and no return ever fell into it.
  std::uint32_t clear() const { return equal(OccupancyMap::kClassBits | OccupancyMap::kHitBit, Occupancy::kFree); }

 private:
  static constexpr std::uint64_t each(unsigned byte) { return 0x0101010101010101ULL * byte; }

  /// Of which voxels the read bits are this class, and nothing else.
  std::uint32_t equal(unsigned read, Occupancy wanted) const {
    const std::uint64_t different = (bytes_ & each(read)) ^ each(static_cast<unsigned>(wanted));
    const std::uint64_t flags = (different + each(0x7F)) >> 7 & each(1);  // no byte is above 127
    return static_cast<std::uint32_t>((flags ^ each(1)) * 0x0102040810204080ULL >> 56) & bits_;
  }

  std::uint64_t bytes_ = 0;
  std::uint32_t bits_ = 0xFF;
};

}  // namespace stairwell::mapping
