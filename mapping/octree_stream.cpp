#include "mapping/octree_stream.hpp"

#include "core/errors.hpp"
#include "mapping/block_pyramid.hpp"

#include <octomap/octomap_utils.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

namespace stairwell::mapping {

namespace {

constexpr int kKeyOffset = 32768;
constexpr unsigned kTreeDepth = 16;
constexpr unsigned kBlockDepth = kTreeDepth - BlockPyramid::kLevels;

/// How many nodes were pruned at each depth.
using PruneCounts = std::array<std::size_t, kTreeDepth + 1>;

/// What the file makes of the map's tree: `.ot` leaves it as it is; `.bt` sets each node to one of two values and
/// prunes again.
struct FileForm {
  bool binary = false;
  float threshold = 0.0F;
  float lowest = 0.0F;
  float highest = 0.0F;
  unsigned unpruned_depth = kTreeDepth;  ///< down to here nothing is pruned again

  FileForm(const OccupancyParams& params, OctomapFormat format)
      : binary(format == OctomapFormat::kBinary),
        threshold(octomap::logodds(params.p_occupied)),
        lowest(octomap::logodds(params.clamp_min)),
        highest(octomap::logodds(params.clamp_max)) {
    if (binary) unpruned_depth = 0;  // octomap::OcTreeBaseImpl::prune spares the root
  }

  /// octomap::OccupancyOcTreeBase::nodeToMaxLikelihood
  TreeCell of(const TreeCell& cell) const {
    if (!binary || !cell.exists()) return cell;
    return {cell.log_odds >= threshold ? highest : lowest, cell.inner};
  }

  /// Makes a leaf of an inner node over eight equal ones.
  void prune(TreeCell& cell, const TreeCell* children, unsigned depth, PruneCounts& pruned) const {
    if (depth <= unpruned_depth || !cell.inner || !are_equal_leaves(children)) return;
    cell = *children;
    ++pruned[depth];
  }

  void apply(BlockPyramid& block, PruneCounts& pruned) const {
    if (!binary) return;
    for (std::size_t i = 0; i < BlockPyramid::count(0); ++i) block.at(0, i) = of(block.at(0, i));
    for (unsigned level = 1; level <= BlockPyramid::kLevels; ++level) {
      for (std::size_t i = 0; i < BlockPyramid::count(level); ++i) {
        TreeCell& cell = block.at(level, i);
        cell = of(cell);
        prune(cell, block.children_of(level, i), kTreeDepth - level, pruned);
      }
    }
  }

  /// What an inner node's record says of its children: a bit each (`.ot`: there is one) or two (`.bt`: free, occupied,
  /// both for an inner node), the first child lowest.
  std::uint16_t children_word(const TreeCell* eight) const {
    unsigned word = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if (!eight[i].exists()) continue;
      const unsigned two_bits = eight[i].inner ? 3U : (eight[i].log_odds >= threshold ? 2U : 1U);
      word |= binary ? two_bits << (2 * i) : 1U << i;
    }
    return static_cast<std::uint16_t>(word);
  }
};

std::size_t nodes_below(const BlockPyramid& block, unsigned level, std::size_t index) {
  if (!block.at(level, index).inner) return 0;
  std::size_t nodes = 0;
  for (std::size_t child = 8 * index; child < 8 * index + 8; ++child) {
    if (block.at(level - 1, child).exists()) nodes += 1 + nodes_below(block, level - 1, child);
  }
  return nodes;
}

/// The tree down to the blocks, as it is in the file, in the file's order.
class TreeOutline {
 public:
  struct Node {
    float log_odds = 0.0F;
    std::uint16_t children = 0;  ///< see FileForm::children_word; none for a leaf
    bool opens_block = false;    ///< an inner node, and the nodes below are `block`'s
    std::array<std::uint16_t, 3> block{};

    VoxelIndex block_index() const { return {block[0], block[1], block[2]}; }
  };

  TreeOutline(const OccupancyMap& map, const FileForm& form) : map_(map), form_(form) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first_block_[axis] = (map.grid().first_cell()[axis] + kKeyOffset) / OccupancyMap::kBlock;
    }
    descend(0, {0, 0, 0});
  }

  const std::vector<Node>& nodes() const { return nodes_; }
  std::size_t tree_size() const { return nodes_.size() + nodes_in_blocks_; }

  /// octomap::OcTreeBaseImpl::prune goes up from the voxels and stops at the first depth where it finds nothing.
  /// @returns that depth
  unsigned depth_where_pruning_stops() const {
    unsigned depth = kTreeDepth - 1;
    while (depth > 0 && pruned_[depth] > 0) --depth;
    return depth;
  }
  bool pruned_above(unsigned depth) const {
    for (unsigned above = 1; above < depth; ++above) {
      if (pruned_[above] > 0) return true;
    }
    return false;
  }

 private:
  /// A node in the map's tree and in the file's.
  struct Twin {
    TreeCell in_map;
    TreeCell in_file;
  };

  /// @param corner lowest block of the node's cube, in blocks from the key space's lowest corner
  Twin descend(unsigned depth, const std::array<int, 3>& corner) {
    if (depth == kBlockDepth) return add_block(corner);
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    std::array<TreeCell, 8> in_map;
    std::array<TreeCell, 8> in_file;
    const int half = 1 << (kBlockDepth - depth - 1);
    for (unsigned child = 0; child < 8; ++child) {
      std::array<int, 3> child_corner = corner;
      for (unsigned axis = 0; axis < 3; ++axis) child_corner[axis] += (child >> axis & 1U) != 0 ? half : 0;
      if (!overlaps(child_corner, half)) continue;
      const Twin twin = descend(depth + 1, child_corner);
      in_map[child] = twin.in_map;
      in_file[child] = twin.in_file;
    }
    const TreeCell cell = parent_of(in_map.data());
    Twin twin{cell, form_.of(cell)};
    form_.prune(twin.in_file, in_file.data(), depth, pruned_);
    if (!twin.in_file.inner) nodes_.resize(at + (twin.in_file.exists() ? 1 : 0));  // what was below were leaves
    if (twin.in_file.exists()) nodes_[at].log_odds = twin.in_file.log_odds;
    if (twin.in_file.inner) nodes_[at].children = form_.children_word(in_file.data());
    return twin;
  }

  Twin add_block(const std::array<int, 3>& corner) {
    Node node;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.block[axis] = static_cast<std::uint16_t>(corner[axis] - first_block_[axis]);
    }
    const OccupancyMap::BlockLogOdds block = map_.block_log_odds(node.block_index());
    Twin twin;
    if (block.each == nullptr) {
      twin.in_map = {block.all, false};
      twin.in_file = form_.of(twin.in_map);
    } else {
      BlockPyramid pyramid(block.each);
      twin.in_map = pyramid.top();
      form_.apply(pyramid, pruned_);
      twin.in_file = pyramid.top();
      nodes_in_blocks_ += nodes_below(pyramid, BlockPyramid::kLevels, 0);
    }
    node.log_odds = twin.in_file.log_odds;
    node.opens_block = twin.in_file.inner;
    if (twin.in_file.exists()) nodes_.push_back(node);
    return twin;
  }

  bool overlaps(const std::array<int, 3>& corner, int size) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (corner[axis] + size <= first_block_[axis]) return false;
      if (corner[axis] >= first_block_[axis] + map_.block_count()[axis]) return false;
    }
    return true;
  }

  const OccupancyMap& map_;
  const FileForm& form_;
  std::array<int, 3> first_block_{};
  std::vector<Node> nodes_;
  std::size_t nodes_in_blocks_ = 0;
  PruneCounts pruned_{};
};

/// Nodes' records. They are a few bytes each, so they are handed to the stream many at a time.
class RecordWriter {
 public:
  RecordWriter(std::ostream& stream, const FileForm& form) : stream_(stream), form_(form) {}

  /// Nothing for a leaf of a `.bt` file: its parent says it all.
  void put(float log_odds, std::uint16_t children) {
    if (used_ + 8 > buffer_.size()) flush();
    if (!form_.binary) {
      std::memcpy(buffer_.data() + used_, &log_odds, sizeof(log_odds));
      used_ += sizeof(log_odds);
      buffer_[used_++] = static_cast<char>(children);
    } else if (children != 0) {
      buffer_[used_++] = static_cast<char>(children & 0xFFU);
      buffer_[used_++] = static_cast<char>(children >> 8U);
    }
  }

  void put_subtree(const BlockPyramid& block, unsigned level, std::size_t index) {
    const TreeCell& cell = block.at(level, index);
    if (!cell.inner) return put(cell.log_odds, 0);
    put(cell.log_odds, form_.children_word(block.children_of(level, index)));
    for (std::size_t child = 8 * index; child < 8 * index + 8; ++child) {
      if (block.at(level - 1, child).exists()) put_subtree(block, level - 1, child);
    }
  }

  void flush() {
    stream_.write(buffer_.data(), static_cast<std::streamsize>(used_));
    used_ = 0;
  }

 private:
  std::ostream& stream_;
  const FileForm& form_;
  std::vector<char> buffer_ = std::vector<char>(std::size_t{1} << 16);
  std::size_t used_ = 0;
};

std::string header(bool binary, std::size_t nodes, double resolution_m) {
  std::ostringstream text;
  text << (binary ? "# Octomap OcTree binary file" : "# Octomap OcTree file")
       << "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
       << "id OcTree\nsize " << nodes << "\nres " << resolution_m << "\ndata\n";
  return std::move(text).str();
}

/// Nodes in the order of the file: log-odds, then a byte with a bit for each child that follows.
class LeafReader {
 public:
  LeafReader(std::string_view body, OccupancyMap& map) : body_(body), map_(map) {}

  /// @param corner  of the node, in voxels of the map's grid @param edge  in voxels
  void read_node(const VoxelIndex& corner, int edge) {
    float log_odds = 0.0F;
    std::memcpy(&log_odds, body_.data() + at_, sizeof log_odds);
    const auto children = static_cast<unsigned char>(body_[at_ + sizeof log_odds]);
    at_ += sizeof log_odds + 1;
    if (children == 0) return fill(corner, edge, log_odds);
    const int half = edge / 2;
    for (int child = 0; child < 8; ++child) {
      if ((children >> child & 1) == 0) continue;
      read_node(corner + VoxelIndex{(child & 1) * half, (child >> 1 & 1) * half, (child >> 2) * half}, half);
    }
  }

 private:
  void fill(const VoxelIndex& corner, int edge, float log_odds) {
    const std::array<int, 3>& size = map_.grid().size();
    for (int z = std::max(corner.z, 0); z < std::min(corner.z + edge, size[2]); ++z)
      for (int y = std::max(corner.y, 0); y < std::min(corner.y + edge, size[1]); ++y)
        for (int x = std::max(corner.x, 0); x < std::min(corner.x + edge, size[0]); ++x)
          map_.set_log_odds({x, y, z}, log_odds);
  }

  std::string_view body_;
  OccupancyMap& map_;
  std::size_t at_ = 0;
};

}  // namespace

void read_octomap(std::string_view content, const std::string& name, OccupancyMap& map) {
  const OctomapHeader header = checked_octomap_header(content, name);
  if (header.format != OctomapFormat::kFull) throw InputError(name + ": is not a .ot file");
  const double resolution_m = map.grid().resolution_m();
  if (std::abs(header.resolution_m - resolution_m) > 1e-5 * resolution_m) {  // the header has six digits
    throw InputError(name + ": an OctoMap of " + std::to_string(header.resolution_m) + " m cannot fill a map of " +
                     std::to_string(resolution_m) + " m voxels");
  }
  if (header.nodes == 0) return;
  const std::array<int, 3>& first = map.grid().first_cell();
  LeafReader(content.substr(header.body), map)
      .read_node({-kKeyOffset - first[0], -kKeyOffset - first[1], -kKeyOffset - first[2]}, 1 << kTreeDepth);
}

void write_octomap(const OccupancyMap& map, std::ostream& stream, OctomapFormat format) {
  FileForm form(map.params(), format);
  std::optional<TreeOutline> outline(std::in_place, map, form);
  if (form.binary) {
    form.unpruned_depth = outline->depth_where_pruning_stops();
    if (outline->pruned_above(form.unpruned_depth)) outline.emplace(map, form);
  }
  stream << header(form.binary, outline->tree_size(), map.grid().resolution_m());
  RecordWriter writer(stream, form);
  PruneCounts ignored{};
  for (const TreeOutline::Node& node : outline->nodes()) {
    if (!node.opens_block) {
      writer.put(node.log_odds, node.children);
      continue;
    }
    BlockPyramid block(map.block_log_odds(node.block_index()).each);
    form.apply(block, ignored);
    writer.put_subtree(block, BlockPyramid::kLevels, 0);
  }
  writer.flush();
  stream.flush();
}

}  // namespace stairwell::mapping
