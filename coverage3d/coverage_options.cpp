#include "coverage3d/coverage_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

namespace stairwell::coverage3d {
namespace {

constexpr double kTime_s = 10.0, kWay_m = 10.0, kVolume_m3 = 10.0, kArea_m2 = 3.0;
constexpr double kMost = 3.0;
constexpr double kLeastFlight_s = 0.5;
constexpr double kStorey_m = 1.8;
constexpr std::size_t kRichest = 3;  // of the short list
constexpr std::array<double, 3> kReaches_m{3.0, 6.0, 12.0};

/// Unknown volume for each second of flight.
double rate(const CoverageOption& option) { return option.gain_m3 / std::max(option.time_s, kLeastFlight_s); }

/// Frontier area of the other options near a place.
std::array<double, 3> area_near(const std::vector<CoverageOption>& options, const Eigen::Vector3d& at_m,
                                const CoverageOption* but) {
  std::array<double, 3> area_m2{};
  for (const CoverageOption& other : options) {
    if (&other == but) continue;
    const double distance_m = (other.position_m - at_m).norm();
    for (std::size_t i = 0; i < kReaches_m.size(); ++i)
      if (distance_m <= kReaches_m[i]) area_m2[i] += other.area_m2;
  }
  return area_m2;
}

double nearest_m(const std::vector<Eigen::Vector3d>& places_m, const Eigen::Vector3d& at_m) {
  double least_m = kMost * kWay_m;
  for (const Eigen::Vector3d& place_m : places_m) least_m = std::min(least_m, (place_m - at_m).norm());
  return least_m;
}

/// What all options have together.
struct Totals {
  double least_s = std::numeric_limits<double>::infinity();
  double least_tour_s = std::numeric_limits<double>::infinity();
  double most_m3 = 0.0;
  double most_rate = 1e-9;
  double area_m2 = 0.0;
  double pressing = 0.0;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();

  explicit Totals(const std::vector<CoverageOption>& options) {
    for (const CoverageOption& option : options) {
      least_s = std::min(least_s, option.time_s);
      least_tour_s = std::min(least_tour_s, option.tour_s);
      most_m3 = std::max(most_m3, option.gain_m3);
      most_rate = std::max(most_rate, rate(option));
      area_m2 += option.area_m2;
      pressing += option.pressing ? 1.0 : 0.0;
      middle_m += option.position_m / static_cast<double>(options.size());
    }
  }
};

class RowWriter {
 public:
  explicit RowWriter(std::vector<float>& rows) : rows_(rows) {}
  void add(double value) { rows_.push_back(static_cast<float>(std::clamp(value, -kMost, kMost))); }
  void add(bool value) { add(value ? 1.0 : 0.0); }

 private:
  std::vector<float>& rows_;
};

void add_itself(RowWriter& row, const OptionScene& scene, const CoverageOption& option) {
  const Eigen::Vector3d offset_m = option.position_m - scene.position_m;
  const double straight_m = offset_m.norm();
  const double speed_mps = scene.velocity_mps.norm();
  row.add(option.time_s / kTime_s);
  row.add(option.way_m / kWay_m);
  row.add(straight_m > 0.5 ? option.way_m / straight_m - 1.0 : 0.0);
  row.add(option.gain_m3 / kVolume_m3);
  row.add(rate(option) / kVolume_m3);
  row.add(option.area_m2 / kArea_m2);
  row.add(option.area_m2 * option.seen_fraction / kArea_m2);
  row.add(option.seen_fraction);
  row.add(option.pocket_m3);
  row.add(option.pressing);
  row.add(offset_m.z() / 3.0);
  row.add(std::abs(offset_m.z()) < kStorey_m);
  row.add(straight_m > 1e-6 ? offset_m.dot(scene.velocity_mps) / straight_m / scene.speed_mps : 0.0);
  row.add(speed_mps / scene.speed_mps);
  row.add(std::cos(option.yaw_rad - scene.yaw_rad));
}

void add_comparison(RowWriter& row, const Totals& all, const std::vector<CoverageOption>& options,
                    const CoverageOption& option) {
  const auto count = static_cast<double>(options.size());
  double sooner = 0.0, richer = 0.0;
  for (const CoverageOption& other : options) {
    if (other.time_s < option.time_s) sooner += 1.0;
    if (other.gain_m3 > option.gain_m3) richer += 1.0;
  }
  row.add((option.time_s - all.least_s) / kTime_s);
  row.add(sooner / count);
  row.add(richer / count);
  row.add(option.gain_m3 / std::max(all.most_m3, 1e-9));
  row.add(rate(option) / all.most_rate);
  row.add((option.tour_s - all.least_tour_s) / kTime_s);
  row.add(all.least_tour_s / (10.0 * kTime_s));
  row.add((option.position_m - all.middle_m).norm() / kWay_m);
  row.add(count / 12.0);
  row.add(all.pressing / 12.0);
  row.add(all.area_m2 / (10.0 * kArea_m2));
}

void add_surroundings(RowWriter& row, const OptionScene& scene, const std::vector<CoverageOption>& options,
                      const CoverageOption& option) {
  const auto there = area_near(options, option.position_m, &option);
  const auto here = area_near(options, scene.position_m, &option);
  for (std::size_t i = 0; i < kReaches_m.size(); ++i) row.add(there[i] / (3.0 * kArea_m2));
  row.add(here[0] / (3.0 * kArea_m2));
  row.add((here[1] - there[1]) / (3.0 * kArea_m2));  // what is left behind
  double alone_m = kMost * kWay_m;
  for (const CoverageOption& other : options)
    if (&other != &option) alone_m = std::min(alone_m, (other.position_m - option.position_m).norm());
  row.add(alone_m / kWay_m);
}

}  // namespace

std::vector<float> option_rows(const OptionScene& scene, const std::vector<CoverageOption>& options) {
  std::vector<float> rows;
  rows.reserve(options.size() * static_cast<std::size_t>(kOptionFeatures));
  RowWriter row(rows);
  const Totals all(options);
  for (const CoverageOption& option : options) {
    add_itself(row, scene, option);
    add_comparison(row, all, options, option);
    add_surroundings(row, scene, options, option);
    row.add(nearest_m(scene.fellow_goals_m, option.position_m) / kWay_m);
    row.add((option.fellow_s - option.time_s) / kTime_s);
    row.add(static_cast<double>(scene.fellows_m.size()) / 4.0);
    row.add(scene.known_share);
  }
  return rows;
}

std::vector<std::size_t> short_list(const std::vector<CoverageOption>& options) {
  std::vector<std::size_t> order(options.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::set<std::size_t> chosen;
  const auto take = [&](std::size_t count, const auto& value) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return value(options[a]) > value(options[b]); });
    chosen.insert(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size())));
  };
  take(kRichest, rate);
  take(1, [](const CoverageOption& option) { return -option.time_s; });
  take(1, [](const CoverageOption& option) { return -option.tour_s; });
  return {chosen.begin(), chosen.end()};
}

std::vector<double> nearest_neighbour_tours_s(const std::vector<double>& start_s,
                                              const std::vector<std::vector<double>>& between_s) {
  const std::size_t count = start_s.size();
  std::vector<double> tours_s = start_s;
  for (std::size_t first = 0; first < count; ++first) {
    std::vector<bool> done(count, false);
    std::size_t at = first;
    for (std::size_t step = 1; step < count; ++step) {
      done[at] = true;
      std::size_t next = count;
      for (std::size_t j = 0; j < count; ++j)
        if (!done[j] && (next == count || between_s[at][j] < between_s[at][next])) next = j;
      tours_s[first] += between_s[at][next];
      at = next;
    }
  }
  return tours_s;
}

}  // namespace stairwell::coverage3d
