#include "learning/nn/network_kernels.hpp"

#include <algorithm>
#include <cstring>

// Copies for processors with AVX2, chosen when the program starts. Sanitizers do not go together with that.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define STAIRWELL_CLONES __attribute__((target_clones("avx2", "default")))
#define STAIRWELL_INLINE inline __attribute__((always_inline))
#else
#define STAIRWELL_CLONES
#define STAIRWELL_INLINE inline
#endif

namespace stairwell::nn {

namespace {

using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

/// kPlaces outputs along x, kVectors * kLanes of their channels from `first` on.
template <std::size_t kPlaces, std::size_t kVectors>
STAIRWELL_INLINE void convolve_block(const ConvPass& pass, const float* input, std::size_t first, float* output) {
  Lanes sum[kPlaces][kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) {
    for (std::size_t p = 0; p < kPlaces; ++p) std::memcpy(&sum[p][v], pass.biases + first + v * kLanes, sizeof(Lanes));
  }
  const std::size_t run = pass.kernel[2] * pass.in;  // one row of the kernel lies in one piece
  const std::size_t step = pass.stride[2] * pass.in;
  const float* weights = pass.weights + first;
  for (std::size_t z = 0; z < pass.kernel[0]; ++z) {
    for (std::size_t y = 0; y < pass.kernel[1]; ++y) {
      const float* row = input + z * pass.slab + y * pass.row;
      for (std::size_t i = 0; i < run; ++i, weights += pass.out) {
        Lanes w[kVectors];
        for (std::size_t v = 0; v < kVectors; ++v) std::memcpy(&w[v], weights + v * kLanes, sizeof(Lanes));
        for (std::size_t p = 0; p < kPlaces; ++p) {
          const float x = row[p * step + i];
          for (std::size_t v = 0; v < kVectors; ++v) sum[p][v] += w[v] * x;
        }
      }
    }
  }
  for (std::size_t p = 0; p < kPlaces; ++p) {
    for (std::size_t v = 0; v < kVectors; ++v) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        output[p * pass.out + first + v * kLanes + l] = std::max(0.0F, sum[p][v][l]);
      }
    }
  }
}

template <std::size_t kPlaces>
STAIRWELL_INLINE void convolve_channels(const ConvPass& pass, const float* input, float* output) {
  std::size_t first = 0;
  for (; first + 2 * kLanes <= pass.out; first += 2 * kLanes) convolve_block<kPlaces, 2>(pass, input, first, output);
  if (first < pass.out) convolve_block<kPlaces, 1>(pass, input, first, output);
}

template <std::size_t kVectors>
STAIRWELL_INLINE void multiply_block(const float* inputs, std::size_t in, const float* weights, const float* biases,
                                     std::size_t out, float* outputs) {
  Lanes sum[kVectors];
  std::memcpy(sum, biases, sizeof(sum));
  for (std::size_t i = 0; i < in; ++i, weights += out) {
    Lanes w[kVectors];
    std::memcpy(w, weights, sizeof(w));
    for (std::size_t v = 0; v < kVectors; ++v) sum[v] += w[v] * inputs[i];
  }
  std::memcpy(outputs, sum, sizeof(sum));
}

}  // namespace

STAIRWELL_CLONES void convolve_relu(const ConvPass& pass) {
  for (std::size_t z = 0; z < pass.size[0]; ++z) {
    for (std::size_t y = 0; y < pass.size[1]; ++y) {
      const float* input = pass.input + z * pass.stride[0] * pass.slab + y * pass.stride[1] * pass.row;
      float* output = pass.output + z * pass.out_slab + y * pass.out_row;
      const std::size_t step = pass.stride[2] * pass.in;
      std::size_t x = 0;
      for (; pass.out == kLanes && x + 8 <= pass.size[2]; x += 8) {
        convolve_channels<8>(pass, input + x * step, output + x * pass.out);
      }
      for (; x + 4 <= pass.size[2]; x += 4) convolve_channels<4>(pass, input + x * step, output + x * pass.out);
      for (; x < pass.size[2]; ++x) convolve_channels<1>(pass, input + x * step, output + x * pass.out);
    }
  }
}

STAIRWELL_CLONES void multiply(const float* inputs, std::size_t in, const float* weights, const float* biases,
                               std::size_t out, float* outputs) {
  std::size_t o = 0;
  for (; o + 8 * kLanes <= out; o += 8 * kLanes) {
    multiply_block<8>(inputs, in, weights + o, biases + o, out, outputs + o);
  }
  for (; o < out; o += kLanes) multiply_block<1>(inputs, in, weights + o, biases + o, out, outputs + o);
}

}  // namespace stairwell::nn
