#include "coverage3d/far_ways.hpp"

#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr double kExact_m = 25.0;
constexpr double kKept_s = 30.0;   // lengths are looked up again after this ...
constexpr double kMoved_m = 15.0;  // ... or from where none are kept so near
constexpr std::size_t kKeptEach = 3;

}  // namespace

std::shared_ptr<const std::vector<float>> FarWays::known_near(const Eigen::Vector3d& start_m) const {
  std::shared_ptr<const std::vector<float>> nearest;
  double least_m = kMoved_m;
  for (const Lengths& lengths : kept_) {
    const double off_m = (lengths.start_m - start_m).norm();
    if (off_m >= least_m) continue;
    least_m = off_m;
    nearest = lengths.by_part;
  }
  return nearest;
}

void FarWays::compute(const planning3d::FreeSpace& space, planning3d::PassableLattice& lattice,
                      const std::vector<Source>& sources, double time_s, std::size_t uavs,
                      mapping::WorkerPool* workers) {
  std::erase_if(kept_, [&](const Lengths& lengths) { return time_s - lengths.time_s >= kKept_s; });
  std::vector<std::shared_ptr<const std::vector<float>>> known;
  for (const Source& source : sources) known.push_back(known_near(source.start_m));
  if (std::find(known.begin(), known.end(), nullptr) != known.end()) regions_->update(lattice, workers);
  std::vector<std::shared_ptr<const std::vector<float>>> lengths(sources.size());
  mapping::for_each_index(workers, sources.size(), [&](std::size_t i) {
    planning3d::TravelCosts& costs = *sources[i].costs;
    costs.compute(space, sources[i].start_m, planning3d::MotionRule::volume(), kExact_m, &lattice);
    lengths[i] = costs.estimate_beyond(*regions_, known[i]);
  });
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (known[i] == nullptr && lengths[i] != nullptr)
      kept_.push_back({sources[i].start_m, time_s, std::move(lengths[i])});
  }
  const std::size_t most = kKeptEach * uavs;
  if (kept_.size() > most) kept_.erase(kept_.begin(), kept_.end() - static_cast<std::ptrdiff_t>(most));
}

}  // namespace stairwell::coverage3d
