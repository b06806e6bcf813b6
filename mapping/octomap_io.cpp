#include "mapping/octomap_io.hpp"

#include "core/errors.hpp"
#include "mapping/octomap_check.hpp"
#include "mapping/octree_stream.hpp"

#include <octomap/OcTree.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <streambuf>
#include <string>
#include <system_error>

namespace stairwell::mapping {

namespace {

constexpr int kKeyOffset = 32768;
constexpr unsigned kTreeDepth = 16;
/// About 2.5 GiB of blocks: what a tree with a few huge leaves may expand to.
#if defined(FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION)
constexpr double kMaxExpandedVoxels = 2e5;  // a fuzzer's time is short
constexpr std::size_t kMaxBoxVoxels = 20'000'000;
#else
constexpr double kMaxExpandedVoxels = 5e8;
/// A map holds a byte for every voxel of its box.
constexpr std::size_t kMaxBoxVoxels = 8'000'000'000;
#endif

/// A stream over bytes that somebody else owns.
class ByteBuffer : public std::streambuf {
 public:
  explicit ByteBuffer(std::string_view bytes) {
    char* begin = const_cast<char*>(bytes.data());  // streambuf's interface; only read from
    setg(begin, begin, begin + bytes.size());
  }
};

std::string read_whole(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) {
    throw InputError(file.string() + ": is a folder, not an OctoMap file");
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw InputError(file.string() + ": cannot be opened");
  }
  std::ostringstream content;
  content << stream.rdbuf();
  if (stream.bad()) {
    throw InputError(file.string() + ": cannot be read");
  }
  return std::move(content).str();
}

/// The leaf's voxels as keys.
struct LeafBox {
  std::array<int, 3> lo;
  int size;
};

LeafBox box_of(const octomap::OcTree::leaf_iterator& leaf) {
  const int size = 1 << (kTreeDepth - leaf.getDepth());
  const octomap::OcTreeKey& key = leaf.getKey();
  return {{key[0] & ~(size - 1), key[1] & ~(size - 1), key[2] & ~(size - 1)}, size};
}

OccupancyParams params_of(const octomap::OcTree& tree) {
  OccupancyParams params;
  params.p_hit = tree.getProbHit();
  params.p_miss = tree.getProbMiss();
  params.clamp_min = tree.getClampingThresMin();
  params.clamp_max = tree.getClampingThresMax();
  params.p_occupied = tree.getOccupancyThres();
  return params;
}

GridSpec grid_of(const octomap::OcTree& tree) {
  std::array<int, 3> lo{65536, 65536, 65536};
  std::array<int, 3> hi{-1, -1, -1};
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const LeafBox box = box_of(leaf);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min(lo[axis], box.lo[axis]);
      hi[axis] = std::max(hi[axis], box.lo[axis] + box.size);
    }
  }
  if (hi[0] < 0) {
    throw InputError("the OctoMap holds no voxel at all");
  }
  const double resolution_m = tree.getResolution();
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min_m[axis] = (lo[static_cast<std::size_t>(axis)] - kKeyOffset) * resolution_m;
    box.max_m[axis] = (hi[static_cast<std::size_t>(axis)] - kKeyOffset) * resolution_m;
  }
  const GridSpec grid(box, resolution_m);
  if (grid.voxel_count() > kMaxBoxVoxels) {
    throw InputError("the OctoMap's voxels lie too far apart (its box has " + std::to_string(grid.voxel_count()) +
                     " voxels): choose a smaller box");
  }
  return grid;
}

void write_checked(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write) {
  std::filesystem::path partial = file;
  partial += ".partial";
  std::error_code ignored;
  {
    std::ofstream stream(partial, std::ios::binary | std::ios::trunc);
    if (!stream) {
      throw RunError(file.string() + ": cannot be written (folder missing or not writable)");
    }
    write(stream);
    stream.close();
    if (!stream) {
      std::filesystem::remove(partial, ignored);
      throw RunError(file.string() + ": writing failed (disk full?)");
    }
  }
  std::error_code error;
  std::filesystem::rename(partial, file, error);
  if (error) {
    std::filesystem::remove(partial, ignored);
    throw RunError(file.string() + ": cannot be replaced: " + error.message());
  }
}

}  // namespace

OctomapFormat octomap_format_of(const std::filesystem::path& file) {
  if (file.extension() == ".bt") {
    return OctomapFormat::kBinary;
  }
  if (file.extension() == ".ot") {
    return OctomapFormat::kFull;
  }
  throw InputError(file.string() + ": an OctoMap file's name must end in .bt or .ot");
}

void write_octomap(const octomap::OcTree& tree, std::ostream& stream, OctomapFormat format) {
  std::ostringstream content;  // OctoMap prints about streams that fail
  if (format == OctomapFormat::kFull) {
    tree.write(content);
  } else {
    octomap::OcTree copy(tree);  // writeBinary clamps what it writes
    // The format tells a leaf's class in its parent's record: a tree of one leaf would come back as an unknown one.
    if (copy.getRoot() != nullptr && !copy.nodeHasChildren(copy.getRoot())) copy.expandNode(copy.getRoot());
    copy.writeBinary(content);
  }
  const std::string_view bytes = content.view();
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.flush();
}

void save_octomap(const OccupancyMap& map, const std::filesystem::path& file) {
  const OctomapFormat format = octomap_format_of(file);
  write_checked(file, [&](std::ostream& stream) { write_octomap(map, stream, format); });
}

void save_octomap(const octomap::OcTree& tree, const std::filesystem::path& file) {
  const OctomapFormat format = octomap_format_of(file);
  write_checked(file, [&](std::ostream& stream) { write_octomap(tree, stream, format); });
}

std::unique_ptr<octomap::OcTree> load_octree(const std::filesystem::path& file) {
  return parse_octree(read_whole(file), file.string());
}

std::unique_ptr<octomap::OcTree> parse_octree(std::string_view content, const std::string& name) {
  const OctomapHeader header = checked_octomap_header(content, name);
  auto tree = std::make_unique<octomap::OcTree>(header.resolution_m);
  if (header.nodes == 0) {
    return tree;
  }
  ByteBuffer buffer(content.substr(header.body));
  std::istream stream(&buffer);
  if (header.format == OctomapFormat::kFull) {
    tree->readData(stream);
  } else {
    tree->readBinaryData(stream);
  }
  if (!stream || tree->size() != header.nodes) {
    throw InputError(name + ": damaged OctoMap file");
  }
  return tree;
}

OccupancyMap map_from_octree(const octomap::OcTree& tree) { return map_from_octree(tree, grid_of(tree)); }

OccupancyMap map_from_octree(const octomap::OcTree& tree, const GridSpec& grid) {
  if (std::abs(grid.resolution_m() - tree.getResolution()) > 1e-9 * tree.getResolution()) {
    throw InputError("an OctoMap of " + std::to_string(tree.getResolution()) + " m cannot fill a map of " +
                     std::to_string(grid.resolution_m()) + " m voxels");
  }
  OccupancyMap map(grid, params_of(tree));
  double expanded = 0.0;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const LeafBox box = box_of(leaf);
    std::array<int, 3> lo{};
    std::array<int, 3> hi{};
    double volume = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int first = box.lo[axis] - kKeyOffset - grid.first_cell()[axis];
      lo[axis] = std::max(first, 0);
      hi[axis] = std::min(first + box.size, grid.size()[axis]);
      volume *= std::max(hi[axis] - lo[axis], 0);
    }
    expanded += volume;
    if (expanded > kMaxExpandedVoxels) {
      throw InputError("the OctoMap is too large to be expanded: choose a smaller box");
    }
    VoxelIndex v;
    for (v.z = lo[2]; v.z < hi[2]; ++v.z) {
      for (v.y = lo[1]; v.y < hi[1]; ++v.y) {
        for (v.x = lo[0]; v.x < hi[0]; ++v.x) {
          map.set_log_odds(v, leaf->getLogOdds());
        }
      }
    }
  }
  return map;
}

}  // namespace stairwell::mapping
