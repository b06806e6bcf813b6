#include "mapping/scan_integrator.hpp"

#include "core/errors.hpp"
#include "mapping/lane_walk.hpp"
#include "mapping/ray_walk.hpp"
#include "mapping/scan_window.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace stairwell::mapping {

namespace {

/// The greatest squared distance whose root is within the range, so that one comparison in float32 decides what
/// OctoMap decides in double.
float greatest_squared(double range_m) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (range_m < 0.0 || std::isinf(range_m)) {
    return kInfinity;
  }
  auto squared = static_cast<float>(range_m * range_m);
  while (!(std::sqrt(static_cast<double>(squared)) <= range_m)) {
    squared = std::nextafter(squared, 0.0F);
  }
  for (float next = squared; std::sqrt(static_cast<double>(next)) <= range_m; next = std::nextafter(next, kInfinity)) {
    squared = next;
  }
  return squared;
}

ScanFrame frame_of(const Scan& scan, const RayLattice& lattice, const Eigen::Vector3f& origin_m,
                   const LatticeKey& origin_key) {
  ScanFrame frame;
  const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> R = scan.T_world_sensor.linear().cast<float>();
  std::copy_n(R.data(), 9, frame.rotation.begin());
  std::copy_n(origin_m.data(), 3, frame.origin_m.begin());
  frame.per_m = 1.0 / lattice.resolution_m();
  frame.resolution_m = static_cast<float>(lattice.resolution_m());
  frame.squared_range_m2 = greatest_squared(scan.max_range_m);
  frame.range_m = static_cast<float>(scan.max_range_m);
  frame.origin_key = {origin_key.x, origin_key.y, origin_key.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from_center_m = lattice.center_of(frame.origin_key[axis]) - static_cast<double>(frame.origin_m[axis]);
    frame.border_up_m[axis] = static_cast<float>(from_center_m + 0.5 * lattice.resolution_m());
    frame.border_down_m[axis] = static_cast<float>(from_center_m - 0.5 * lattice.resolution_m());
  }
  return frame;
}

/// Leaves one ray for every voxel that holds a return, to the voxel's centre
/// (octomap::OccupancyOcTreeBase::computeDiscreteUpdate).
class EndVoxels {
 public:
  void keep_one_per_voxel(const RayLattice& lattice, RayColumns& rays) {
    const std::size_t count = rays.size();
    std::size_t slots = 1024;
    while (slots < 2 * count) slots *= 2;
    taken_.assign(slots, kNone);
    std::size_t kept = 0;
    std::uint64_t last = kNone;
    for (std::size_t i = 0; i < count; ++i) {
      LatticeKey key;
      if (!lattice.key_of({rays.point_m[0][i], rays.point_m[1][i], rays.point_m[2][i]}, key)) continue;
      const std::uint64_t packed = static_cast<std::uint64_t>(key.x) << 32 | static_cast<std::uint64_t>(key.y) << 16 |
                                   static_cast<std::uint64_t>(key.z);
      if (packed == last || !insert(packed)) continue;  // neighbours often end in one voxel
      last = packed;
      const Eigen::Vector3f center_m = lattice.center_of(key);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        rays.point_m[axis][kept] = center_m[static_cast<Eigen::Index>(axis)];
      }
      ++kept;
    }
    rays.resize(kept);
  }

 private:
  static constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

  bool insert(std::uint64_t packed) {
    const std::size_t mask = taken_.size() - 1;
    for (std::size_t slot = (packed * 0x9E3779B97F4A7C15ULL >> 32) & mask;; slot = (slot + 1) & mask) {
      if (taken_[slot] == packed) return false;
      if (taken_[slot] == kNone) {
        taken_[slot] = packed;
        return true;
      }
    }
  }

  std::vector<std::uint64_t> taken_;
};

}  // namespace

Eigen::Vector3f world_origin_of(const Scan& scan) { return scan.T_world_sensor.translation().cast<float>(); }

std::vector<Eigen::Vector3f> world_points_of(const Scan& scan) {
  const Eigen::Matrix3f R = scan.T_world_sensor.linear().cast<float>();
  const Eigen::Vector3f t = world_origin_of(scan);
  std::vector<Eigen::Vector3f> points_m;
  points_m.reserve(scan.points_m.size());
  for (const Eigen::Vector3f& p : scan.points_m) {
    // Written out so that the order of roundings does not depend on the vector instructions in use.
    points_m.emplace_back(((R(0, 0) * p.x() + R(0, 1) * p.y()) + R(0, 2) * p.z()) + t.x(),
                          ((R(1, 0) * p.x() + R(1, 1) * p.y()) + R(1, 2) * p.z()) + t.y(),
                          ((R(2, 0) * p.x() + R(2, 1) * p.y()) + R(2, 2) * p.z()) + t.z());
  }
  std::erase_if(points_m, [](const Eigen::Vector3f& p) { return !p.allFinite(); });
  return points_m;
}

/// A thread's share of a scan: its own window, so that nobody waits for anybody.
struct Share {
  ScanWindow window;
  RayBatch batch;
  std::vector<std::uint32_t> uncertain;  ///< rays of the batch
  std::size_t steps = 0;
};

struct ScanIntegrator::Impl {
  Config config;
  const WalkKernels* kernels;
  RayColumns rays;
  EndVoxels end_voxels;
  Share share;

  explicit Impl(Config config_in) : config(config_in), kernels(&lanes::kernels(config.simd)) {}

  static RayEnd ray_end(const RayColumns& rays, std::size_t i) {
    return {{rays.end_m[0][i], rays.end_m[1][i], rays.end_m[2][i]},
            {rays.key[0][i], rays.key[1][i], rays.key[2][i]},
            (rays.flags[i] & RayColumns::kHit) != 0};
  }

  /// Carves rays [first, last) into the share's window.
  void carve(const ScanFrame& frame, const RayWalker& walker, std::size_t first, std::size_t last, Share& part) const {
    const WindowView view = part.window.view(walker.origin_key());
    const std::int32_t tolerance = lanes::kRounding + std::min(part.window.longest_side(), lanes::kMaxSteps);
    std::vector<RayEnd> special, uncertain;
    part.steps = 0;
    for (std::size_t at = first; at < last; at += RayBatch::kRays) {
      const std::size_t count = std::min(RayBatch::kRays, last - at);
      part.steps += kernels->prepare(frame, rays, at, count, view, part.batch);
      part.uncertain.clear();
      if (view.origin_cell >= 0) {
        kernels->walk(part.batch, count, view, tolerance, part.uncertain);
      }
      for (const std::uint32_t i : part.uncertain) uncertain.push_back(ray_end(rays, at + i));
      const auto* const flags = part.batch.special.data();
      if (std::accumulate(flags, flags + count, 0) == 0) continue;
      for (std::size_t i = 0; i < count; ++i) {
        if (flags[i] != 0) special.push_back(ray_end(rays, at + i));
      }
    }
    walker.walk(uncertain, part.window);
    part.steps += walker.walk(special, part.window);
    for (std::size_t i = first; i < last; ++i) {
      if ((rays.flags[i] & RayColumns::kHit) != 0) {
        part.window.mark_hit({rays.key[0][i], rays.key[1][i], rays.key[2][i]});
      }
    }
  }
};

ScanIntegrator::ScanIntegrator() : ScanIntegrator(Config{}) {}
ScanIntegrator::ScanIntegrator(Config config) : impl_(std::make_unique<Impl>(config)) {}
ScanIntegrator::~ScanIntegrator() = default;
ScanIntegrator::ScanIntegrator(ScanIntegrator&&) noexcept = default;
ScanIntegrator& ScanIntegrator::operator=(ScanIntegrator&&) noexcept = default;

IntegrationStats ScanIntegrator::integrate(const Scan& scan, OccupancyMap& map) {
  if (!scan.T_world_sensor.matrix().allFinite() || std::isnan(scan.max_range_m)) {
    throw InputError("a scan has a sensor pose or maximum range that is not finite");
  }
  IntegrationStats stats;
  stats.points = scan.points_m.size();
  const RayLattice lattice(map.grid().resolution_m());
  const Eigen::Vector3f origin_m = world_origin_of(scan);
  LatticeKey origin_key;
  if (!lattice.key_of(origin_m, origin_key)) {
    throw InputError("a scan's sensor lies outside OctoMap's key space: use a coarser resolution");
  }
  const ScanFrame frame = frame_of(scan, lattice, origin_m, origin_key);
  RayColumns& rays = impl_->rays;
  rays.resize(scan.points_m.size());
  stats.dropped_not_finite = impl_->kernels->transform(frame, scan.points_m.data(), scan.points_m.size(), rays);
  if (impl_->config.discretize) {
    impl_->end_voxels.keep_one_per_voxel(lattice, rays);
  }
  LatticeBox reach{origin_key, origin_key};
  impl_->kernels->find_ends(frame, rays, reach);

  Share& share = impl_->share;
  if (!share.window.open(map, reach)) {
    return stats;
  }
  impl_->carve(frame, RayWalker(lattice, origin_m, origin_key), 0, rays.size(), share);
  stats.ray_steps = share.steps;
  share.window.apply_to(map, stats);
  return stats;
}

}  // namespace stairwell::mapping
