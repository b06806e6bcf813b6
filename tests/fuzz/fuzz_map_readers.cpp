// The fuzzer's bytes as the content of a map file; its first byte chooses the format. Every reader must give a usable
// map or throw InputError with one line that names the file.
//
// SDFormat and the formats that Assimp reads (.dae, .glb) are left out: what happens there is theirs.
#include "bytes.hpp"

#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "mapping/octree_stream.hpp"
#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/world.hpp"

#include <octomap/OcTree.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>

#include <unistd.h>

using namespace stairwell;
using fuzz::require;
using mapping::OccupancyMap;
namespace fs = std::filesystem;

namespace stairwell::sim3d {
TriangleMesh load_sdf(const fs::path& file) { fail_input(file, "not part of this program"); }
std::vector<MeshPart> load_scene(const fs::path& file) { fail_input(file, "not part of this program"); }
std::vector<MeshPart> load_mesh_parts(const fs::path& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".obj") return load_obj(file);
  return {{"", extension == ".stl" ? load_stl(file) : load_ply(file)}};
}
bool is_mesh_extension(const std::string& extension) { return extension == ".stl" || extension == ".obj"; }
}  // namespace stairwell::sim3d

namespace {

/// A folder, in memory where there is room for one, gone when the program ends.
struct Scratch {
  fs::path folder;

  Scratch() {
    std::string name = "/dev/shm/stairwell-fuzz-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) {
      name = (fs::temp_directory_path() / "stairwell-fuzz-XXXXXX").string();
      require(mkdtemp(name.data()) != nullptr, "no folder for the files");
    }
    folder = name;
    write("image.yaml", "image: content.pgm\nresolution: 0.1\norigin: [1, -2, 0.5]\n");
    write("picture.yaml", "image: content.png\nresolution: 0.1\nnegate: 1\noccupied_thresh: 0.5\n");
    write("map.pgm", "P2\n2 2\n255\n0 255 100 0\n");
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  void write(const std::string& name, std::string_view content) const {
    std::ofstream stream(folder / name, std::ios::binary | std::ios::trunc);
    stream.write(content.data(), static_cast<std::streamsize>(content.size()));
    stream.close();
    require(stream.good(), "a file cannot be written");
  }
};

void check_message(const InputError& error, const std::string& name) {
  const std::string_view message = error.what();
  require(message.find('\n') == std::string_view::npos, "a message of more than one line");
  require(message.find(name) != std::string_view::npos, "a message that does not name the file");
}

std::string bytes_of(const octomap::OcTree& tree, mapping::OctomapFormat format) {
  std::ostringstream stream;
  mapping::write_octomap(tree, stream, format);
  return stream.str();
}

/// What was read can be written and read again, and becomes a map.
void use_tree(const octomap::OcTree& tree) {
  const std::string written = bytes_of(tree, mapping::OctomapFormat::kFull);
  const auto again = mapping::parse_octree(written, "again.ot");
  require(bytes_of(*again, mapping::OctomapFormat::kFull) == written, "a tree changes when it is written and read");
  try {
    mapping::parse_octree(bytes_of(tree, mapping::OctomapFormat::kBinary), "again.bt");
  } catch (const InputError&) {
    require(false, "a tree that was read cannot be read again as .bt");
  }
  try {
    const double edge_m = 8.0 * tree.getResolution();
    const GridSpec grid({Eigen::Vector3d::Constant(-edge_m), Eigen::Vector3d::Constant(edge_m)}, tree.getResolution());
    const OccupancyMap part = mapping::map_from_octree(tree, grid);
    OccupancyMap streamed(grid);
    mapping::read_octomap(written, "again.ot", streamed);
    require(streamed.known_voxels() == part.known_voxels(), "a map read without a tree differs from one read with it");
    for (std::size_t i = 0; i < grid.voxel_count(); i += 7) {
      const VoxelIndex v = grid.voxel(i);
      const auto key = [&](int at, std::size_t axis) {
        return static_cast<octomap::key_type>(at + grid.first_cell()[axis] + 32768);
      };
      const octomap::OcTreeNode* node = tree.search(octomap::OcTreeKey(key(v.x, 0), key(v.y, 1), key(v.z, 2)));
      const float found = part.log_odds(v);
      require(node == nullptr ? std::isnan(found) : node->getLogOdds() == found, "a map differs from its file");
    }
    const OccupancyMap whole = mapping::map_from_octree(tree);
    require(whole.known_voxels() >= part.known_voxels(), "a map without some voxels of its file");
    require(whole.octree().size() > 0, "a map without nodes");
  } catch (const InputError&) {
    return;  // empty, or too large to be expanded
  }
}

void read_octree(std::string_view content) {
  try {
    use_tree(*mapping::parse_octree(content, "content"));
  } catch (const InputError& error) {
    check_message(error, "content");
  }
}

void check_world(const sim3d::World& world) {
  require(!world.mesh.triangles.empty(), "a world without triangles");
  for (const auto& triangle : world.mesh.triangles) {
    for (const std::uint32_t index : triangle) {
      require(index < world.mesh.vertices_m.size(), "a triangle without corners");
      require(world.mesh.vertices_m[index].allFinite(), "a corner that is not finite");
    }
  }
  require(world.bounds.min_m.allFinite() && world.bounds.max_m.allFinite(), "bounds that are not finite");
}

struct Format {
  const char* written;  ///< name that the content gets
  const char* read;     ///< file that is loaded
};

void read_world(const Format& format, std::string_view content) {
  static const Scratch scratch;
  scratch.write(format.written, content);
  try {
    check_world(sim3d::load_world(scratch.folder / format.read));
  } catch (const InputError& error) {
    check_message(error, scratch.folder.string());
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  std::cerr.setstate(std::ios::failbit);  // OctoMap's complaints
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array<Format, 10> kFormats{{{"content.bt", "content.bt"},
                                             {"content.ot", "content.ot"},
                                             {"content.3dmap", "content.3dmap"},
                                             {"content.yaml", "content.yaml"},
                                             {"content.pgm", "image.yaml"},
                                             {"content.png", "picture.yaml"},
                                             {"content.pcd", "content.pcd"},
                                             {"content.ply", "content.ply"},
                                             {"content.stl", "content.stl"},
                                             {"content.obj", "content.obj"}}};
  if (size == 0) return 0;
  const std::string_view content(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::size_t format = data[0] % (kFormats.size() + 1);
  if (format == kFormats.size()) {
    read_octree(content);
    return 0;
  }
  if (format < 2) read_octree(content);
  read_world(kFormats[format], content);
  return 0;
}
