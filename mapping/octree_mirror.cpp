#include "mapping/octree_mirror.hpp"

#include "mapping/occupancy_map.hpp"

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace stairwell::mapping {

namespace {

constexpr unsigned kBlockLevels = 3;  // 8 = 2^3 voxels a side
constexpr std::array<std::size_t, 4> kFirstOfLevel{0, 512, 512 + 64, 512 + 64 + 8};
constexpr std::size_t kCells = 512 + 64 + 8 + 1;

/// The eight voxels of each 2x2x2 cell lie side by side (Morton order), as OctoMap numbers children.
constexpr std::array<std::uint16_t, 512> kLinearOfMorton = [] {
  std::array<std::uint16_t, 512> table{};
  for (unsigned morton = 0; morton < 512; ++morton) {
    unsigned x = 0, y = 0, z = 0;
    for (unsigned bit = 0; bit < 3; ++bit) {
      x |= ((morton >> (3 * bit)) & 1U) << bit;
      y |= ((morton >> (3 * bit + 1)) & 1U) << bit;
      z |= ((morton >> (3 * bit + 2)) & 1U) << bit;
    }
    table[morton] = static_cast<std::uint16_t>(z * 64 + y * 8 + x);
  }
  return table;
}();

/// What each node of a block's subtree has to be: value NaN = absent; inner = has children.
struct Pyramid {
  std::array<float, kCells> value;
  std::array<bool, kCells> inner;

  explicit Pyramid(const float* log_odds) {
    for (std::size_t i = 0; i < 512; ++i) {
      value[i] = log_odds[kLinearOfMorton[i]];
      inner[i] = false;
    }
    for (unsigned level = 1; level <= kBlockLevels; ++level) {
      const std::size_t count = std::size_t{512} >> (3 * level);
      for (std::size_t i = 0; i < count; ++i) {
        combine(kFirstOfLevel[level - 1] + 8 * i, kFirstOfLevel[level] + i);
      }
    }
  }

  void combine(std::size_t child, std::size_t parent) {
    bool uniform = !inner[child] && !std::isnan(value[child]);
    float highest = std::numeric_limits<float>::quiet_NaN();
    bool any = false;
    for (std::size_t i = child; i < child + 8; ++i) {
      uniform = uniform && !inner[i] && value[i] == value[child];
      if (!std::isnan(value[i]) && (!any || value[i] > highest)) {
        highest = value[i];
        any = true;
      }
    }
    value[parent] = uniform ? value[child] : highest;
    inner[parent] = any && !uniform;
  }
};

}  // namespace

struct OctreeMirror::Tree : octomap::OcTree {
  using octomap::OcTree::OcTree;

  void write_block(const std::array<int, 3>& first_key, const Pyramid& wanted) {
    if (std::isnan(wanted.value[kFirstOfLevel[kBlockLevels]])) {
      return;
    }
    const octomap::OcTreeKey key(static_cast<octomap::key_type>(first_key[0]),
                                 static_cast<octomap::key_type>(first_key[1]),
                                 static_cast<octomap::key_type>(first_key[2]));
    std::array<octomap::OcTreeNode*, 16> path{};
    const unsigned depth = tree_depth - kBlockLevels;
    bool created = false;
    if (root == nullptr) {
      root = new octomap::OcTreeNode();
      ++tree_size;
      created = true;
    }
    octomap::OcTreeNode* node = root;
    for (unsigned d = 0; d < depth; ++d) {
      path[d] = node;
      node = descend(node, octomap::computeChildIdx(key, static_cast<int>(tree_depth - 1 - d)), created);
    }
    write_node(node, wanted, kBlockLevels, 0);
    for (unsigned d = depth; d-- > 0;) {
      if (!pruneNode(path[d])) {
        path[d]->updateOccupancyChildren();
      }
    }
  }

 private:
  octomap::OcTreeNode* descend(octomap::OcTreeNode* node, unsigned child, bool& created) {
    if (!nodeChildExists(node, child)) {
      if (!nodeHasChildren(node) && !created) {
        expandNode(node);
      } else {
        created = true;
        return createNodeChild(node, child);
      }
    }
    created = false;
    return getNodeChild(node, child);
  }

  void write_node(octomap::OcTreeNode* node, const Pyramid& wanted, unsigned level, std::size_t index) {
    const std::size_t cell = kFirstOfLevel[level] + index;
    if (!wanted.inner[cell]) {
      collapse(node, wanted.value[cell]);
      return;
    }
    for (unsigned child = 0; child < 8; ++child) {
      const std::size_t below = 8 * index + child;
      if (std::isnan(wanted.value[kFirstOfLevel[level - 1] + below])) {
        continue;
      }
      octomap::OcTreeNode* next =
          nodeChildExists(node, child) ? getNodeChild(node, child) : createNodeChild(node, child);
      write_node(next, wanted, level - 1, below);
    }
    node->setLogOdds(wanted.value[cell]);
  }

  /// Makes `node` a leaf.
  void collapse(octomap::OcTreeNode* node, float log_odds) {
    if (nodeHasChildren(node)) {
      for (unsigned child = 0; child < 8; ++child) {
        collapse(nodeChildExists(node, child) ? getNodeChild(node, child) : createNodeChild(node, child), log_odds);
      }
      pruneNode(node);
    }
    node->setLogOdds(log_odds);
  }
};

OctreeMirror::OctreeMirror(double resolution_m, const OccupancyParams& params)
    : tree_(std::make_unique<Tree>(resolution_m)) {
  tree_->setProbHit(params.p_hit);
  tree_->setProbMiss(params.p_miss);
  tree_->setClampingThresMin(params.clamp_min);
  tree_->setClampingThresMax(params.clamp_max);
  tree_->setOccupancyThres(params.p_occupied);
}
OctreeMirror::~OctreeMirror() = default;

void OctreeMirror::write_block(const std::array<int, 3>& first_key, const float* log_odds) {
  tree_->write_block(first_key, Pyramid(log_odds));
}

void OctreeMirror::clear() { tree_->clear(); }

const octomap::OcTree& OctreeMirror::tree() const { return *tree_; }

/// Nodes, and a table of eight children for every inner node (about one in eight).
std::size_t OctreeMirror::memory_bytes() const { return tree_->size() * (tree_->memoryUsageNode() + 8); }

}  // namespace stairwell::mapping
