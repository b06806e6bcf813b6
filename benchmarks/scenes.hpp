/// What the benchmarks run on: depth scans of our own three-storey building.
#pragma once

#include "core/aabb.hpp"
#include "core/scan.hpp"

#include <benchmark/benchmark.h>

#include <array>
#include <utility>
#include <vector>

namespace stairwell::bench {

struct Scene {
  Aabb box;
  std::vector<Scan> scans;
};

/// Depth images (320x240, 90 x 73.7 degrees, 8 m) from poses spread over all storeys of worlds/office_tower.sdf, the
/// same ones each time.
/// @throws InputError when the world is missing.
const Scene& office_tower();

/// The same camera on a flight of 240 scans, 10 a second at 1 m/s, through the same building: ahead while nothing is
/// near, else turning. The first twelve scans are a turn on the spot.
const Scene& office_flight();

/// 0.10 m and 0.05 m, and how they are written in the benchmarks' names.
std::array<std::pair<double, const char*>, 2> resolutions();

/// Processor time of this thread: what other programs take does not count.
double thread_time_s();

/// Memory of this process that is resident now, and the most that ever was.
double resident_mib();
double peak_resident_mib();

/// Writes the growth of the peak while it lives as the counter rss_MiB; tells the truth when the benchmark has the
/// process to itself.
class MemoryNote {
 public:
  explicit MemoryNote(benchmark::State& state) : state_(state), start_mib_(resident_mib()) {}
  ~MemoryNote() { state_.counters["rss_MiB"] = peak_resident_mib() - start_mib_; }
  MemoryNote(const MemoryNote&) = delete;
  MemoryNote& operator=(const MemoryNote&) = delete;

 private:
  benchmark::State& state_;
  double start_mib_;
};

}  // namespace stairwell::bench
