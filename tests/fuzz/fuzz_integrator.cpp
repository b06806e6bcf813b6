// A few scans, made of the fuzzer's bytes, through ScanIntegrator and through OctoMap's own insertPointCloud.
//
// Left out of the comparison:
//  - with `discretize`, returns outside the key space (OctoMap wraps them round; ours leaves them out): OctoMap gets
//    the scan without them;
//  - rays between two voxels whose length underflows: OctoMap divides by zero and may not end;
//  - rays of more keys than OctoMap's KeyRay holds, and scans too long for a fuzzer (only our side runs).
#include "bytes.hpp"

#include "core/errors.hpp"
#include "mapping/ray_walk.hpp"
#include "mapping/scan_integrator.hpp"
#include "tests/mapping/octomap_reference.hpp"

#include <octomap/OcTree.h>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>

using namespace stairwell;
using namespace stairwell::mapping;
using fuzz::Bytes;
using fuzz::require;

namespace {

constexpr int kMostVoxels = 10'000;
constexpr std::int64_t kMostSteps = 10'000;

struct Setup {
  double resolution_m = 0.1;
  GridSpec grid;
  OccupancyParams params;
  ScanIntegrator::Config config;
};

double probability(Bytes& bytes) { return (bytes.byte() + 0.5) / 256.0; }

OccupancyParams take_params(Bytes& bytes) {
  OccupancyParams params;
  switch (bytes.below(4)) {
    case 0:
      params = {0.85, 0.3, 0.2, 0.9, 0.6};
      break;
    case 1:
      params = {probability(bytes), probability(bytes), probability(bytes), probability(bytes), probability(bytes)};
      break;
    case 2:
      params = {0.5, 0.5, 0.3, 0.7, 0.5};
      break;
    default:
      break;
  }
  return params;
}

GridSpec take_grid(Bytes& bytes, double resolution_m) {
  std::array<int, 3> lo{}, size{};
  const unsigned place = bytes.below(4);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size[axis] = 1 + bytes.byte() % 32;
    if (axis == place) size[axis] *= 16;
  }
  while (size[0] * size[1] * size[2] > kMostVoxels) {
    for (int& cells : size) cells = (cells + 1) / 2;
  }
  const unsigned corner = bytes.byte();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int center = bytes.signed_byte();
    lo[axis] = center - size[axis] / 2;
    if (corner >= 224) lo[axis] = (corner >> axis & 1U) != 0 ? kKeyOrigin - size[axis] : -kKeyOrigin;
  }
  const Eigen::Vector3d first(lo[0], lo[1], lo[2]);
  const Eigen::Vector3d cells(size[0], size[1], size[2]);
  return {{first * resolution_m, (first + cells) * resolution_m}, resolution_m};
}

Setup take_setup(Bytes& bytes) {
  constexpr std::array<double, 8> kResolutions_m{0.1, 0.05, 0.25, 0.37, 1.0, 0.01, 3.0, 1e-3};
  constexpr std::array<Simd, 4> kSimd{Simd::kBest, Simd::kScalar, Simd::kAvx2, Simd::kAvx512};
  Setup setup;
  setup.resolution_m = kResolutions_m[bytes.below(8)];
  setup.grid = take_grid(bytes, setup.resolution_m);
  const unsigned flags = bytes.byte();
  setup.params = take_params(bytes);
  setup.config.discretize = (flags & 1U) != 0;
  setup.config.simd = kSimd[flags >> 1 & 3U];
  if (!supported(setup.config.simd)) setup.config.simd = Simd::kBest;
  setup.config.threads = (flags >> 3 & 3U) == 3 ? 1 + static_cast<int>(flags >> 5 & 1U) * 2 : 1;
  if ((flags >> 3 & 3U) == 2) setup.config.threads = 2;
  if ((flags >> 6 & 3U) == 3) {
    Aabb limit = setup.grid.box();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      limit.min_m[axis] += 0.5 * setup.resolution_m * bytes.signed_byte();
      limit.max_m[axis] += 0.5 * setup.resolution_m * bytes.signed_byte();
    }
    setup.config.limit = limit;
  }
  return setup;
}

float special_float(Bytes& bytes) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr std::array<float, 16> kValues{0.0F,     -0.0F,      1e-45F, -1e-38F, 1e-20F, -1e-16F, 1e-8F,     3276.8F,
                                          -3276.8F, 3276.7998F, 1e5F,   -2.2e8F, 1e20F,  -3e38F,  kInfinity, NAN};
  return kValues[bytes.below(16)];
}

/// In voxels, measured from some corner of the lattice.
float coordinate(Bytes& bytes, double resolution_m, unsigned kind) {
  switch (kind) {
    case 0:
    case 1:
      return static_cast<float>(0.5 * resolution_m * bytes.signed_byte());
    case 2:
    case 3:
      return static_cast<float>(resolution_m * bytes.value<std::int16_t>() / 512.0);
    case 4:
      return bytes.value<float>();
    default:
      return special_float(bytes);
  }
}

Pose take_pose(Bytes& bytes, const Setup& setup) {
  Pose T_world_sensor = Pose::Identity();
  const unsigned kind = bytes.below(8);
  const Eigen::Vector3d center =
      setup.grid.center_of({setup.grid.size()[0] / 2, setup.grid.size()[1] / 2, setup.grid.size()[2] / 2});
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const bool far = kind == 7;
    const auto offset_m =
        static_cast<double>(coordinate(bytes, setup.resolution_m, far ? 4 + bytes.below(2) : kind / 2));
    T_world_sensor.translation()[axis] = far ? offset_m : center[axis] + offset_m;
    if (kind == 6) T_world_sensor.translation()[axis] = bytes.value<double>();
  }
  if (const unsigned turn = bytes.below(4); turn != 0) {
    const Eigen::Quaterniond q(bytes.signed_byte(), bytes.signed_byte(), bytes.signed_byte(), bytes.signed_byte());
    if (q.norm() > 0.0) T_world_sensor.linear() = q.normalized().toRotationMatrix();
  }
  return T_world_sensor;
}

double take_range(Bytes& bytes, double resolution_m) {
  switch (bytes.below(6)) {
    case 0:
    case 1:
      return -1.0;
    case 2:
      return 0.5 * resolution_m * bytes.byte();
    case 3:
      return resolution_m * bytes.value<std::uint16_t>() / 512.0;
    case 4:
      return bytes.value<double>();
    default:
      return static_cast<double>(special_float(bytes));
  }
}

Scan take_scan(Bytes& bytes, const Setup& setup) {
  Scan scan;
  scan.T_world_sensor = take_pose(bytes, setup);
  scan.max_range_m = take_range(bytes, setup.resolution_m);
  const unsigned count = bytes.byte();
  for (unsigned i = 0; i < count && bytes.left() > 0; ++i) {
    const unsigned kind = bytes.byte();
    Eigen::Vector3f p;
    for (Eigen::Index axis = 0; axis < 3; ++axis) p[axis] = coordinate(bytes, setup.resolution_m, kind % 6);
    switch (kind / 6 % 6) {
      case 1:
        p.y() = p.z() = 0.0F;
        break;
      case 2:
        p.x() = 0.0F;
        break;
      case 3:
        p = Eigen::Vector3f::Constant(p.x());
        break;
      case 4:  // a fan of rays between this point and the one before
        for (float part = 0.0F; part < 1.0F && !scan.points_m.empty() && scan.points_m.size() < 700; part += 0.0625F) {
          scan.points_m.push_back(scan.points_m.back() + part * (p - scan.points_m.back()));
        }
        break;
      default:
        break;
    }
    scan.points_m.push_back(p);
  }
  return scan;
}

/// Keys that OctoMap walks over for this return; -1 when it cannot.
std::int64_t octomap_steps(const RayLattice& lattice, const Eigen::Vector3f& origin_m, const Eigen::Vector3f& point_m,
                           double max_range_m) {
  const Eigen::Vector3f way_m = point_m - origin_m;
  const double length_m = octomap_norm(way_m);
  Eigen::Vector3f end_m = point_m;
  if (max_range_m >= 0.0 && !(length_m <= max_range_m)) {
    const auto divisor = static_cast<float>(length_m);
    const auto range_m = static_cast<float>(max_range_m);
    end_m = origin_m + Eigen::Vector3f((length_m > 0.0 ? Eigen::Vector3f(way_m / divisor) : way_m) * range_m);
  }
  LatticeKey from, to;
  if (!lattice.key_of(origin_m, from) || !lattice.key_of(end_m, to) || from == to) return 0;
  if (!(octomap_norm(end_m - origin_m) > 1e-15)) return -1;
  const std::int64_t steps = std::abs(from.x - to.x) + std::abs(from.y - to.y) + std::abs(from.z - to.z);
  return steps < kMostSteps ? steps : -1;
}

/// Leaves out returns that only take a fuzzer's time: rays through tens of thousands of keys, after the first few.
void shorten(const Setup& setup, Scan& scan) {
  constexpr std::int64_t kMostKeys = 300'000;
  const RayLattice lattice(setup.resolution_m);
  std::int64_t total = 0;
  Scan one = scan;
  std::erase_if(scan.points_m, [&](const Eigen::Vector3f& p) {
    one.points_m.assign(1, p);
    const std::vector<Eigen::Vector3f> points_m = world_points_of(one);
    if (points_m.empty()) return false;
    const std::int64_t steps = octomap_steps(lattice, world_origin_of(one), points_m[0], scan.max_range_m);
    total += steps < 0 ? 100'000 : steps;
    return total > kMostKeys;
  });
}

/// OctoMap's side; false when it cannot take the scan.
bool insert_by_octomap(octomap::OcTree& tree, const Setup& setup, const Scan& scan) {
  const RayLattice lattice(setup.resolution_m);
  const Eigen::Vector3f origin_m = world_origin_of(scan);
  octomap::Pointcloud cloud;
  std::int64_t total = 0;
  for (const Eigen::Vector3f& point_m : world_points_of(scan)) {
    LatticeKey key;
    if (setup.config.discretize && !lattice.key_of(point_m, key)) continue;
    const Eigen::Vector3f to_m = setup.config.discretize ? lattice.center_of(key) : point_m;
    const std::int64_t steps = octomap_steps(lattice, origin_m, to_m, scan.max_range_m);
    total += steps;
    if (steps < 0 || total > kMostSteps) return false;
    cloud.push_back(test::octomap_point(point_m));
  }
  tree.insertPointCloud(cloud, test::octomap_point(origin_m), scan.max_range_m, false, setup.config.discretize);
  return true;
}

/// Whether every voxel that the tree knows lies within the map's grid.
bool covers(const GridSpec& grid, const octomap::OcTree& tree) {
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const int edge = 1 << (16 - leaf.getDepth());
    const octomap::OcTreeKey key = leaf.getIndexKey();
    for (unsigned axis = 0; axis < 3; ++axis) {
      const int first = (key[axis] & ~(edge - 1)) - kKeyOrigin - grid.first_cell()[axis];
      if (first < 0 || first + edge > grid.size()[axis]) return false;
    }
  }
  return true;
}

using ChangedKeys = std::map<std::array<int, 3>, bool>;

ChangedKeys changed_keys(const octomap::OcTree& tree) {
  ChangedKeys found;
  for (auto it = tree.changedKeysBegin(); it != tree.changedKeysEnd(); ++it) {
    found[{it->first[0], it->first[1], it->first[2]}] = it->second;
  }
  return found;
}

ChangedKeys changed_keys(const OccupancyMap& map) {
  ChangedKeys found;
  const std::array<int, 3>& first = map.grid().first_cell();
  for (const auto& [voxel, created] : map.changes()) {
    found[{voxel.x + first[0] + kKeyOrigin, voxel.y + first[1] + kKeyOrigin, voxel.z + first[2] + kKeyOrigin}] =
        created;
  }
  return found;
}

/// Counters against the voxels, and the voxels within the grid against the tree (unless it is left out).
void compare_voxels(const OccupancyMap& map, const octomap::OcTree* tree) {
  const GridSpec& grid = map.grid();
  std::size_t known = 0, occupied = 0;
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const Occupancy at = map.at(v);
    const float found = map.log_odds(v);
    known += at == Occupancy::kUnknown ? 0 : 1;
    occupied += at == Occupancy::kOccupied ? 1 : 0;
    require(std::isnan(found) == (at == Occupancy::kUnknown), "class and value of a voxel disagree");
    if (tree == nullptr) continue;
    const auto key = [&](int at_axis, std::size_t axis) {
      return static_cast<octomap::key_type>(at_axis + grid.first_cell()[axis] + kKeyOrigin);
    };
    const octomap::OcTreeNode* node = tree->search(octomap::OcTreeKey(key(v.x, 0), key(v.y, 1), key(v.z, 2)));
    require((node != nullptr) == !std::isnan(found), "a voxel is known to one map only");
    if (node == nullptr) continue;
    require(node->getLogOdds() == found, "a voxel's value differs from OctoMap's");
    require(tree->isNodeOccupied(*node) == (at == Occupancy::kOccupied), "a voxel's class differs from OctoMap's");
  }
  require(known == map.known_voxels(), "the number of known voxels is wrong");
  require(occupied == map.occupied_voxels(), "the number of occupied voxels is wrong");
}

bool usable(const Setup& setup, const Scan& scan) {
  const RayLattice lattice(setup.resolution_m);
  LatticeKey key;
  bool good = scan.T_world_sensor.matrix().allFinite() && !std::isnan(scan.max_range_m) &&
              lattice.key_of(world_origin_of(scan), key);
  if (setup.config.limit) {
    good = good && lattice.key_of(setup.config.limit->min_m.cast<float>(), key) &&
           lattice.key_of(setup.config.limit->max_m.cast<float>(), key);
  }
  return good;
}

void compare_scans(const Setup& setup, Bytes& bytes) {
  OccupancyMap map(setup.grid, setup.params);
  map.detect_changes(true);
  ScanIntegrator integrator(setup.config);
  octomap::OcTree tree(setup.resolution_m);
  test::set_params(tree, setup.params);
  tree.enableChangeDetection(true);
  LatticeKey any;
  const RayLattice lattice(setup.resolution_m);
  if (setup.config.limit && lattice.key_of(setup.config.limit->min_m.cast<float>(), any) &&
      lattice.key_of(setup.config.limit->max_m.cast<float>(), any)) {
    octomap::point3d lo = test::octomap_point(setup.config.limit->min_m.cast<float>());
    octomap::point3d hi = test::octomap_point(setup.config.limit->max_m.cast<float>());
    tree.useBBXLimit(true);
    tree.setBBXMin(lo);
    tree.setBBXMax(hi);
  }
  bool comparable = true;
  for (unsigned left = 1 + bytes.below(4); left > 0 && bytes.left() > 0; --left) {
    Scan scan = take_scan(bytes, setup);
    shorten(setup, scan);
    bool taken = true;
    try {
      const IntegrationStats stats = integrator.integrate(scan, map);
      require(stats.points == scan.points_m.size() &&
                  stats.dropped_not_finite == stats.points - world_points_of(scan).size() &&
                  stats.voxels_changed <= stats.voxels_updated && map.known_voxels() <= setup.grid.voxel_count(),
              "statistics are wrong");
    } catch (const InputError&) {
      taken = false;
    }
    require(taken == usable(setup, scan), taken ? "an unusable scan was taken" : "a usable scan was refused");
    comparable = comparable && (!taken || insert_by_octomap(tree, setup, scan));
  }
  compare_voxels(map, comparable ? &tree : nullptr);
  if (comparable && covers(setup.grid, tree)) {
    require(test::ot_bytes(map.octree()) == test::ot_bytes(tree), "the .ot bytes differ from OctoMap's");
    require(changed_keys(map) == changed_keys(tree), "the changes differ from OctoMap's");
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  std::cerr.setstate(std::ios::failbit);  // OctoMap's complaints
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const Setup setup = take_setup(bytes);
  if (!setup.params.problems().empty()) {
    bool refused = false;
    try {
      const OccupancyMap map(setup.grid, setup.params);
    } catch (const InputError&) {
      refused = true;
    }
    require(refused, "unusable parameters were taken");
    return -1;  // not worth keeping
  }
  compare_scans(setup, bytes);
  return 0;
}
