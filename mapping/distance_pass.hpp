#pragma once

#include <cstddef>
#include <cstdint>

namespace stairwell::mapping {

/// Cells that are worked on together; rows are padded to a multiple of it.
inline constexpr int kPassCells = 32;

inline constexpr int padded_to_pass(int cells) { return (cells + kPassCells - 1) / kPassCells * kPassCells; }

/// out[i] = min over k in [-below, above] of in[i + k * stride] + k * k, for i in [0, width): one pass of the separable
/// squared distance transform (Felzenszwalb and Huttenlocher 2012) when the few parabolas in reach are compared
/// directly.
/// @pre width is a multiple of kPassCells; all sums fit into 16 bits
void parabola_pass(const std::int16_t* in, std::ptrdiff_t stride, int below, int above, std::int16_t* out, int width);

}  // namespace stairwell::mapping
