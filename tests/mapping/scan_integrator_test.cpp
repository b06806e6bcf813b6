#include "mapping/scan_integrator.hpp"

#include "core/rng.hpp"
#include "core/units.hpp"
#include "octomap_reference.hpp"

#include <catch2/catch.hpp>

#include <limits>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

Pose random_pose(Rng& rng, double reach_m) {
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.translation() =
      Eigen::Vector3d(rng.uniform(-reach_m, reach_m), rng.uniform(-reach_m, reach_m), rng.uniform(-reach_m, reach_m));
  const Eigen::Vector3d axis(rng.normal(), rng.normal(), rng.normal());
  T_world_sensor.linear() = Eigen::AngleAxisd(rng.uniform(-kPi, kPi), axis.normalized()).toRotationMatrix();
  return T_world_sensor;
}

/// Ends anywhere within the reach.
Scan random_scan(Rng& rng, int points) {
  Scan scan;
  scan.T_world_sensor = random_pose(rng, 2.0);
  scan.max_range_m = rng.uniform_int(0, 3) == 0 ? -1.0 : rng.uniform(0.5, 6.0);
  for (int i = 0; i < points; ++i) {
    Eigen::Vector3d direction(rng.normal(), rng.normal(), rng.normal());
    scan.points_m.push_back((direction.normalized() * rng.uniform(0.0, 5.0)).cast<float>());
  }
  return scan;
}

/// Everything on the lattice: voxel corners, faces and centres, axis-aligned and diagonal rays, zero length.
Scan lattice_scan(Rng& rng, int points, double resolution_m) {
  Scan scan;
  const auto coordinate = [&](int reach) {
    return 0.5 * resolution_m * static_cast<double>(rng.uniform_int(-reach, reach));
  };
  scan.T_world_sensor.translation() = Eigen::Vector3d(coordinate(20), coordinate(20), coordinate(20));
  scan.max_range_m = rng.uniform_int(0, 1) == 0 ? -1.0 : 10.0 * resolution_m;
  for (int i = 0; i < points; ++i) {
    Eigen::Vector3f p(static_cast<float>(coordinate(40)), static_cast<float>(coordinate(40)),
                      static_cast<float>(coordinate(40)));
    switch (rng.uniform_int(0, 4)) {
      case 0:
        p.y() = p.z() = 0.0F;
        break;
      case 1:
        p.x() = 0.0F;
        break;
      case 2:
        p = Eigen::Vector3f::Constant(p.x());
        break;
      case 3:
        p = rng.uniform_int(0, 5) == 0 ? Eigen::Vector3f::Zero() : p;
        break;
      default:
        break;
    }
    scan.points_m.push_back(p);
  }
  return scan;
}

void spoil(Rng& rng, Scan& scan) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -infinity}) {
    Eigen::Vector3f p(1.0F, 2.0F, 0.5F);
    p[rng.uniform_int(0, 2)] = bad;
    scan.points_m.push_back(p);
  }
}

GridSpec wide_grid(double resolution_m) {
  const double reach_m = std::max(10.0, 60.0 * resolution_m);
  return {{Eigen::Vector3d::Constant(-reach_m), Eigen::Vector3d::Constant(reach_m)}, resolution_m};
}

}  // namespace

TEST_CASE("integrated scans leave OctoMap's .ot file byte for byte", "[integrator]") {
  const bool discretize = GENERATE(false, true);
  const double resolution_m = GENERATE(0.1, 0.05, 0.25, 0.37);
  Rng rng = make_rng(7, discretize ? "discrete" : "exact");
  for (int sequence = 0; sequence < 15; ++sequence) {
    OccupancyParams params;
    if (sequence % 3 == 1) {
      params = {0.85, 0.3, 0.2, 0.9, 0.6};
    }
    OccupancyMap map(wide_grid(resolution_m), params);
    octomap::OcTree tree(resolution_m);
    set_params(tree, params);
    ScanIntegrator integrator({discretize});
    for (int i = 0; i < 6; ++i) {
      Scan scan = sequence % 2 == 0 ? random_scan(rng, 150) : lattice_scan(rng, 150, resolution_m);
      spoil(rng, scan);
      const IntegrationStats stats = integrator.integrate(scan, map);
      REQUIRE(stats.dropped_not_finite == 3);
      insert_scan(tree, scan, discretize);
      if (i % 2 == 1) {
        REQUIRE((ot_bytes(map.octree()) == ot_bytes(tree)));
      }
    }
  }
}
