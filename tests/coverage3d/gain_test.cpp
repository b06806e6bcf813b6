/// What a view is worth (view_gain, information_gain), against slow references.
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "coverage3d/view_gain.hpp"
#include "coverage3d/voxel_walk.hpp"
#include "half_seen.hpp"
#include "mapping/simd.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

double probability(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

/// By every sequence of scans: what the map holds after it, and how likely it is. The sensor is solved for from what
/// one scan makes of an unknown voxel.
double enumerated_bits(const mapping::OccupancyParams& params, double log_odds, int looks) {
  const double hit = std::log(params.p_hit / (1.0 - params.p_hit));
  const double miss = std::log(params.p_miss / (1.0 - params.p_miss));
  // An unknown voxel is hit with probability h, so that h * p_hit + (1 - h) * p_miss is 0.5 again.
  const double h = (0.5 - params.p_miss) / (params.p_hit - params.p_miss);
  const double hit_if_occupied = h * params.p_hit / 0.5;
  const double hit_if_free = h * (1.0 - params.p_hit) / 0.5;
  const double lo = std::log(params.clamp_min / (1.0 - params.clamp_min));
  const double hi = std::log(params.clamp_max / (1.0 - params.clamp_max));
  const double p = probability(log_odds);
  double expected = 0.0;
  for (unsigned scans = 0; scans < 1u << looks; ++scans) {
    double held = log_odds, sure = p, share = 1.0;
    for (int i = 0; i < looks; ++i) {
      const bool hits = (scans >> i & 1u) != 0;
      const double hit_share = sure * hit_if_occupied + (1.0 - sure) * hit_if_free;  // as the map of the moment has it
      share *= hits ? hit_share : 1.0 - hit_share;
      held = std::min(hi, std::max(lo, held + (hits ? hit : miss)));
      sure = probability(held);
    }
    expected += share * binary_entropy(sure);
  }
  return binary_entropy(p) - expected;
}

/// A room of 8 x 8 x 4 m in which every voxel has been seen a few times, or never, or is a wall.
mapping::OccupancyMap patchy_room(double resolution_m, std::uint64_t seed) {
  mapping::OccupancyMap map(GridSpec(Aabb{{0, 0, 0}, {8, 8, 4}}, resolution_m));
  Rng rng(seed);
  const int step = static_cast<int>(std::lround(0.8 / resolution_m));  // patches, not salt and pepper
  const std::array<int, 3> size = map.grid().size();
  for (int z = 0; z < size[2]; z += step)
    for (int y = 0; y < size[1]; y += step)
      for (int x = 0; x < size[0]; x += step) {
        const bool near = std::abs(x - size[0] / 2) < 2 * step && std::abs(y - size[1] / 2) < 2 * step;
        const int seen = rng.uniform_int(0, 6);
        const bool wall = !near && rng.uniform() < 0.08;
        for (int c = 0; c < step * step * step; ++c) {
          const VoxelIndex v{x + c % step, y + c / step % step, z + c / step / step};
          for (int i = 0; i < (near ? 1 + seen / 2 : seen); ++i) map.update(v, wall);
        }
      }
  return map;
}

/// Voxel by voxel: whether the straight line to its centre meets no surface, nor too much unknown space, on the way.
double enumerated_m3(const mapping::OccupancyMap& map, const ViewGainConfig& config, const Eigen::Vector3d& from_m) {
  const GridSpec& grid = map.grid();
  const InformationGain information(config.occupancy);
  double sum_m3 = 0.0;
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const Eigen::Vector3d offset_m = grid.center_of(v) - from_m;
    const double up = std::atan2(offset_m.z(), offset_m.head<2>().norm());
    if (offset_m.norm() < config.sensor.min_range_m || offset_m.norm() > config.sensor.max_range_m) continue;
    if (up < config.sensor.elevation_lo_rad || up > config.sensor.elevation_hi_rad) continue;
    std::size_t unknown = 0, passed = 0;
    const bool in_sight = walk_voxels(grid, from_m, grid.center_of(v), [&](const VoxelIndex& w) {
      ++passed;
      unknown += map.at(w) == Occupancy::kUnknown;
      return w == v || (map.at(w) != Occupancy::kOccupied && !map.ever_hit(w));
    });
    const double depth_m = offset_m.norm() * static_cast<double>(unknown) / static_cast<double>(passed);
    if (!in_sight || depth_m > 0.6 * config.sensor.max_range_m) continue;
    const bool is_unknown = map.at(v) == Occupancy::kUnknown;
    if (!is_unknown && config.kind == GainKind::kVolume) continue;
    const double held = is_unknown ? 0.0 : static_cast<double>(map.log_odds(v));
    sum_m3 += std::max(0.0, information.expected_bits(held)) / information.expected_bits(0.0) * grid.voxel_volume_m3();
  }
  return sum_m3;
}

}  // namespace

TEST_CASE("what a look teaches is what all sequences of scans teach together") {
  mapping::OccupancyParams narrow;
  narrow.p_hit = 0.9;
  narrow.p_miss = 0.3;
  narrow.clamp_min = 0.02;
  narrow.clamp_max = 0.99;
  for (const mapping::OccupancyParams& params : {mapping::OccupancyParams{}, narrow}) {
    for (const int looks : {1, 2, 5, 7}) {
      const InformationGain gain(params, looks);
      for (double log_odds = -4.0; log_odds <= 4.5; log_odds += 0.37) {
        INFO("log-odds " << log_odds << ", looks " << looks);
        CHECK(gain.expected_bits(log_odds) == Approx(enumerated_bits(params, log_odds, looks)).margin(1e-9));
        if (log_odds < std::log(params.clamp_min / (1.0 - params.clamp_min))) continue;
        if (log_odds > std::log(params.clamp_max / (1.0 - params.clamp_max))) continue;
        const double part = std::max(0.0, gain.expected_bits(log_odds)) / gain.expected_bits(0.0);
        CHECK(gain.part_of_unknown(static_cast<float>(log_odds)) == Approx(part).margin(0.01));
      }
    }
  }
}

TEST_CASE("an unknown voxel teaches most, one seen once nearly as much, a sure one nothing") {
  const InformationGain gain{mapping::OccupancyParams{}};
  const auto miss = static_cast<float>(std::log(0.4 / 0.6));
  CHECK(gain.part_of_unknown(0.0F) == Approx(1.0).margin(0.01));
  double before = 1.0;
  for (int seen = 1; seen <= 4; ++seen) {
    const double now = gain.part_of_unknown(static_cast<float>(seen) * miss);
    CHECK(now < before);
    before = now;
  }
  CHECK(gain.part_of_unknown(miss) > 0.8);
  CHECK(gain.part_of_unknown(5.0F * miss) == 0.0);
  CHECK(binary_entropy(0.5) == Approx(1.0));
  CHECK(binary_entropy(0.0) == 0.0);
  CHECK(binary_entropy(1.0) == 0.0);
  mapping::OccupancyParams blind;
  blind.p_hit = blind.p_miss = 0.5;
  CHECK_THROWS_AS(InformationGain(blind), InputError);
}

TEST_CASE("the rays of a view add up to what its voxels are worth one by one") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const mapping::OccupancyMap map = patchy_room(0.1, seed);
    ViewGainConfig config;
    config.sensor = toy::lidar();
    config.sensor.max_range_m = 3.5;
    config.box = map.grid().box();
    double by_volume_m3 = 0.0;
    for (const GainKind kind : {GainKind::kVolume, GainKind::kEntropy}) {
      config.kind = kind;
      double fast_m3 = 0.0, slow_m3 = 0.0;
      for (const double x_m : {3.53, 4.03, 4.47})  // few rays: a single pose is off by a quarter
        for (const double y_m : {3.53, 4.03, 4.47}) {
          fast_m3 += ViewGain(config).gain_m3(map, {x_m, y_m, 2.02}, 0.0);
          slow_m3 += enumerated_m3(map, config, {x_m, y_m, 2.02});
        }
      INFO("seed " << seed << (kind == GainKind::kVolume ? ", volume" : ", entropy"));
      CHECK(fast_m3 == Approx(slow_m3).epsilon(0.12));
      if (kind == GainKind::kVolume) by_volume_m3 = fast_m3;
      if (kind == GainKind::kEntropy) CHECK(fast_m3 > 1.2 * by_volume_m3);
    }
  }
}

TEST_CASE("by entropy a strategy sees the whole world, too") {
  for (const std::string_view name : {"frontiers", "greedy"}) {
    toy::Scenario scenario{"storeys", toy::two_storeys(0.2), {{1.5, 1.5, 1.2}}, {}, 400, {}};
    scenario.config = toy::config_for(scenario.world, toy::camera());
    scenario.config.gain = GainKind::kEntropy;
    scenario.seeable = toy::seeable_from(scenario);
    const toy::Outcome outcome = toy::run(scenario, *make_strategy(name, scenario.config));
    INFO(name);
    CHECK(outcome.finished);
    CHECK(outcome.known_part >= 0.99);
  }
}

TEST_CASE("rays followed four at a time add up to what they add up to one by one, to the last digit") {
  for (const double resolution_m : {0.1, 0.2}) {
    const mapping::OccupancyMap map = patchy_room(resolution_m, 11);
    Rng rng(3);
    for (const bool all_round : {true, false}) {
      for (const double max_range_m : {3.0, 15.0}) {
        ViewGainConfig config;
        config.box = Aabb{{0.5, 0.3, 0.25}, {7.6, 7.4, 3.7}};
        config.sensor.max_range_m = max_range_m;
        config.sensor.min_range_m = 0.5;
        if (all_round) config.sensor.azimuth_fov_rad = 2.0 * kPi;
        REQUIRE(gain_rays::usable(map, config.box) == mapping::supported(mapping::Simd::kAvx2));
        const ViewGain bundled(config);
        const ViewGain plain(config, true);
        for (int i = 0; i < 60; ++i) {
          const Eigen::Vector3d from_m(8.0 * rng.uniform(), 8.0 * rng.uniform(), 4.0 * rng.uniform());
          CAPTURE(resolution_m, all_round, max_range_m, from_m.transpose());
          CHECK(bundled.panorama(map, from_m) == plain.panorama(map, from_m));
        }
      }
    }
  }
}
