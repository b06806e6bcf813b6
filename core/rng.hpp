#pragma once

#include <cstdint>
#include <string_view>

namespace stairwell {

/// xoshiro256** (Blackman & Vigna 2018) with its own distributions, so that a seed gives the same numbers with
/// every standard library.
class Rng {
 public:
  using result_type = std::uint64_t;

  explicit Rng(std::uint64_t seed);

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type{0}; }
  result_type operator()();

  /// Uniform in [0, 1).
  double uniform();
  /// Uniform in [lo, hi).
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  /// Uniform in [lo, hi], both included. @pre lo <= hi
  int uniform_int(int lo, int hi);
  /// Normal distribution (Box-Muller).
  double normal(double mean = 0.0, double sigma = 1.0);

 private:
  std::uint64_t state_[4];
};

/// One independent stream per consumer: the same seed and name always give the same numbers.
Rng make_rng(std::uint64_t seed, std::string_view stream);

}  // namespace stairwell
