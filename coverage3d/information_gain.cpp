#include "coverage3d/information_gain.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::coverage3d {
namespace {

constexpr int kSteps = 256;  // of the table

double log_odds_of(double p) { return std::log(p / (1.0 - p)); }
double probability_of(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

}  // namespace

double binary_entropy(double p) {
  if (p <= 0.0 || p >= 1.0) return 0.0;
  return -p * std::log2(p) - (1.0 - p) * std::log2(1.0 - p);
}

InformationGain::InformationGain(const mapping::OccupancyParams& params, int looks)
    : looks_(looks),
      hit_(log_odds_of(params.p_hit)),
      miss_(log_odds_of(params.p_miss)),
      lo_(log_odds_of(params.clamp_min)),
      hi_(log_odds_of(params.clamp_max)) {
  const double hit_ratio = std::exp(hit_);
  const double miss_ratio = std::exp(miss_);
  hit_if_free_ = (1.0 - miss_ratio) / (hit_ratio - miss_ratio);
  hit_if_occupied_ = hit_ratio * hit_if_free_;
  const double unknown = expected_bits(0.0);
  if (!(unknown > 0.0)) {
    throw InputError(
        "gain entropy: with these p_hit, p_miss and clamps no scan makes the map surer; "
        "p_miss < 0.5 < p_hit is needed");
  }
  for (int i = 0; i <= kSteps; ++i) part_.push_back(expected_bits(lo_ + (hi_ - lo_) * i / kSteps) / unknown);
}

double InformationGain::expected_entropy(double log_odds, int looks) const {
  const double p = probability_of(log_odds);
  if (looks == 0) return binary_entropy(p);
  const double hit = p * hit_if_occupied_ + (1.0 - p) * hit_if_free_;
  return hit * expected_entropy(std::clamp(log_odds + hit_, lo_, hi_), looks - 1) +
         (1.0 - hit) * expected_entropy(std::clamp(log_odds + miss_, lo_, hi_), looks - 1);
}

double InformationGain::expected_bits(double log_odds, int looks) const {
  return binary_entropy(probability_of(log_odds)) - expected_entropy(log_odds, looks);
}

double InformationGain::part_of_unknown(float log_odds) const {
  const double at = std::clamp((static_cast<double>(log_odds) - lo_) / (hi_ - lo_), 0.0, 1.0) * kSteps;
  const auto below = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(kSteps - 1));
  const double beyond = at - static_cast<double>(below);
  return std::max(0.0, (1.0 - beyond) * part_[below] + beyond * part_[below + 1]);
}

}  // namespace stairwell::coverage3d
