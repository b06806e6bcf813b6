#pragma once

#include <cstdint>

namespace stairwell::mapping {

/// Vector instructions to use. The results are the same with all of them.
enum class Simd : std::uint8_t { kBest, kScalar, kAvx2, kAvx512 };  ///< kBest: the widest that the processor has

/// Whether this processor (and this build) has them.
bool supported(Simd simd);
/// "best", "scalar", "AVX2", "AVX-512".
const char* name_of(Simd simd);

}  // namespace stairwell::mapping
