/// What a scan costs in maps of 1, 10 and 100 buildings, all but one of them explored before: time should follow what
/// the scan sees, not what the map holds. The same for OctoMap.
#include "mapping/distance_field.hpp"
#include "mapping/scan_integrator.hpp"
#include "scenes.hpp"

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include <memory>

using namespace stairwell;
using namespace stairwell::mapping;

namespace {

constexpr double kResolution_m = 0.1;
constexpr double kTruncation_m = 2.0;
constexpr std::size_t kTimed = 24;  ///< scans of the last building that are timed, again and again

/// Buildings stand in a rectangle; the last one is where the timed scans are taken.
struct Town {
  int across = 1;
  int along = 1;

  explicit Town(std::int64_t buildings) {
    while (across * across < buildings) ++across;
    while (buildings % across != 0) --across;
    along = static_cast<int>(buildings) / across;
  }
  Eigen::Vector3d place(int i) const {
    const Eigen::Vector3d size_m = bench::office_tower().box.max_m - bench::office_tower().box.min_m;
    return {(i % across) * std::ceil(size_m.x()), (i / across) * std::ceil(size_m.y()), 0.0};
  }
  int count() const { return across * along; }
  Aabb box() const {
    Aabb all = bench::office_tower().box;
    all.max_m += place(count() - 1);
    return all;
  }
};

Scan moved(Scan scan, const Eigen::Vector3d& by_m) {
  scan.T_world_sensor.translation() += by_m;
  return scan;
}

void note(benchmark::State& state, double start_mib) { state.counters["rss_MiB"] = bench::resident_mib() - start_mib; }

void scan_in_town(benchmark::State& state) {
  const bench::Scene& scene = bench::office_tower();
  const double start_mib = bench::resident_mib();
  const Town town(state.range(0));
  OccupancyMap map(GridSpec(town.box(), kResolution_m));
  DistanceField field(map.grid(), kTruncation_m, Obstacles::kBlocked);
  ScanIntegrator integrator;
  for (int i = 0; i < town.count(); ++i) {
    for (const Scan& scan : scene.scans) integrator.integrate(moved(scan, town.place(i)), map);
  }
  field.update(map);
  std::vector<Scan> timed;
  for (std::size_t i = 0; i < kTimed; ++i) timed.push_back(moved(scene.scans[i], town.place(town.count() - 1)));
  std::size_t next = 0;
  for (auto _ : state) {
    integrator.integrate(timed[next++ % kTimed], map);
    field.update(map);
  }
  state.counters["voxels"] = static_cast<double>(map.known_voxels());
  note(state, start_mib);
}

void scan_in_town_octomap(benchmark::State& state) {
  const bench::Scene& scene = bench::office_tower();
  const double start_mib = bench::resident_mib();
  const Town town(state.range(0));
  octomap::OcTree tree(kResolution_m);
  const auto insert = [&](const Scan& scan) {
    octomap::Pointcloud cloud;
    for (const Eigen::Vector3f& p : world_points_of(scan)) cloud.push_back(p.x(), p.y(), p.z());
    const Eigen::Vector3f origin_m = world_origin_of(scan);
    tree.insertPointCloud(cloud, {origin_m.x(), origin_m.y(), origin_m.z()}, scan.max_range_m);
  };
  // The map need not be as well explored as ours to be as wide; half of it saves minutes.
  for (int i = 0; i < town.count(); ++i) {
    for (std::size_t k = 0; k < scene.scans.size(); k += 2) insert(moved(scene.scans[k], town.place(i)));
  }
  std::size_t next = 0;
  for (auto _ : state) insert(moved(scene.scans[next++ % kTimed], town.place(town.count() - 1)));
  note(state, start_mib);
}

}  // namespace

BENCHMARK(scan_in_town)->Name("scale/ours")->Arg(1)->Arg(10)->Arg(100)->Iterations(96)->Unit(benchmark::kMillisecond);
BENCHMARK(scan_in_town_octomap)
    ->Name("scale/octomap")
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Iterations(24)
    ->Unit(benchmark::kMillisecond);
