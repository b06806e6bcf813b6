#include "mapping/octree_mirror.hpp"

#include "mapping/block_pyramid.hpp"
#include "mapping/occupancy_map.hpp"

#include <octomap/OcTree.h>

#include <cstddef>

namespace stairwell::mapping {

struct OctreeMirror::Tree : octomap::OcTree {
  using octomap::OcTree::OcTree;

  void write_block(const std::array<int, 3>& first_key, const BlockPyramid& wanted) {
    if (!wanted.top().exists()) {
      return;
    }
    const octomap::OcTreeKey key(static_cast<octomap::key_type>(first_key[0]),
                                 static_cast<octomap::key_type>(first_key[1]),
                                 static_cast<octomap::key_type>(first_key[2]));
    std::array<octomap::OcTreeNode*, 16> path{};
    const unsigned depth = tree_depth - BlockPyramid::kLevels;
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
    write_node(node, wanted, BlockPyramid::kLevels, 0);
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

  void write_node(octomap::OcTreeNode* node, const BlockPyramid& wanted, unsigned level, std::size_t index) {
    const TreeCell& cell = wanted.at(level, index);
    if (!cell.inner) {
      collapse(node, cell.log_odds);
      return;
    }
    for (unsigned child = 0; child < 8; ++child) {
      const std::size_t below = 8 * index + child;
      if (!wanted.at(level - 1, below).exists()) {
        continue;
      }
      octomap::OcTreeNode* next =
          nodeChildExists(node, child) ? getNodeChild(node, child) : createNodeChild(node, child);
      write_node(next, wanted, level - 1, below);
    }
    node->setLogOdds(cell.log_odds);
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
  tree_->write_block(first_key, BlockPyramid(log_odds));
}

void OctreeMirror::clear() { tree_->clear(); }

const octomap::OcTree& OctreeMirror::tree() const { return *tree_; }

/// Nodes, and a table of eight children for every inner node (about one in eight).
std::size_t OctreeMirror::memory_bytes() const { return tree_->size() * (tree_->memoryUsageNode() + 8); }

}  // namespace stairwell::mapping
