#include "perception/cloud_pipeline.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "perception/pcl_convert.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace {

using stairwell::InputError;
using stairwell::make_pose;
using stairwell::make_rng;
using stairwell::Rng;
using stairwell::Scan;
using stairwell::perception::CloudConfig;
using stairwell::perception::CloudPipeline;
using stairwell::perception::CloudStats;

Scan random_scan(Rng& rng, std::size_t count, double extent_m) {
  Scan scan;
  scan.T_world_sensor = make_pose({rng.uniform(-5, 5), rng.uniform(-5, 5), rng.uniform(0, 5)}, rng.uniform(-3, 3));
  scan.max_range_m = 5.0;
  scan.time_s = 1.25;
  for (std::size_t i = 0; i < count; ++i) {
    scan.points_m.emplace_back(Eigen::Vector3d(rng.uniform(-extent_m, extent_m), rng.uniform(-extent_m, extent_m),
                                               rng.uniform(-extent_m, extent_m))
                                   .cast<float>());
  }
  return scan;
}

/// Smallest distance between the segment from the sensor to the return and a point, by fine sampling in world frame.
double sampled_distance_m(const Scan& scan, const Eigen::Vector3f& point_m, const Eigen::Vector3d& fellow_m) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= 2000; ++i) {
    const Eigen::Vector3d on_ray = scan.T_world_sensor * (point_m.cast<double>() * (i / 2000.0));
    nearest = std::min(nearest, (on_ray - fellow_m).norm());
  }
  return nearest;
}

void check_sums(const CloudStats& s) {
  CHECK(s.in == s.out + s.not_finite + s.cropped + s.fellows + s.outliers + s.downsampled);
}

}  // namespace

TEST_CASE("without filters a scan passes bit for bit, in order") {
  Rng rng = make_rng(3, "test");
  const Scan scan = random_scan(rng, 500, 9.0);
  CloudStats stats;
  const Scan out = CloudPipeline().filter(scan, {}, &stats);
  CHECK(out.points_m == scan.points_m);
  CHECK(out.T_world_sensor.isApprox(scan.T_world_sensor, 0.0));
  CHECK(out.time_s == scan.time_s);
  CHECK(out.max_range_m == scan.max_range_m);
  CHECK(stats.out == 500);
  check_sums(stats);
}

TEST_CASE("NaN, infinite and too near returns are dropped and counted") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const float huge = 1e30F;  // its square overflows
  Scan scan;
  scan.points_m = {{1, 0, 0},    {nan, 0, 0},   {0, inf, 0}, {0, 0, -inf},
                   {0.1F, 0, 0}, {2, nan, nan}, {0, 3, 0},   {huge, 0, 0}};
  CloudConfig config;
  config.min_range_m = 0.3;
  CloudStats stats;
  const Scan out = CloudPipeline(config).filter(scan, {}, &stats);
  CHECK(out.points_m == std::vector<Eigen::Vector3f>{{1, 0, 0}, {0, 3, 0}});
  CHECK(stats.not_finite == 5);
  CHECK(stats.cropped == 1);
  check_sums(stats);

  scan.points_m.assign(300, Eigen::Vector3f(nan, nan, nan));
  config.voxel_m = 0.1;
  config.remove_outliers = true;
  CHECK(CloudPipeline(config).filter(scan, {{0, 0, 0}}, &stats).points_m.empty());
  check_sums(stats);
}

TEST_CASE("an empty scan stays empty, whatever is switched on") {
  CloudConfig config;
  config.voxel_m = 0.1;
  config.remove_outliers = true;
  CloudStats stats;
  CHECK(CloudPipeline(config).filter({}, {{1, 2, 3}}, &stats).points_m.empty());
  CHECK(stats.in == 0);
  check_sums(stats);
}

TEST_CASE("returns at or behind a fellow are dropped: same answer as sampling the ray") {
  Rng rng = make_rng(5, "test");
  std::size_t dropped = 0, kept = 0;
  for (int round = 0; round < 30; ++round) {
    const Scan scan = random_scan(rng, 60, 4.0);
    std::vector<Eigen::Vector3d> fellows_m;
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d offset = Eigen::Vector3d::Zero();
      while (offset.norm() < 0.8) {
        offset = {rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3)};
      }
      fellows_m.push_back(scan.T_world_sensor.translation() + offset);
    }
    const Scan out = CloudPipeline().filter(scan, fellows_m);
    for (const Eigen::Vector3f& point_m : scan.points_m) {
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector3d& fellow_m : fellows_m) {
        nearest_m = std::min(nearest_m, sampled_distance_m(scan, point_m, fellow_m));
      }
      if (std::abs(nearest_m - 0.5) < 5e-3) {
        continue;
      }
      const bool present = std::find(out.points_m.begin(), out.points_m.end(), point_m) != out.points_m.end();
      CHECK(present == (nearest_m > 0.5));
      ++(present ? kept : dropped);
    }
  }
  CHECK(kept > 300);
  CHECK(dropped > 30);
}

TEST_CASE("fellows behind the sensor, beyond the range, or without a position hide nothing") {
  Scan scan;
  scan.max_range_m = 5.0;
  scan.points_m = {{4, 0, 0}, {20, 0, 0}};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const CloudPipeline pipeline;
  CHECK(pipeline.filter(scan, {{-2, 0, 0}}).points_m.size() == 2);
  CHECK(pipeline.filter(scan, {{7, 0, 0}}).points_m.size() == 2);
  CHECK(pipeline.filter(scan, {{nan, 0, 0}}).points_m.size() == 2);
  CHECK(pipeline.filter(scan, {{2, 0.4, 0}}).points_m.empty());  // the ray beyond the range passes through it too
  CHECK(pipeline.filter(scan, {{2, 0.6, 0}}).points_m.size() == 2);
  CloudConfig off;
  off.fellow_radius_m = 0.0;
  CHECK(CloudPipeline(off).filter(scan, {{2, 0, 0}}).points_m.size() == 2);
}

TEST_CASE("outlier removal drops lone returns and keeps a wall") {
  Rng rng = make_rng(8, "test");
  Scan scan;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      scan.points_m.emplace_back(3.0F + static_cast<float>(rng.normal(0.0, 0.002)),
                                 -1.0F + 0.05F * static_cast<float>(i), -1.0F + 0.05F * static_cast<float>(j));
    }
  }
  const std::vector<Eigen::Vector3f> lone{{1, 0, 0}, {1.5F, 0.7F, 0.3F}, {2, -0.6F, 0.8F}};
  scan.points_m.insert(scan.points_m.end(), lone.begin(), lone.end());
  scan.points_m.emplace_back(50, 0, 0);  // free-space ray: not an outlier
  CloudConfig config;
  config.remove_outliers = true;
  CloudStats stats;
  const Scan out = CloudPipeline(config).filter(scan, {}, &stats);
  for (const Eigen::Vector3f& p : lone) {
    CHECK(std::find(out.points_m.begin(), out.points_m.end(), p) == out.points_m.end());
  }
  CHECK(out.points_m.back() == Eigen::Vector3f(50, 0, 0));
  CHECK(stats.outliers >= 3);
  CHECK(stats.outliers < 120);
  check_sums(stats);

  scan.points_m = lone;  // fewer than the neighbours asked for
  CHECK(CloudPipeline(config).filter(scan, {}).points_m == lone);
}

TEST_CASE("downsampling gives the centroid of every voxel and leaves returns beyond the range alone") {
  Rng rng = make_rng(9, "test");
  // 40 m at 0.02 m: more voxels than 32 bits can count at once.
  for (const auto& [extent_m, voxel_m] : {std::pair{4.0, 0.25}, std::pair{40.0, 0.02}}) {
    Scan scan = random_scan(rng, 3000, extent_m);
    scan.max_range_m = extent_m;
    for (int i = 0; i < 1000; ++i) {
      scan.points_m.push_back(scan.points_m[static_cast<std::size_t>(i)] + Eigen::Vector3f::Constant(1e-4F));
    }
    CloudConfig config;
    config.voxel_m = voxel_m;
    CloudStats stats;
    const Scan out = CloudPipeline(config).filter(scan, {}, &stats);
    check_sums(stats);
    const auto key = [leaf = 1.0F / static_cast<float>(voxel_m)](const Eigen::Vector3f& p) {
      const Eigen::Array3f k = (p.array() * leaf).floor();
      return std::array<float, 3>{k.x(), k.y(), k.z()};
    };
    std::map<std::array<float, 3>, std::pair<Eigen::Vector3d, int>> reference;
    std::vector<Eigen::Vector3f> beyond;
    for (const Eigen::Vector3f& p : scan.points_m) {
      if (p.squaredNorm() > static_cast<float>(extent_m * extent_m)) {
        beyond.push_back(p);
      } else {
        auto& [sum, count] = reference.try_emplace(key(p), Eigen::Vector3d::Zero(), 0).first->second;
        sum += p.cast<double>();
        ++count;
      }
    }
    REQUIRE(out.points_m.size() == reference.size() + beyond.size());
    CHECK(std::equal(beyond.rbegin(), beyond.rend(), out.points_m.rbegin()));
    std::size_t matched = 0;
    for (std::size_t i = 0; i < reference.size(); ++i) {
      const auto found = reference.find(key(out.points_m[i]));
      matched += found != reference.end() &&
                 (found->second.first / found->second.second - out.points_m[i].cast<double>()).norm() < 1e-4;
    }
    // A centroid within rounding of its voxel's face may fall into the next one.
    CHECK(matched >= reference.size() - 5);
  }
}

TEST_CASE("half a million returns through every step") {
  Rng rng = make_rng(10, "test");
  const Scan scan = random_scan(rng, 500000, 6.0);
  CloudConfig config;
  config.voxel_m = 0.1;
  CloudStats stats;
  const Scan out = CloudPipeline(config).filter(scan, {scan.T_world_sensor * Eigen::Vector3d(2, 0, 0)}, &stats);
  CHECK(stats.fellows > 1000);
  CHECK(stats.downsampled > 10000);
  check_sums(stats);
}

TEST_CASE("cloud configs are validated") {
  CHECK(CloudConfig{}.problems().empty());
  CloudConfig config;
  config.fellow_radius_m = -1.0;
  config.voxel_m = std::numeric_limits<double>::quiet_NaN();
  config.outlier_neighbours = 0;
  config.outlier_sigma = std::numeric_limits<double>::infinity();
  config.min_range_m = -0.1;
  CHECK(config.problems().size() == 5);
  CHECK_THROWS_AS(CloudPipeline(config), InputError);
}

TEST_CASE("conversion to PCL and back") {
  Rng rng = make_rng(11, "test");
  Scan scan = random_scan(rng, 100, 9.0);
  auto cloud = stairwell::perception::to_pcl(scan.points_m);
  CHECK(cloud->is_dense);
  CHECK(cloud->size() == 100);
  CHECK(stairwell::perception::from_pcl(*cloud) == scan.points_m);
  scan.points_m[3].x() = std::numeric_limits<float>::quiet_NaN();
  CHECK_FALSE(stairwell::perception::to_pcl(scan.points_m)->is_dense);
}
