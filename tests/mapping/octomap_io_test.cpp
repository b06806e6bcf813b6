#include "mapping/octomap_io.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "octomap_reference.hpp"
#include "tests/test_folder.hpp"

#include <catch2/catch.hpp>
#include <octomap/OcTree.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;
namespace fs = std::filesystem;

namespace {

fs::path scratch(const std::string& name) {
  return testing::test_folder() / name;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream content;
  content << stream.rdbuf();
  return content.str();
}

void write_bytes(const fs::path& file, std::string_view bytes) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

OccupancyMap sample_map() {
  Rng rng = make_rng(21, "io");
  OccupancyMap map(GridSpec({{-1.5, -0.9, -0.4}, {1.1, 1.7, 2.0}}, 0.1));
  VoxelIndex v;
  for (int i = 0; i < 6; ++i) {
    const bool occupied = i % 3 == 0;
    const int x0 = rng.uniform_int(0, 15), y0 = rng.uniform_int(0, 15), z0 = rng.uniform_int(0, 12);
    for (v.z = z0; v.z < z0 + (occupied ? 2 : 12); ++v.z) {
      for (v.y = y0; v.y < y0 + 10; ++v.y) {
        for (v.x = x0; v.x < x0 + 10; ++v.x) {
          for (int times = 0; times <= i; ++times) {
            map.update(v, occupied);
          }
        }
      }
    }
  }
  return map;
}

std::string why_refused(std::string_view content, const std::string& name) {
  try {
    parse_octree(content, name);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string why_refused(const fs::path& file) {
  try {
    load_octree(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("full files come back bit for bit", "[io]") {
  const OccupancyMap map = sample_map();
  const fs::path file = scratch("round_trip.ot");
  save_octomap(map, file);
  CHECK((bytes_of(file) == ot_bytes(map.octree())));
  const auto tree = load_octree(file);
  CHECK(*tree == map.octree());
  const OccupancyMap copy = map_from_octree(*tree, map.grid());
  CHECK(copy.known_voxels() == map.known_voxels());
  CHECK((ot_bytes(copy.octree()) == ot_bytes(map.octree())));
  const OccupancyMap tight = map_from_octree(*tree);
  CHECK(tight.known_voxels() == map.known_voxels());
  CHECK_FALSE(fs::exists(scratch("round_trip.ot.partial")));
  const std::unique_ptr<octomap::AbstractOcTree> theirs(octomap::AbstractOcTree::read(file.string()));
  REQUIRE(dynamic_cast<octomap::OcTree*>(theirs.get()) != nullptr);
  CHECK(theirs->size() == map.octree().size());
}

TEST_CASE("binary files keep every voxel's class and leave the map alone", "[io]") {
  const OccupancyMap map = sample_map();
  const std::string before = ot_bytes(map.octree());
  const fs::path file = scratch("round_trip.bt");
  save_octomap(map, file);
  CHECK((ot_bytes(map.octree()) == before));
  octomap::OcTree clamped(map.octree());
  std::ostringstream theirs;
  clamped.writeBinary(theirs);
  CHECK((bytes_of(file) == theirs.str()));
  const OccupancyMap copy = map_from_octree(*load_octree(file), map.grid());
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    REQUIRE(copy.at(map.grid().voxel(i)) == map.at(map.grid().voxel(i)));
  }
  octomap::OcTree by_octomap(0.1);
  CHECK(by_octomap.readBinary(file.string()));
}

TEST_CASE("an empty map makes readable files", "[io]") {
  const OccupancyMap map(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 0.1));
  for (const char* name : {"empty.ot", "empty.bt"}) {
    save_octomap(map, scratch(name));
    const auto tree = load_octree(scratch(name));
    CHECK(tree->size() == 0);
    CHECK_THROWS_AS(map_from_octree(*tree), InputError);
    CHECK(map_from_octree(*tree, map.grid()).known_voxels() == 0);
  }
}

TEST_CASE("a tree that is one leaf keeps its class in both formats", "[io]") {
  for (const float log_odds : {2.0F, -1.0F}) {
    const std::string record(reinterpret_cast<const char*>(&log_odds), sizeof log_odds);
    const auto tree =
        parse_octree("# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n" + record + '\0', "one.ot");
    REQUIRE(tree->size() == 1);
    for (const char* name : {"one.ot", "one.bt"}) {
      CAPTURE(name, log_odds);
      save_octomap(*tree, scratch(name));
      const auto again = load_octree(scratch(name));
      for (const double at_m : {-3000.0, 0.05, 2999.0}) {
        const octomap::OcTreeNode* node = again->search(at_m, -at_m, at_m);
        REQUIRE(node != nullptr);
        CHECK(again->isNodeOccupied(node) == (log_odds > 0.0F));
      }
    }
  }
}

TEST_CASE("truncated files are refused wherever they end", "[io]") {
  const std::string name = GENERATE("truncated.ot", "truncated.bt");
  save_octomap(sample_map(), scratch(name));
  const std::string whole = bytes_of(scratch(name));
  write_bytes(scratch(name), std::string_view(whole).substr(0, whole.size() / 2));
  CHECK_THAT(why_refused(scratch(name)), Catch::Contains("truncated"));
  Rng rng = make_rng(22, name);
  for (int i = 0; i < 400; ++i) {
    const auto kept = i < 200 ? static_cast<std::size_t>(i)
                              : static_cast<std::size_t>(rng.uniform_int(200, static_cast<int>(whole.size()) - 1));
    const std::string message = why_refused(std::string_view(whole).substr(0, kept), name);
    INFO("kept " << kept << " of " << whole.size() << " bytes");
    REQUIRE_FALSE(message.empty());
    REQUIRE(message.find(name) != std::string::npos);
    REQUIRE(message.find('\n') == std::string::npos);
  }
}

TEST_CASE("damaged files are refused or read, never followed astray", "[io]") {
  const std::string name = GENERATE("damaged.ot", "damaged.bt");
  save_octomap(sample_map(), scratch(name));
  const std::string whole = bytes_of(scratch(name));
  Rng rng = make_rng(23, name);
  for (int i = 0; i < 1500; ++i) {
    std::string bytes = whole;
    for (int change = 0; change < rng.uniform_int(1, 4); ++change) {
      bytes[static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(bytes.size()) - 1))] =
          static_cast<char>(rng.uniform_int(0, 255));
    }
    try {
      const auto tree = parse_octree(bytes, name);
      REQUIRE(tree->size() <= 4 * bytes.size());  // .bt: two bytes describe up to eight leaves
    } catch (const InputError& error) {
      REQUIRE(std::string(error.what()).find(name) != std::string::npos);
    }
  }
}

TEST_CASE("files that are something else are refused by name", "[io]") {
  const fs::path file = scratch("other.ot");
  const auto refused_with = [&](std::string_view content, const std::string& why) {
    write_bytes(file, content);
    CHECK_THAT(why_refused(file), Catch::Contains("other.ot") && Catch::Contains(why));
  };
  refused_with("", "empty");
  refused_with("hello\n", "not an OctoMap file");
  refused_with("# Octomap OcTree file\nid ColorOcTree\nsize 1\nres 0.1\ndata\nxxxxx", "ColorOcTree");
  refused_with("# Octomap OcTree file\nid OcTree\nsize x\nres 0.1\ndata\n", "size");
  refused_with("# Octomap OcTree file\nid OcTree\nsize -1\nres 0.1\ndata\n", "size");
  refused_with("# Octomap OcTree file\nid OcTree\nsize 99999999999999\nres 0.1\ndata\n", "truncated");
  refused_with("# Octomap OcTree file\nid OcTree\nsize 1\nres -0.1\ndata\n", "res");
  refused_with("# Octomap OcTree file\nid OcTree\nsize 1\nres nan\ndata\n", "res");
  refused_with("# Octomap OcTree file\nid OcTree\nsize 1\ndata\n", "res");
  CHECK_THAT(why_refused(scratch("missing.bt")), Catch::Contains("missing.bt"));
  CHECK_THAT(why_refused(scratch("missing.bt").parent_path()), Catch::Contains("folder"));
  // A node chain deeper than any octree: 16 levels and one more.
  std::string deep = "# Octomap OcTree binary file\nid OcTree\nsize 40\nres 0.1\ndata\n";
  for (int level = 0; level < 30; ++level) {
    deep += std::string("\x03\x00", 2);
  }
  refused_with(deep, "deeper");
}

TEST_CASE("a small file with a huge leaf does not become a huge map", "[io]") {
  std::string bytes = "# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n";
  const float occupied = 1.0F;
  bytes.append(reinterpret_cast<const char*>(&occupied), sizeof(occupied));
  bytes += '\0';
  write_bytes(scratch("huge.ot"), bytes);
  const auto tree = load_octree(scratch("huge.ot"));
  CHECK_THROWS_AS(map_from_octree(*tree), InputError);
  const GridSpec grid({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 0.1);
  CHECK(map_from_octree(*tree, grid).occupied_voxels() == 1000);
}

TEST_CASE("two voxels far apart do not become a huge map", "[io]") {
  octomap::OcTree tree(0.1);
  tree.updateNode(octomap::point3d(0.0F, 0.0F, 0.0F), true);
  tree.updateNode(octomap::point3d(400.0F, 400.0F, 400.0F), true);
  CHECK_THROWS_AS(map_from_octree(tree), InputError);
}

TEST_CASE("a full disk or an unwritable folder leaves what was there", "[io]") {
  const OccupancyMap map = sample_map();
  const fs::path file = scratch("kept.ot");
  write_bytes(file, "what was there");
  const fs::path partial = scratch("kept.ot.partial");
  fs::remove(partial);
  fs::create_symlink("/dev/full", partial);
  CHECK_THROWS_AS(save_octomap(map, file), RunError);
  CHECK(bytes_of(file) == "what was there");
  CHECK_FALSE(fs::is_symlink(partial));

  CHECK_THROWS_AS(save_octomap(map, scratch("no/such/folder/map.bt")), RunError);
  const fs::path folder = scratch("folder.ot");
  fs::create_directories(folder / "occupied");
  CHECK_THROWS_AS(save_octomap(map, folder), RunError);
  CHECK_FALSE(fs::exists(scratch("folder.ot.partial")));
  CHECK_THROWS_AS(save_octomap(map, scratch("map.txt")), InputError);

  std::ofstream full("/dev/full", std::ios::binary);
  write_octomap(map.octree(), full, OctomapFormat::kBinary);
  CHECK_FALSE(full.good());
}

TEST_CASE("OctoMap's own sample is read", "[io]") {
  const fs::path file = fs::path(STAIRWELL_SOURCE_DIR) / "../shared/data/octomap/geb079.bt";
  if (!fs::exists(file)) {
    WARN("skipped: no shared/data/octomap/geb079.bt");
    return;
  }
  const auto tree = load_octree(file);
  CHECK(tree->size() == 532566);
  octomap::OcTree theirs(0.1);
  REQUIRE(theirs.readBinary(file.string()));
  CHECK((ot_bytes(*tree) == ot_bytes(theirs)));
  const OccupancyMap map = map_from_octree(*tree);
  CHECK((ot_bytes(map.octree()) == ot_bytes(theirs)));
}
