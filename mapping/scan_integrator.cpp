#include "mapping/scan_integrator.hpp"

#include "core/errors.hpp"
#include "mapping/ray_walk.hpp"
#include "mapping/scan_window.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace stairwell::mapping {

namespace {

/// One ray for every voxel that holds a return, to the voxel's centre
/// (octomap::OccupancyOcTreeBase::computeDiscreteUpdate).
void keep_one_per_voxel(const RayLattice& lattice, std::vector<Eigen::Vector3f>& points_m) {
  std::vector<std::uint64_t> packed;  // 16 bits an axis: quicker to sort than keys
  packed.reserve(points_m.size());
  for (const Eigen::Vector3f& point_m : points_m) {
    LatticeKey key;
    if (lattice.key_of(point_m, key)) {
      packed.push_back(static_cast<std::uint64_t>(key.x) << 32 | static_cast<std::uint64_t>(key.y) << 16 |
                       static_cast<std::uint64_t>(key.z));
    }
  }
  std::sort(packed.begin(), packed.end());
  packed.erase(std::unique(packed.begin(), packed.end()), packed.end());
  points_m.clear();
  for (const std::uint64_t bits : packed) {
    points_m.push_back(lattice.center_of(LatticeKey{static_cast<int>(bits >> 32), static_cast<int>(bits >> 16 & 0xFFFF),
                                                    static_cast<int>(bits & 0xFFFF)}));
  }
}

/// octomap::OccupancyOcTreeBase::computeUpdate for one point: true if there is anything to walk or to mark.
bool make_ray(const RayLattice& lattice, const Eigen::Vector3f& origin_m, const Eigen::Vector3f& point_m,
              double max_range_m, RayEnd& ray) {
  const Eigen::Vector3f offset_m = point_m - origin_m;
  const double distance_m = octomap_norm(offset_m);
  ray.hit = max_range_m < 0.0 || distance_m <= max_range_m;
  ray.end_m = point_m;
  if (!ray.hit) {
    Eigen::Vector3f direction = offset_m;
    if (distance_m > 0.0) {
      direction /= static_cast<float>(distance_m);
    }
    ray.end_m = origin_m + direction * static_cast<float>(max_range_m);
  }
  return lattice.key_of(ray.end_m, ray.end_key);
}

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

struct ScanIntegrator::Impl {
  Config config;
  ScanWindow window;
  std::vector<RayEnd> rays;
};

ScanIntegrator::ScanIntegrator() : ScanIntegrator(Config{}) {}
ScanIntegrator::ScanIntegrator(Config config) : impl_(std::make_unique<Impl>()) { impl_->config = config; }
ScanIntegrator::~ScanIntegrator() = default;
ScanIntegrator::ScanIntegrator(ScanIntegrator&&) noexcept = default;
ScanIntegrator& ScanIntegrator::operator=(ScanIntegrator&&) noexcept = default;

IntegrationStats ScanIntegrator::integrate(const Scan& scan, OccupancyMap& map) {
  if (!scan.T_world_sensor.matrix().allFinite() || std::isnan(scan.max_range_m)) {
    throw InputError("a scan has a sensor pose or maximum range that is not finite");
  }
  IntegrationStats stats;
  stats.points = scan.points_m.size();
  std::vector<Eigen::Vector3f> points_m = world_points_of(scan);
  stats.dropped_not_finite = stats.points - points_m.size();

  const RayLattice lattice(map.grid().resolution_m());
  const Eigen::Vector3f origin_m = world_origin_of(scan);
  LatticeKey origin_key;
  if (!lattice.key_of(origin_m, origin_key)) {
    throw InputError("a scan's sensor lies outside OctoMap's key space: use a coarser resolution");
  }
  if (impl_->config.discretize) {
    keep_one_per_voxel(lattice, points_m);
  }

  LatticeBox reach{origin_key, origin_key};
  std::vector<RayEnd>& rays = impl_->rays;
  rays.clear();
  for (const Eigen::Vector3f& point_m : points_m) {
    RayEnd ray;
    if (make_ray(lattice, origin_m, point_m, scan.max_range_m, ray)) {
      reach.extend(ray.end_key);
      rays.push_back(ray);
    }
  }

  ScanWindow& window = impl_->window;
  if (!window.open(map, reach)) {
    return stats;
  }
  const RayWalker walker(lattice, origin_m, origin_key);
  stats.ray_steps = walker.walk(rays, window);
  for (const RayEnd& ray : rays) {
    if (ray.hit) {
      window.mark_hit(ray.end_key);
    }
  }
  window.apply_to(map, stats);
  return stats;
}

}  // namespace stairwell::mapping
