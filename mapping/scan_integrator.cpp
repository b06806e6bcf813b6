#include "mapping/scan_integrator.hpp"

#include "core/errors.hpp"
#include "mapping/lane_walk.hpp"
#include "mapping/ray_walk.hpp"
#include "mapping/scan_window.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <array>
#include <barrier>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <unordered_set>
#include <utility>

namespace stairwell::mapping {

namespace {

constexpr int kMostThreads = 64;

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
    const auto to_border_m = [&](int step) {
      return static_cast<float>(lattice.to_border_m(frame.origin_key[axis], step, frame.origin_m[axis]));
    };
    frame.border_up_m[axis] = to_border_m(1);
    frame.border_down_m[axis] = to_border_m(-1);
  }
  return frame;
}

/// Leaves one ray for every voxel that holds a return, to the voxel's centre
/// (octomap::OccupancyOcTreeBase::computeDiscreteUpdate).
class EndVoxels {
 public:
  void keep_one_per_voxel(const RayLattice& lattice, const ScanKernels& kernels, RayColumns& rays) {
    lay_out(kernels.find_keys(1.0 / lattice.resolution_m(), rays));
    const std::int32_t* const keys[3] = {rays.key[0].data(), rays.key[1].data(), rays.key[2].data()};
    const std::size_t count = rays.size();
    std::size_t kept = 0;
    LatticeKey last{-1, -1, -1};
    for (std::size_t i = 0; i < count; ++i) {
      const LatticeKey key{keys[0][i], keys[1][i], keys[2][i]};
      if (key == last || ((key.x | key.y | key.z) & ~0xFFFF) != 0) continue;  // neighbours often end in one voxel
      last = key;
      if (!first_time(cell_of(key))) continue;
      const Eigen::Vector3f center_m = lattice.center_of(key);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        rays.point_m[axis][kept] = center_m[static_cast<Eigen::Index>(axis)];
      }
      ++kept;
    }
    rays.resize(kept);
    for (const std::uint64_t cell : marked_) bits_[cell >> 6] = 0;
  }

 private:
  static constexpr std::uint64_t kMostBits = std::uint64_t{1} << 28;

  /// A bit for each voxel of the returns' box, or a set where that box is too large.
  void lay_out(const LatticeBox& box) {
    marked_.clear();
    set_.clear();
    lo_ = box.lo;
    const auto side = [](int lo, int hi) { return static_cast<std::uint64_t>(std::max(hi - lo + 1, 0)); };
    extent_ = {side(box.lo.x, box.hi.x), side(box.lo.y, box.hi.y)};
    const std::uint64_t cells = extent_[0] * extent_[1] * side(box.lo.z, box.hi.z);
    dense_ = cells <= kMostBits;
    if (dense_ && bits_.size() * 64 < cells) bits_.resize((cells + 63) / 64);
  }

  std::uint64_t cell_of(const LatticeKey& key) const {
    return (static_cast<std::uint64_t>(key.z - lo_.z) * extent_[1] + static_cast<std::uint64_t>(key.y - lo_.y)) *
               extent_[0] +
           static_cast<std::uint64_t>(key.x - lo_.x);
  }
  bool first_time(std::uint64_t cell) {
    if (!dense_) return set_.insert(cell).second;
    const std::uint64_t bit = std::uint64_t{1} << (cell & 63U);
    if ((bits_[cell >> 6] & bit) != 0) return false;
    bits_[cell >> 6] |= bit;
    marked_.push_back(cell);
    return true;
  }

  LatticeKey lo_;
  std::array<std::uint64_t, 2> extent_{};  ///< along x and y
  bool dense_ = true;
  std::vector<std::uint64_t> bits_;    ///< zero between scans
  std::vector<std::uint64_t> marked_;  ///< cells whose bit is set
  std::unordered_set<std::uint64_t> set_;
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
  std::vector<RayEnd> special, for_walker;
  LatticeBox reach;
  std::size_t steps = 0;
};

struct ScanIntegrator::Impl {
  Config config;
  const ScanKernels* kernels;
  RayColumns rays;
  EndVoxels end_voxels;
  WorkerPool pool;
  std::vector<Share> shares;
  std::vector<ScanWindow*> windows;  ///< of the shares
  CarvedScan carved;                 ///< of integrate()
  std::barrier<> barrier;

  explicit Impl(const Config& config_in)
      : config(config_in),
        kernels(&lanes::kernels(config.simd)),
        pool(config.threads),
        shares(static_cast<std::size_t>(config.threads)),
        barrier(config.threads) {
    for (Share& share : shares) windows.push_back(&share.window);
  }

  static RayEnd ray_end(const RayColumns& rays, std::size_t i) {
    return {{rays.end_m[0][i], rays.end_m[1][i], rays.end_m[2][i]},
            {rays.key[0][i], rays.key[1][i], rays.key[2][i]},
            (rays.flags[i] & RayColumns::kHit) != 0};
  }

  /// Leaves out the rays that octomap::OcTree leaves out under a bounding box, which is `limit` in keys.
  LatticeBox apply_limit(const RayLattice& lattice, const std::array<int, 3>& origin_key) {
    LatticeBox limit;
    const Eigen::Vector3f lo_m = config.limit->min_m.cast<float>();
    const Eigen::Vector3f hi_m = config.limit->max_m.cast<float>();
    if (!lattice.key_of(lo_m, limit.lo) || !lattice.key_of(hi_m, limit.hi)) {
      throw InputError("scan integration: the limit lies outside OctoMap's key space");
    }
    for (std::size_t i = 0; i < rays.size(); ++i) {
      bool inside = (rays.flags[i] & RayColumns::kHit) != 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float at_m = rays.point_m[axis][i];
        const auto a = static_cast<Eigen::Index>(axis);
        inside = inside && at_m >= lo_m[a] && at_m <= hi_m[a];
      }
      if (inside) continue;
      rays.flags[i] = RayColumns::kOutside;
      for (std::size_t axis = 0; axis < 3; ++axis) rays.key[axis][i] = origin_key[axis];
    }
    return limit;
  }

  /// Thread i's part of so many: first, and one after the last.
  std::pair<std::size_t, std::size_t> part_of(std::size_t count, int i) const {
    const auto parts = static_cast<std::size_t>(config.threads);
    const auto part = static_cast<std::size_t>(i);
    return {count * part / parts, count * (part + 1) / parts};
  }

  /// @return points that are not finite
  std::size_t transform(const ScanFrame& frame, const Scan& scan) {
    pool.run([&](int i) {
      const auto [first, last] = part_of(rays.size(), i);
      shares[static_cast<std::size_t>(i)].steps =
          kernels->transform(frame, scan.points_m.data(), first, last - first, rays);
    });
    std::size_t dropped = 0;
    for (const Share& share : shares) dropped += share.steps;
    return dropped;
  }

  /// @return `reach` grown by the ends
  LatticeBox find_ends(const ScanFrame& frame, LatticeBox reach) {
    pool.run([&](int i) {
      const auto [first, last] = part_of(rays.size(), i);
      LatticeBox& mine = shares[static_cast<std::size_t>(i)].reach;
      mine = reach;
      kernels->find_ends(frame, first, last - first, rays, mine);
    });
    for (const Share& share : shares) {
      reach.extend(share.reach.lo);
      reach.extend(share.reach.hi);
    }
    return reach;
  }

  /// Waits until all threads are here.
  void meet() {
    if (config.threads > 1) barrier.arrive_and_wait();
  }

  /// The `part`th of what the scan says, from all windows: there are as many parts as lists.
  void collect(const OccupancyMap& map, std::size_t part, CarvedScan& into) const {
    ScanWindow::take(windows, map, static_cast<int>(part), static_cast<int>(into.updates.size()), into.updates[part]);
  }

  /// Carves rays [first, last) into the share's window.
  void carve(const ScanFrame& frame, const RayWalker& walker, std::size_t first, std::size_t last, Share& part) const {
    const WindowView view = part.window.view(walker.origin_key());
    const std::int32_t tolerance = lanes::kRounding + std::min(part.window.longest_side(), lanes::kMaxSteps);
    part.steps = 0;
    part.special.clear();
    part.for_walker.clear();
    for (std::size_t at = first; at < last; at += RayBatch::kRays) {
      const std::size_t count = std::min(RayBatch::kRays, last - at);
      part.steps += kernels->prepare(frame, rays, at, count, view, part.batch);
      part.uncertain.clear();
      if (view.origin_cell >= 0) {
        kernels->walk(part.batch, count, view, tolerance, part.uncertain);
      }
      for (const std::uint32_t i : part.uncertain) part.for_walker.push_back(ray_end(rays, at + i));
      const auto* const flags = part.batch.special.data();
      if (std::accumulate(flags, flags + count, 0) == 0) continue;
      for (std::size_t i = 0; i < count; ++i) {
        if (flags[i] != 0) part.special.push_back(ray_end(rays, at + i));
      }
    }
    walker.walk(part.for_walker, part.window);
    part.steps += walker.walk(part.special, part.window);
    for (std::size_t i = first; i < last; ++i) {
      if ((rays.flags[i] & RayColumns::kHit) != 0) {
        part.window.mark_hit({rays.key[0][i], rays.key[1][i], rays.key[2][i]});
      }
    }
  }
};

ScanIntegrator::ScanIntegrator() : ScanIntegrator(Config{}) {}
ScanIntegrator::ScanIntegrator(Config config) {
  if (config.threads < 1 || config.threads > kMostThreads) {
    throw InputError("scan integration: threads must be 1 to " + std::to_string(kMostThreads) + ", got " +
                     std::to_string(config.threads));
  }
  if (config.limit && !(config.limit->min_m.allFinite() && config.limit->max_m.allFinite())) {
    throw InputError("scan integration: the limit must be finite");
  }
  impl_ = std::make_unique<Impl>(config);
}
ScanIntegrator::~ScanIntegrator() = default;
ScanIntegrator::ScanIntegrator(ScanIntegrator&&) noexcept = default;
ScanIntegrator& ScanIntegrator::operator=(ScanIntegrator&&) noexcept = default;

void ScanIntegrator::carve(const Scan& scan, const OccupancyMap& map, CarvedScan& carved, int parts) {
  if (!scan.T_world_sensor.matrix().allFinite() || std::isnan(scan.max_range_m)) {
    throw InputError("a scan has a sensor pose or maximum range that is not finite");
  }
  carved.updates.resize(static_cast<std::size_t>(std::max(parts, 1)));
  for (auto& list : carved.updates) list.clear();
  carved.stats = {};
  IntegrationStats& stats = carved.stats;
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
  stats.dropped_not_finite = impl_->transform(frame, scan);
  if (impl_->config.discretize) {
    impl_->end_voxels.keep_one_per_voxel(lattice, *impl_->kernels, rays);
  }
  const LatticeBox reach = impl_->find_ends(frame, {origin_key, origin_key});

  std::vector<Share>& shares = impl_->shares;
  LatticeBox limit;
  if (impl_->config.limit) limit = impl_->apply_limit(lattice, frame.origin_key);
  for (Share& share : shares) {
    if (!share.window.open(map, reach, impl_->config.limit ? &limit : nullptr)) return;
  }
  const RayWalker walker(lattice, origin_m, origin_key);
  impl_->pool.run([&](int i) {
    const auto [first, last] = impl_->part_of(rays.size(), i);
    impl_->carve(frame, walker, first, last, shares[static_cast<std::size_t>(i)]);
    impl_->meet();  // the windows of all are needed now
    for (auto part = static_cast<std::size_t>(i); part < carved.updates.size(); part += shares.size()) {
      impl_->collect(map, part, carved);
    }
  });
  for (const Share& share : shares) stats.ray_steps += share.steps;
}

IntegrationStats ScanIntegrator::store(const CarvedScan& carved, OccupancyMap& map) {
  const OccupancyMap::ScanEffect effect = map.apply(carved.updates, *impl_->kernels, impl_->pool);
  IntegrationStats stats = carved.stats;
  stats.voxels_updated = effect.updated;
  stats.voxels_changed = effect.changed;
  return stats;
}

IntegrationStats ScanIntegrator::integrate(const Scan& scan, OccupancyMap& map) {
  carve(scan, map, impl_->carved, impl_->config.threads);
  return store(impl_->carved, map);
}

}  // namespace stairwell::mapping
