#pragma once

#include "mapping/occupancy_map.hpp"

#include <vector>

namespace stairwell::coverage3d {

/// What a view's gain counts: unknown volume, or the uncertainty that the map is expected to lose.
enum class GainKind { kVolume, kEntropy };

/// H(p) = -p log2 p - (1 - p) log2(1 - p), in bits; 0 for p = 0 and 1.
double binary_entropy(double p);

/// Expected reduction of a voxel's binary entropy by looking at it (Julian, Karaman, Rus 2014; SPEC C3), with the
/// sensor that OctoMap's updates imply: P(hit | occupied) / P(hit | free) are the odds of p_hit, P(miss | occupied) /
/// P(miss | free) those of p_miss. A look is a few scans, and the posterior is what the map will hold, clamped.
class InformationGain {
 public:
  static constexpr int kLooks = 5;  ///< scans that pass a voxel while a UAV looks: half a second at 10 Hz

  /// @throws InputError when scans do not make an unknown voxel surer
  explicit InformationGain(const mapping::OccupancyParams& params, int looks = kLooks);

  /// In bits; negative where the map is as sure as its clamping lets it be, so that only doubt can come.
  double expected_bits(double log_odds) const { return expected_bits(log_odds, looks_); }
  /// Of a known voxel, as a part of what an unknown one gives; from a table, never negative.
  double part_of_unknown(float log_odds) const;

 private:
  double expected_entropy(double log_odds, int looks) const;
  double expected_bits(double log_odds, int looks) const;

  int looks_;
  double hit_, miss_, lo_, hi_;           ///< log-odds
  double hit_if_occupied_, hit_if_free_;  ///< probabilities
  std::vector<double> part_;              ///< at even steps of the log-odds from lo_ to hi_
};

}  // namespace stairwell::coverage3d
