#include "mapping/distance_pass.hpp"

#include <algorithm>
#include <cstring>

// The same loops in wider registers where the processor has them (chosen when the program is loaded).
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define STAIRWELL_PASS_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define STAIRWELL_PASS_CLONES
#endif

namespace stairwell::mapping {

namespace {

using Cells = std::int16_t __attribute__((vector_size(kPassCells * sizeof(std::int16_t))));
using Words = std::int64_t __attribute__((vector_size(kPassCells * sizeof(std::int16_t))));

}  // namespace

// Helpers would not be compiled for the wider registers, so everything stands in one function.
STAIRWELL_PASS_CLONES void parabola_pass(const std::int16_t* in, std::ptrdiff_t stride, int below, int above,
                                         std::int16_t* out, int width) {
  for (int i = 0; i < width; i += kPassCells) {
    const std::int16_t* const at = in + i;
    Cells lowest, low, high;
    std::memcpy(&lowest, at, sizeof(lowest));
    const int both = std::min(below, above);
    int k = 1;
    bool open = true;  // some cell may still be lowered
    for (; open && k <= both; ++k) {
      const auto squared = static_cast<std::int16_t>(k * k);
      std::memcpy(&low, at - k * stride, sizeof(low));
      std::memcpy(&high, at + k * stride, sizeof(high));
      low = (low < high ? low : high) + squared;
      lowest = low < lowest ? low : lowest;
      if (k % 4 == 0) {
        const Cells lowerable = lowest > squared;
        Words words;
        std::memcpy(&words, &lowerable, sizeof(words));
        open = (words[0] | words[1] | words[2] | words[3] | words[4] | words[5] | words[6] | words[7]) != 0;
      }
    }
    for (; open && k <= below; ++k) {
      std::memcpy(&low, at - k * stride, sizeof(low));
      low += static_cast<std::int16_t>(k * k);
      lowest = low < lowest ? low : lowest;
    }
    for (k = both + 1; open && k <= above; ++k) {
      std::memcpy(&high, at + k * stride, sizeof(high));
      high += static_cast<std::int16_t>(k * k);
      lowest = high < lowest ? high : lowest;
    }
    std::memcpy(out + i, &lowest, sizeof(lowest));
  }
}

}  // namespace stairwell::mapping
