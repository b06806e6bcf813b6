#include "mapping/lane_walk.hpp"

#include "core/errors.hpp"

#include <string>

namespace stairwell::mapping {

void RayColumns::resize(std::size_t rays) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    point_m[axis].resize(rays);
    end_m[axis].resize(rays);
    key[axis].resize(rays);
  }
  flags.resize(rays);
}

bool supported(Simd simd) {
#if defined(__x86_64__)
  switch (simd) {
    case Simd::kAvx2:
      return __builtin_cpu_supports("avx2") != 0;
    case Simd::kAvx512:
      return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
             __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512vl") != 0;
    default:
      return true;
  }
#else
  return simd == Simd::kBest || simd == Simd::kScalar;
#endif
}

const char* name_of(Simd simd) {
  switch (simd) {
    case Simd::kScalar:
      return "scalar";
    case Simd::kAvx2:
      return "AVX2";
    case Simd::kAvx512:
      return "AVX-512";
    default:
      return "best";
  }
}

namespace lanes {

const ScanKernels& kernels(Simd simd) {
  if (!supported(simd)) {
    throw InputError(std::string("this processor has no ") + name_of(simd) + " instructions");
  }
#if defined(__x86_64__)
  if (simd == Simd::kAvx512 || (simd == Simd::kBest && supported(Simd::kAvx512))) return avx512_kernels();
  if (simd == Simd::kAvx2 || (simd == Simd::kBest && supported(Simd::kAvx2))) return avx2_kernels();
#endif
  return scalar_kernels();
}

}  // namespace lanes

}  // namespace stairwell::mapping
