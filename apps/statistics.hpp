#pragma once

#include "core/rng.hpp"

#include <cstddef>
#include <vector>

namespace stairwell::apps {

/// Mean, standard deviation (n - 1) and the 95 % interval of the mean by the percentile bootstrap; NaN where there are
/// no values. Of a single value there is no deviation, and the interval is the value.
struct Estimate {
  double mean, sd, low, high;
};

/// Repeatable for a generator's state. Values that are not finite make everything NaN.
Estimate estimate(const std::vector<double>& values, Rng rng);

enum class Difference {
  kTooFew,          ///< pairs: fewer than kLeastPairs
  kSame,            ///< every pair is equal
  kNotSignificant,  ///< the interval holds 0
  kSignificant,
};
const char* to_string(Difference difference);

/// Fewer pairs say nothing about an interval.
inline constexpr std::size_t kLeastPairs = 4;

struct PairedDifference {
  Estimate difference;  ///< of second minus first
  Difference verdict;
};

/// @pre as many in `first` as in `second`, of the same seeds in the same order
PairedDifference compare_pairs(const std::vector<double>& first, const std::vector<double>& second, Rng rng);

}  // namespace stairwell::apps
