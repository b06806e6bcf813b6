#include "core/errors.hpp"
#include "core/rng.hpp"
#include "mapping/scan_integrator.hpp"
#include "perception/cloud_pipeline.hpp"
#include "toy_building.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

using namespace stairwell;
using explore::Fleet;
using explore::StopReason;
using test::no_clock;
using test::ToySimulation;

namespace {

const std::vector<Eigen::Vector3d> kStarts_m{{0.7, 0.7, 1.0}, {0.7, 2.0, 1.0}, {0.7, 3.3, 1.0}};

/// Passes scans on and keeps the last one.
class OverheardSensor final : public DepthSource {
 public:
  explicit OverheardSensor(DepthSource& sensor) : sensor_(sensor) {}
  const SensorModel& model() const override { return sensor_.model(); }
  Scan capture(const Pose& T_world_sensor, double time_s) override {
    last = sensor_.capture(T_world_sensor, time_s);
    return last;
  }
  Scan last;

 private:
  DepthSource& sensor_;
};

/// What each UAV may know, by the plainest means: own scans, and at every tick all that those in touch know.
struct Reference {
  Reference(const explore::FleetConfig& config, const GridSpec& grid, std::size_t uavs)
      : pipeline(config.cloud), known(uavs, std::vector<bool>(grid.voxel_count())), one_scan(grid, config.occupancy) {}

  void tick(const std::vector<Eigen::Vector3d>& at_m, const std::vector<Scan>& scans, const Radio& radio) {
    exchange(at_m, radio);
    for (std::size_t i = 0; i < at_m.size(); ++i) {
      std::vector<Eigen::Vector3d> fellows_m = at_m;
      fellows_m.erase(fellows_m.begin() + static_cast<std::ptrdiff_t>(i));
      mapping::OccupancyMap map(one_scan.grid(), one_scan.params());
      integrator.integrate(pipeline.filter(scans[i], fellows_m), map);
      for (std::size_t v = 0; v < known[i].size(); ++v) {
        if (map.at(map.grid().voxel(v)) != Occupancy::kUnknown) known[i][v] = true;
      }
    }
    exchange(at_m, radio);
  }
  void exchange(const std::vector<Eigen::Vector3d>& at_m, const Radio& radio) {
    for (std::size_t hop = 1; hop < at_m.size(); ++hop)
      for (std::size_t i = 0; i < at_m.size(); ++i)
        for (std::size_t j = 0; j < at_m.size(); ++j) {
          if (!radio.linked(at_m[i], at_m[j])) continue;
          for (std::size_t v = 0; v < known[i].size(); ++v) known[i][v] = known[i][v] || known[j][v];
        }
  }

  perception::CloudPipeline pipeline;
  std::vector<std::vector<bool>> known;
  mapping::OccupancyMap one_scan;
  mapping::ScanIntegrator integrator;
};

explore::FleetConfig coarse_config() {
  explore::FleetConfig config = test::toy_config();
  config.resolution_m = 0.15;
  config.time_limit_s = 25.0;
  return config;
}

std::size_t differing(const std::vector<bool>& known, const mapping::OccupancyMap& map) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < known.size(); ++v) {
    count += known[v] != (map.at(map.grid().voxel(v)) != Occupancy::kUnknown) ? 1 : 0;
  }
  return count;
}

}  // namespace

TEST_CASE("a UAV knows its own scans and what those in touch with it knew, and nothing else") {
  const double range_m = GENERATE(0.1, 1.2, 100.0);
  const auto config = coarse_config();
  ToySimulation sim(test::two_rooms(), config, kStarts_m);
  const sim3d::RangeRadio radio(range_m);
  auto doors = sim.doors();
  std::vector<std::unique_ptr<OverheardSensor>> sensors;
  for (auto& door : doors) {
    sensors.push_back(std::make_unique<OverheardSensor>(*door.sensor));
    door.sensor = sensors.back().get();
  }
  explore::ExplorationLog log;
  Fleet fleet(config, doors, log, no_clock, &radio);
  Reference reference(config, fleet.map().grid(), doors.size());
  std::set<std::size_t> group_counts;
  while (fleet.step()) {
    std::vector<Eigen::Vector3d> at_m;
    std::vector<Scan> scans;
    for (std::size_t i = 0; i < fleet.size(); ++i) {
      at_m.push_back(fleet.uav_state(i).position_m);
      scans.push_back(sensors[i]->last);
    }
    reference.tick(at_m, scans, radio);
    for (std::size_t i = 0; i < fleet.size(); ++i) {
      INFO("UAV " << i << " at " << fleet.time_s() << " s, range " << range_m);
      REQUIRE(differing(reference.known[i], fleet.map_of(i)) == 0);
    }
    group_counts.insert(fleet.map_count());
  }
  if (range_m > 50.0) CHECK(group_counts == std::set<std::size_t>{1});
  if (range_m < 0.5) CHECK(group_counts == std::set<std::size_t>{3});
  if (range_m == 1.2) CHECK(group_counts.size() > 1);
  CHECK((fleet.stats().map_exchanges > 0) == (range_m == 1.2));
}

TEST_CASE("a radio that reaches everybody changes nothing") {
  const auto config = test::toy_config();
  const sim3d::RangeRadio radio(1e6);
  std::vector<Eigen::Vector3d> ends_m;
  for (const Radio* link : {static_cast<const Radio*>(nullptr), static_cast<const Radio*>(&radio)}) {
    ToySimulation sim(test::two_rooms(), config, kStarts_m);
    explore::ExplorationLog log;
    Fleet fleet(config, sim.doors(), log, no_clock, link);
    while (fleet.time_s() < 10.0 && fleet.step()) {
    }
    for (std::size_t i = 0; i < fleet.size(); ++i) ends_m.push_back(fleet.uav_state(i).position_m);
  }
  for (std::size_t i = 0; i < 3; ++i) CHECK(ends_m[i] == ends_m[i + 3]);
}

TEST_CASE("UAVs out of touch share the work out: together they see what one map would hold, none of them all of it") {
  auto config = test::toy_config();
  config.time_limit_s = 120.0;
  const auto known_together = [&](const Radio* link, std::size_t& least) {
    ToySimulation sim(test::two_rooms(), config, kStarts_m);
    explore::ExplorationLog log;
    Fleet fleet(config, sim.doors(), log, no_clock, link);
    while (fleet.step()) {
    }
    CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
    const GridSpec& grid = fleet.map().grid();
    std::size_t all = 0;
    for (std::size_t v = 0; v < grid.voxel_count(); ++v) {
      bool known = false;
      for (std::size_t i = 0; i < fleet.size(); ++i)
        known = known || fleet.map_of(i).at(grid.voxel(v)) != Occupancy::kUnknown;
      all += known ? 1 : 0;
    }
    least = all;
    for (std::size_t i = 0; i < fleet.size(); ++i) least = std::min(least, fleet.map_of(i).known_voxels());
    return all;
  };
  std::size_t least_shared = 0;
  std::size_t least_alone = 0;
  const std::size_t shared = known_together(nullptr, least_shared);
  const sim3d::RangeRadio radio(0.5);
  const std::size_t alone = known_together(&radio, least_alone);
  CHECK(least_shared == shared);
  CHECK(static_cast<double>(alone) > 0.97 * static_cast<double>(shared));
  CHECK(static_cast<double>(least_alone) < 0.9 * static_cast<double>(alone));
}

TEST_CASE("a fleet with several maps is saved and carries on") {
  auto config = test::toy_config();
  const sim3d::RangeRadio radio(1.0);
  std::string state;
  std::vector<mapping::OccupancyMap> maps;
  explore::ExplorationLog log;
  std::vector<std::size_t> known;
  {
    ToySimulation sim(test::two_rooms(), config, kStarts_m);
    Fleet fleet(config, sim.doors(), log, no_clock, &radio);
    while (fleet.time_s() < 6.0 && fleet.step()) {
    }
    REQUIRE(fleet.map_count() > 1);
    state = fleet.save_state();
    for (std::size_t i = 0; i < fleet.map_count(); ++i) maps.push_back(fleet.map(i).clone());
    for (std::size_t i = 0; i < fleet.size(); ++i) known.push_back(fleet.map_of(i).known_voxels());
  }
  ToySimulation sim(test::two_rooms(), config, kStarts_m);
  Fleet fleet(config, sim.doors(), log, no_clock, &radio);
  SECTION("whole") {
    fleet.load_state(state, std::move(maps));
    for (std::size_t i = 0; i < fleet.size(); ++i) CHECK(fleet.map_of(i).known_voxels() == known[i]);
    while (fleet.step()) {
    }
    CHECK(fleet.stop_reason() == StopReason::kNothingReachableLeft);
  }
  SECTION("with a map missing") {
    maps.pop_back();
    CHECK_THROWS_AS(fleet.load_state(state, std::move(maps)), InputError);
  }
}
