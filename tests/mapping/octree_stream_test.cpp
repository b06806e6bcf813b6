#include "mapping/octree_stream.hpp"

#include "mapping/octomap_io.hpp"
#include "octomap_reference.hpp"
#include "scribble.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <streambuf>
#include <string>
#include <vector>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

std::string our_bytes(const OccupancyMap& map, OctomapFormat format) {
  std::ostringstream stream;
  write_octomap(map, stream, format);
  REQUIRE(stream.good());
  return stream.str();
}

std::string their_bytes(const octomap::OcTree& tree, OctomapFormat format) {
  if (format == OctomapFormat::kFull) return ot_bytes(tree);
  octomap::OcTree copy(tree);  // writeBinary clamps what it writes
  std::ostringstream stream;
  copy.writeBinary(stream);
  return stream.str();
}

std::size_t nodes_of(const std::string& bytes) { return checked_octomap_header(bytes, "bytes").nodes; }

void require_equal(const OccupancyMap& map, const octomap::OcTree& tree) {
  for (const OctomapFormat format : {OctomapFormat::kFull, OctomapFormat::kBinary}) {
    const std::string ours = our_bytes(map, format);
    const std::string theirs = their_bytes(tree, format);
    INFO((format == OctomapFormat::kFull ? ".ot" : ".bt")
         << ", " << ours.size() << " and " << theirs.size() << " bytes");
    REQUIRE((ours == theirs));
  }
}

/// Against the tree that OctoMap's own mirror of the map is.
void require_files_of_tree(const OccupancyMap& map) { require_equal(map, map.octree()); }

void require_same_log_odds(const OccupancyMap& a, const OccupancyMap& b) {
  for (std::size_t i = 0; i < a.grid().voxel_count(); ++i) {
    const VoxelIndex v = a.grid().voxel(i);
    REQUIRE(a.at(v) == b.at(v));
    if (a.at(v) != Occupancy::kUnknown) REQUIRE(a.log_odds(v) == b.log_odds(v));
  }
}

GridSpec cube_from(const Eigen::Vector3d& first_m, int voxels, double resolution_m) {
  return {{first_m, first_m + Eigen::Vector3d::Constant(voxels * resolution_m)}, resolution_m};
}

/// Voxels of a cube whose lowest corner is the voxel `at`.
template <typename Visit>
void for_each_in_cube(const VoxelIndex& at, int size, const Visit& visit) {
  for (int i = 0; i < size * size * size; ++i) visit(at + VoxelIndex{i % size, i / size % size, i / size / size});
}

/// Cubes aligned to the tree, each of one value out of few, so that pruning happens at every level.
void patch(Rng& rng, OccupancyMap& map, const std::vector<float>& values) {
  const int size = 1 << rng.uniform_int(0, 5);
  const auto aligned = [&](int voxel, int axis) {
    const int first = map.grid().first_cell()[static_cast<std::size_t>(axis)] + 32768;
    return (voxel + first) / size * size - first;
  };
  const VoxelIndex v = random_voxel(rng, map.grid());
  const float value = values[static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(values.size()) - 1))];
  for_each_in_cube({aligned(v.x, 0), aligned(v.y, 1), aligned(v.z, 2)}, size,
                   [&](const VoxelIndex& at) { map.set_log_odds(at, value); });
}

/// A wall seen from somewhere, and rays that meet nothing.
Scan random_scan(Rng& rng) {
  Scan scan;
  scan.max_range_m = 2.5;
  scan.T_world_sensor.translation() =
      Eigen::Vector3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
  const double range_m = rng.uniform(0.5, 3.5);
  for (int i = 0; i < 250; ++i) {
    const Eigen::Vector3d direction = Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    scan.points_m.push_back((direction * range_m).cast<float>());
  }
  return scan;
}

/// Notes how much it is given at once.
class PieceMeter : public std::streambuf {
 public:
  std::streamsize largest = 0;
  std::streamsize total = 0;

 protected:
  std::streamsize xsputn(const char*, std::streamsize size) override {
    largest = std::max(largest, size);
    total += size;
    return size;
  }
  int_type overflow(int_type c) override { return ++total, traits_type::not_eof(c); }
};

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace

TEST_CASE("scans leave OctoMap's own files", "[stream]") {
  const double resolution_m = GENERATE(0.1, 0.25, 1.0 / 3.0);
  const OccupancyParams params = GENERATE(OccupancyParams{}, OccupancyParams{0.9, 0.2, 0.3, 0.8, 0.7});
  Rng rng = make_rng(41, std::to_string(resolution_m));
  const bool discretize = rng.uniform_int(0, 1) == 0;
  OccupancyMap map(GridSpec({Eigen::Vector3d::Constant(-4.0), Eigen::Vector3d::Constant(4.0)}, resolution_m), params);
  octomap::OcTree tree(resolution_m);
  set_params(tree, params);
  ScanIntegrator integrator({.discretize = discretize});
  for (int round = 0; round < 4; ++round) {
    for (int i = 0; i < 3; ++i) {
      const Scan scan = random_scan(rng);
      integrator.integrate(scan, map);
      insert_scan(tree, scan, discretize);
    }
    require_equal(map, tree);
  }
}

TEST_CASE("patches of few values leave OctoMap's files, whatever is pruned", "[stream]") {
  const std::vector<float> values =
      GENERATE(std::vector<float>{-2.0F, 3.5F}, std::vector<float>{-2.0F, -1.0F, -0.5F, kNan},
               std::vector<float>{-2.0F, -0.4F, 0.85F, 3.5F, kNan},
               std::vector<float>{-50.0F, -2.0F, 0.0F, 40.0F, kInfinity}, std::vector<float>{-kInfinity, kNan});
  const OccupancyParams params =
      GENERATE(OccupancyParams{}, OccupancyParams{0.7, 0.4, 0.1, 0.9, 0.3}, OccupancyParams{0.7, 0.4, 0.1, 0.9, 0.97});
  Rng rng = make_rng(42, "patches");
  for (int round = 0; round < 6; ++round) {
    OccupancyMap map(cube_from(Eigen::Vector3d(-1.3, -2.1, -0.7), 40, 0.1), params);
    for (int i = 0; i < 12; ++i) {
      patch(rng, map, values);
      if (i % 3 == 0) require_files_of_tree(map);
    }
  }
}

TEST_CASE("binary files are pruned as far up as OctoMap goes, and no further", "[stream]") {
  const int patch_size = GENERATE(1, 2, 4, 8, 16);
  Rng rng = make_rng(43, "levels");
  OccupancyMap map(cube_from(Eigen::Vector3d::Zero(), 64, 0.1));
  for (int i = 0; i < 64 * 64 * 64; i += patch_size * patch_size * patch_size) {
    const int side = 64 / patch_size;
    const int patch = i / (patch_size * patch_size * patch_size);
    const VoxelIndex at{patch % side * patch_size, patch / side % side * patch_size, patch / side / side * patch_size};
    const auto free = static_cast<float>(rng.uniform(-2.0, -0.1));
    for_each_in_cube(at, patch_size, [&](const VoxelIndex& v) { map.set_log_odds(v, free); });
  }
  require_files_of_tree(map);
  // One value after clamping: a leaf of 64 voxels and its ancestors if OctoMap gets past the voxels' parents.
  const std::size_t nodes = nodes_of(our_bytes(map, OctomapFormat::kBinary));
  CHECK((nodes < 20) == (patch_size == 1));
}

TEST_CASE("explored free space, whose blocks hold no values, is written as one leaf", "[stream]") {
  OccupancyMap map(cube_from(Eigen::Vector3d::Constant(-0.4), 40, 0.1));
  BlockMask everything;
  everything.miss.fill(~std::uint64_t{0});
  for (int times = 0; times < 8; ++times) {
    for_each_in_cube({0, 0, 0}, map.block_count()[0], [&](const VoxelIndex& block) { map.apply(block, everything); });
    require_files_of_tree(map);
  }
  CHECK(map.block_log_odds({1, 1, 1}).each == nullptr);
  const std::size_t nodes = nodes_of(our_bytes(map, OctomapFormat::kFull));
  map.update({20, 20, 20}, true);
  require_files_of_tree(map);
  CHECK(nodes_of(our_bytes(map, OctomapFormat::kFull)) > nodes);
}

TEST_CASE("one voxel anywhere in the key space, and none", "[stream]") {
  const double first_m = GENERATE(-3276.8, -0.8, 0.0, 3275.2);
  OccupancyMap map(cube_from(Eigen::Vector3d(first_m, -3276.8, 3275.2), 16, 0.1));
  require_files_of_tree(map);
  map.assume_free(map.grid().box().center_m(), 0.3);
  require_files_of_tree(map);
  for (const VoxelIndex v : {VoxelIndex{0, 0, 0}, VoxelIndex{15, 15, 15}, VoxelIndex{7, 8, 9}}) {
    map.update(v, v.x != 7);
    require_files_of_tree(map);
  }
  map.set_log_odds({0, 0, 0}, kNan);
  require_files_of_tree(map);
}

TEST_CASE("files load back equal", "[stream]") {
  Rng rng = make_rng(44, "back");
  for (int round = 0; round < 8; ++round) {
    OccupancyMap map(cube_from(Eigen::Vector3d(-1.1, -0.3, -2.0), 32, 0.1));
    scribble(rng, map, 30);
    for (int i = 0; i < 4; ++i) patch(rng, map, {-2.0F, -1.0F, 0.5F, kNan});
    const auto full = parse_octree(our_bytes(map, OctomapFormat::kFull), "full");
    require_same_log_odds(map_from_octree(*full, map.grid()), map);
    const auto binary = parse_octree(our_bytes(map, OctomapFormat::kBinary), "binary");
    const OccupancyMap classes = map_from_octree(*binary, map.grid());
    for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
      REQUIRE(classes.at(map.grid().voxel(i)) == map.at(map.grid().voxel(i)));
    }
  }
}

TEST_CASE("a large file is written in small pieces and makes no tree", "[stream]") {
  const OctomapFormat format = GENERATE(OctomapFormat::kFull, OctomapFormat::kBinary);
  Rng rng = make_rng(45, "pieces");
  OccupancyMap map(cube_from(Eigen::Vector3d::Zero(), 64, 0.1));
  for_each_in_cube({0, 0, 0}, 64, [&](const VoxelIndex& v) {
    if (rng.uniform_int(0, 1) == 0) map.set_log_odds(v, static_cast<float>(rng.uniform(-2.0, 2.0)));
  });
  const std::size_t before = map.memory_bytes();
  PieceMeter meter;
  std::ostream stream(&meter);
  write_octomap(map, stream, format);
  CHECK(map.memory_bytes() == before);
  CHECK(meter.largest <= 65536);
  CHECK(meter.total == static_cast<std::streamsize>(our_bytes(map, format).size()));
  CHECK(meter.total > 65536);
  map.octree();
  CHECK(map.memory_bytes() > before);
}

TEST_CASE("a .ot file is read back into the map as through OctoMap's tree", "[stream]") {
  Rng rng = make_rng(31, "octree read");
  for (int round = 0; round < 12; ++round) {
    const GridSpec grid({{-1.3, 0.2, -0.7}, {rng.uniform(0.5, 4.0), rng.uniform(1.0, 5.0), rng.uniform(0.5, 3.0)}}, 0.1);
    OccupancyMap map(grid);
    for (int i = 0; i < 3; ++i) scribble(rng, map, i);
    const std::string bytes = our_bytes(map, OctomapFormat::kFull);
    OccupancyMap back(grid);
    read_octomap(bytes, "bytes", back);
    require_same_log_odds(back, map);
    // Into a smaller grid, and one that lies beside: what lies outside is left out.
    for (const Aabb& box : {Aabb{{0.0, 0.5, 0.0}, {0.4, 1.1, 0.3}}, Aabb{{-3.0, 0.0, 0.0}, {-2.0, 3.0, 1.0}}}) {
      const GridSpec part(box, 0.1);
      OccupancyMap ours(part);
      read_octomap(bytes, "bytes", ours);
      require_same_log_odds(ours, map_from_octree(*parse_octree(bytes, "bytes"), part));
    }
  }
}

TEST_CASE("reading a .ot file into a map refuses what does not fit, by name", "[stream]") {
  OccupancyMap map(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 0.1));
  map.update({1, 2, 3}, true);
  const std::string full = our_bytes(map, OctomapFormat::kFull);
  OccupancyMap coarse(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 0.2));
  CHECK_THROWS_WITH(read_octomap(full, "a.ot", coarse), Catch::Contains("a.ot") && Catch::Contains("0.2"));
  CHECK_THROWS_WITH(read_octomap(our_bytes(map, OctomapFormat::kBinary), "a.bt", map), Catch::Contains("a.bt"));
  CHECK_THROWS_WITH(read_octomap(full.substr(0, full.size() - 1), "cut.ot", map), Catch::Contains("cut.ot"));
  OccupancyMap empty(map.grid());
  read_octomap(our_bytes(empty, OctomapFormat::kFull), "empty.ot", empty);
  CHECK(empty.known_voxels() == 0);
}
