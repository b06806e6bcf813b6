#include "apps/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace stairwell::apps {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kResamples = 10'000;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Linear interpolation between order statistics.
double quantile(const std::vector<double>& sorted, double part) {
  const double at = part * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

Estimate estimate(const std::vector<double>& values, Rng rng) {
  if (values.empty() || !std::ranges::all_of(values, [](double v) { return std::isfinite(v); }))
    return {kNan, kNan, kNan, kNan};
  const double mean = mean_of(values);
  if (values.size() == 1) return {mean, kNan, mean, mean};
  double squares = 0.0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  std::vector<double> means(kResamples);
  const int last = static_cast<int>(values.size()) - 1;
  for (double& one : means) {  // Efron & Tibshirani 1993, chapter 13
    double sum = 0.0;
    for (int i = 0; i <= last; ++i) sum += values[static_cast<std::size_t>(rng.uniform_int(0, last))];
    one = sum / static_cast<double>(values.size());
  }
  std::ranges::sort(means);
  return {mean, std::sqrt(squares / last), quantile(means, 0.025), quantile(means, 0.975)};
}

const char* to_string(Difference difference) {
  switch (difference) {
    case Difference::kTooFew:
      return "too few pairs";
    case Difference::kSame:
      return "the same";
    case Difference::kNotSignificant:
      return "not significant";
    case Difference::kSignificant:
      return "significant";
  }
  return "unknown";
}

PairedDifference compare_pairs(const std::vector<double>& first, const std::vector<double>& second, Rng rng) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < first.size(); ++i)
    if (std::isfinite(first[i]) && std::isfinite(second[i])) differences.push_back(second[i] - first[i]);
  const Estimate found = estimate(differences, rng);
  if (differences.size() < kLeastPairs) return {found, Difference::kTooFew};
  if (std::ranges::all_of(differences, [](double d) { return d == 0.0; })) return {found, Difference::kSame};
  const bool holds_zero = found.low <= 0.0 && found.high >= 0.0;
  return {found, holds_zero ? Difference::kNotSignificant : Difference::kSignificant};
}

}  // namespace stairwell::apps
